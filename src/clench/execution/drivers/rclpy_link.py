"""Two ROS 2 topics through `rclpy`."""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from typing import Any

from clench.core.exceptions import CommandError

from .ros2 import JointStates

QUEUE = 10
#: States that may wait to be read.
WAITING = 200


class RclpyLink:
    """Reach the topics with a node of our own, which is spun in a thread.

    Raises:
        CommandError: ROS 2 is there but cannot be used, e.g. without a middleware.
    """

    name = "rclpy"

    def __init__(self, topic: str, state_topic: str, domain: int) -> None:
        with clear_import():
            from rclpy.executors import SingleThreadedExecutor
            from sensor_msgs.msg import JointState
            from trajectory_msgs.msg import JointTrajectory
        self._topic = topic
        self._waiting: deque[JointStates] = deque(maxlen=WAITING)
        self._open = ExitStack()
        #: Our node, for those who reach more than the two topics.
        self.node = self._open.enter_context(joined(domain))
        self._publisher = self.node.create_publisher(JointTrajectory, topic, _quality(reliable=True))
        # Best effort hears senders of either kind, and only the newest state counts.
        self.node.create_subscription(JointState, state_topic, self._heard, _quality(reliable=False))
        self._executor = SingleThreadedExecutor(context=self.node.context)
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def listeners(self) -> int:
        """Return how many controllers listen to the trajectory topic."""
        return int(self._publisher.get_subscription_count())

    def states(self) -> list[JointStates]:
        """Return the messages that have come since the last call, oldest first."""
        found = []
        with suppress(IndexError):  # when another thread, which stops the hand, takes the last one
            while True:
                found.append(self._waiting.popleft())
        return found

    def publish(self, joints: Sequence[str], times: Sequence[float], positions: Sequence[Sequence[float]]) -> None:
        """Send a trajectory that starts when it arrives."""
        self._publisher.publish(trajectory_message(joints, times, positions))

    def flush(self, timeout: float) -> None:
        """Wait until the receiver has got everything sent, at most this long [s]."""
        from rclpy.duration import Duration

        self._publisher.wait_for_all_acked(Duration(seconds=timeout))

    def trajectory_topics(self) -> list[str]:
        """Return the topics on which somebody listens for trajectories."""
        wanted = "trajectory_msgs/msg/JointTrajectory"
        return sorted(
            name
            for name, types in self.node.get_topic_names_and_types()
            if wanted in types and name != self._topic and self.node.count_subscribers(name)
        )

    def close(self) -> None:
        """Leave the network."""
        self._executor.shutdown(timeout_sec=1.0)
        self._thread.join(timeout=1.0)
        self._open.close()

    def _heard(self, message: Any) -> None:
        stamp = message.header.stamp
        positions = dict(zip(message.name, map(float, message.position), strict=False))
        self._waiting.append(JointStates(positions, stamp.sec * 10**9 + stamp.nanosec))


def trajectory_message(joints: Sequence[str], times: Sequence[float], positions: Sequence[Sequence[float]]) -> Any:
    """Return a trajectory_msgs/JointTrajectory that starts when it arrives."""
    from builtin_interfaces.msg import Duration
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    message = JointTrajectory(joint_names=list(joints))
    for time, values in zip(times, positions, strict=True):
        second, rest = divmod(round(time * 1e9), 10**9)
        duration = Duration(sec=second, nanosec=rest)
        message.points.append(JointTrajectoryPoint(positions=list(values), time_from_start=duration))
    return message


@contextmanager
def joined(domain: int) -> Iterator[Any]:
    """Give a node of our own in a domain, and end it; signals stay with the program.

    Raises:
        CommandError: ROS 2 is there but cannot be used, e.g. without a middleware.
    """
    with clear_import():
        import rclpy
        from rclpy.signals import SignalHandlerOptions
    context = rclpy.Context()
    rclpy.init(args=[], context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node(f"clench_{os.getpid()}", context=context)
    try:
        yield node
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


@contextmanager
def clear_import() -> Iterator[None]:
    """Turn a failed import of ROS 2 modules into one sentence."""
    try:
        yield
    except (ImportError, OSError, RuntimeError) as error:
        why = str(error).splitlines()[0]
        raise CommandError(f"rclpy is installed but does not load ({why}); is the environment sourced?") from None


def _quality(*, reliable: bool) -> Any:
    from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=QUEUE,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.VOLATILE,
    )
