"""Two ROS 2 topics through DDS alone (`cyclonedds`), as ROS names them: `rt/` before the topic, `dds_` in the types."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from clench.core.exceptions import CommandError
from clench.execution.hardware.driver import DriverError

from .ros2 import JointStates, on_this_machine_only

QUEUE = 10
#: States per read.
WAITING = 200
_TRAJECTORY_TYPE = "trajectory_msgs::msg::dds_::JointTrajectory_"
_LOOPBACK = """<CycloneDDS><Domain id="any">
<General><Interfaces><NetworkInterface name="lo"/></Interfaces><AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""
#: Domains whose settings were given; they last as long as the process.
_domains: dict[int, Any] = {}


class CycloneLink:
    """Reach the topics as a participant of the domain.

    Raises:
        CommandError: the domain cannot be joined.
    """

    name = "cyclonedds"

    def __init__(self, topic: str, state_topic: str, domain: int) -> None:
        from cyclonedds.core import DDSException
        from cyclonedds.domain import DomainParticipant
        from cyclonedds.pub import DataWriter
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic

        from .dds_messages import JointState, JointTrajectory

        self._topic = topic
        try:
            prepare_domain(domain)
            self._participant = DomainParticipant(domain)
            self._writer = DataWriter(
                self._participant,
                Topic(self._participant, f"rt{topic}", JointTrajectory),
                qos=quality(reliable=True),
            )
            # Best effort hears senders of either kind, and only the newest state counts.
            self._reader = DataReader(
                self._participant,
                Topic(self._participant, f"rt{state_topic}", JointState),
                qos=quality(reliable=False),
            )
        except DDSException as error:
            raise CommandError(f"ROS domain {domain} cannot be joined through cyclonedds ({error.msg}).") from None

    def listeners(self) -> int:
        """Return how many controllers listen to the trajectory topic."""
        return len(self._writer.get_matched_subscriptions())

    def states(self) -> list[JointStates]:
        """Return the messages that have come since the last call, oldest first."""
        found = []
        for message in self._reader.take(WAITING):
            if message.sample_info.valid_data:
                stamp = message.header.stamp
                positions = dict(zip(message.name, map(float, message.position), strict=False))
                found.append(JointStates(positions, stamp.sec * 10**9 + stamp.nanosec))
        return found

    def publish(self, joints: Sequence[str], times: Sequence[float], positions: Sequence[Sequence[float]]) -> None:
        """Send a trajectory that starts when it arrives."""
        from cyclonedds.core import DDSException

        from .dds_messages import Duration, Header, JointTrajectory, JointTrajectoryPoint, Time

        points = [
            JointTrajectoryPoint(list(values), [], [], [], Duration(*divmod(round(time * 1e9), 10**9)))
            for time, values in zip(times, positions, strict=True)
        ]
        try:
            self._writer.write(JointTrajectory(Header(Time(0, 0), ""), list(joints), points))
        except DDSException as error:
            raise DriverError(f"Nothing could be sent on '{self._topic}' ({error.msg}).") from None

    def flush(self, timeout: float) -> None:
        """Wait until the receiver has got everything sent, at most this long [s]."""
        flush(self._writer, timeout)

    def trajectory_topics(self) -> list[str]:
        """Return the topics on which somebody listens for trajectories."""
        from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsSubscription

        found = BuiltinDataReader(self._participant, BuiltinTopicDcpsSubscription).take(WAITING)
        topics = {end.topic_name.removeprefix("rt") for end in found if end.type_name == _TRAJECTORY_TYPE}
        return sorted(topics - {self._topic})

    def close(self) -> None:
        """Leave the network."""
        self._reader = self._writer = self._participant = None


def prepare_domain(domain: int) -> None:
    """Keep a domain within this machine where the environment says so and gives no settings of its own."""
    from cyclonedds.domain import Domain

    if domain not in _domains and on_this_machine_only() and not os.environ.get("CYCLONEDDS_URI"):
        _domains[domain] = Domain(domain, _LOOPBACK)


def flush(writer: Any, timeout: float) -> None:
    """Wait until the receiver has got everything written, at most this long [s]."""
    from cyclonedds.core import DDSException
    from cyclonedds.util import duration

    # When the time is over, cyclonedds 11.0 looks for a code of its own in the wrong class.
    with suppress(DDSException, AttributeError):
        writer.wait_for_acks(duration(seconds=timeout))


def quality(*, reliable: bool) -> Any:
    """Return the quality of service that ROS 2 has by default, reliable or best effort."""
    from cyclonedds.qos import Policy, Qos
    from cyclonedds.util import duration

    return Qos(
        Policy.Reliability.Reliable(duration(milliseconds=100)) if reliable else Policy.Reliability.BestEffort,
        Policy.Durability.Volatile,
        Policy.History.KeepLast(QUEUE),
    )
