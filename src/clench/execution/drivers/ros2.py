"""ROS 2: a joint_trajectory_controller by its topics, through `rclpy` or, without a ROS installation, `cyclonedds`.

Out: `/<controller>/joint_trajectory` (trajectory_msgs/JointTrajectory), in: `/joint_states` (sensor_msgs/JointState).
If a ROS installation has `control_msgs`, the action `/<controller>/follow_joint_trajectory` can replace the topic.
"""

from __future__ import annotations

import importlib.util
import os
import re
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Protocol

import numpy as np

from clench.core.exceptions import CommandError, UnknownNameError
from clench.core.extras import how_to_install
from clench.core.showing.short_repr import described
from clench.execution.hardware.driver import DriverError, DriverLimits, HandState, JointPath

#: Within this time, a hand that was told to stop is back at its measured angles [s].
STOP_TIME: Final = 0.1
#: State that is older is not where the hand is stopped [s]: it may be far from it by then.
STOP_AGE: Final = 0.3
#: Interval between checks of a connection that comes up [s].
LOOK: Final = 0.02


class RosInterface(StrEnum):
    """Name the program interfaces to ROS 2."""

    AUTO = "auto"
    """rclpy if installed, else cyclonedds"""
    RCLPY = "rclpy"
    """the client library of a ROS installation"""
    CYCLONEDDS = "cyclonedds"
    """DDS alone, without a ROS installation"""
    ACTION = "action"
    """the controller's action, through rclpy, with a goal for every command; tells why a controller refuses"""


@dataclass(frozen=True)
class JointStates:
    """One message of joint states.

    Args:
        positions: by joint, in rad. stamp: the sender's time [ns], 0 when it gave none.
    """

    positions: Mapping[str, float]
    stamp: int


class RosLink(Protocol):
    """Reach two topics; every method except `flush` returns without waiting."""

    name: str

    def listeners(self) -> int:
        """Return how many controllers listen to the trajectory topic."""

    def states(self) -> list[JointStates]:
        """Return the messages that have come since the last call, oldest first."""

    def publish(self, joints: Sequence[str], times: Sequence[float], positions: Sequence[Sequence[float]]) -> None:
        """Send a trajectory that starts when it arrives; times [s], positions [rad] of every point."""

    def flush(self, timeout: float) -> None:
        """Wait until the receiver has got everything sent, at most this long [s]."""

    def trajectory_topics(self) -> list[str]:
        """Return the topics on which somebody listens for trajectories."""

    def close(self) -> None:
        """Leave the network."""


class Ros2Driver:
    """Move a hand by a joint_trajectory_controller of ROS 2.

    Domain, discovery range and middleware are those of the environment (ROS_DOMAIN_ID,
    ROS_AUTOMATIC_DISCOVERY_RANGE, RMW_IMPLEMENTATION; CYCLONEDDS_URI for `cyclonedds`).

    Args:
        controller: name of the controller. joint_states: topic of the states.
        interface: program interface to ROS 2, see `RosInterface`.
        domain: number of the ROS domain; None: that of the environment, else 0.

    Raises:
        CommandError: malformed name or domain. UnknownNameError: no such interface.
    """

    limits = DriverLimits()

    def __init__(
        self,
        controller: str = "hand_controller",
        *,
        joint_states: str = "/joint_states",
        interface: RosInterface | str = RosInterface.AUTO,
        domain: int | None = None,
    ) -> None:
        if interface not in list(RosInterface):
            raise UnknownNameError("interface", str(interface), "ROS 2", [i.value for i in RosInterface])
        self.interface = RosInterface(interface)
        self.topic = topic_name(controller, "controller") + "/joint_trajectory"
        self.state_topic = topic_name(joint_states, "joint_states")
        self.domain = ros_domain(domain)
        self._link: RosLink | None = None
        self._through = ""
        self._lock = threading.Lock()
        self._positions: dict[str, float] = {}
        self._received: dict[str, float] = {}
        self._stamps: dict[str, int] = {}
        #: Time of sending, the path from there on, and its first index among the points.
        self._sent: tuple[float, JointPath] | None = None

    def __repr__(self) -> str:
        return described(self, topic=self.topic, joint_states=self.state_topic, domain=self.domain)

    @property
    def name(self) -> str:
        """`ros2`, and the interface."""
        return f"ros2 ({self._through})" if self._through else "ros2"

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints whose states came in."""
        return tuple(self._positions)

    def connect(self, timeout: float) -> None:
        """Wait for a controller that listens and for a first state, at most so long [s].

        Raises:
            CommandError: neither rclpy nor cyclonedds is installed, or the requested one is missing.
            DriverError: no controller listens, or no state comes.
        """
        self.disconnect()
        self._link = open_link(self.interface, self.topic, self.state_topic, self.domain)
        self._through = self._link.name
        until = time.monotonic() + timeout
        while time.monotonic() < until:
            self._receive()
            if self._link.listeners() and self._positions:
                return
            time.sleep(LOOK)
        raise DriverError(self._silence(timeout))

    def read(self) -> HandState:
        """Return the newest position of every joint; a state that repeats its stamp counts as the old one."""
        self._receive()
        return self._state()

    def _state(self) -> HandState:
        with self._lock:
            now = time.monotonic()  # after all that was received, by other threads too: no state has a negative age
            return HandState(dict(self._positions), {name: now - at for name, at in self._received.items()})

    def command(self, path: JointPath) -> None:
        """Send a path that replaces the controller's present one.

        The path begins with the present targets of the joints. Otherwise the controller would start from the measured
        angles, which lag behind, and step back at every command.

        Raises:
            DriverError: no subscriber is left.
        """
        link = self._connected()
        if not link.listeners():
            raise DriverError(f"Nobody listens on '{self.topic}' any more.")
        now = time.monotonic()
        at = self._positions if self._sent is None else self._sent[1].at(now - self._sent[0])
        times = np.concatenate([[0.0], path.times])
        positions = np.vstack([[at[name] for name in path.joints], path.positions])
        self._sent = (now, JointPath(path.joints, times, positions, path.period))  # first: a stop may come meanwhile
        link.publish(path.joints, times.tolist(), positions.tolist())

    def stop(self) -> None:
        """Tell the controller to hold where the joints were measured last, or were told to be by now.

        Raises:
            DriverError: not connected.
        """
        sent = self._sent
        if sent is None:
            return
        link, (at, path) = self._connected(), sent
        with suppress(DriverError):  # what the link has to report must not keep the hand from being stopped
            self._receive()
        state, told = self._state(), path.at(time.monotonic() - at)
        fresh = state.age(path.joints) <= STOP_AGE
        link.publish(
            path.joints,
            [STOP_TIME],
            [[state.positions.get(name, told[name]) if fresh else told[name] for name in path.joints]],
        )
        link.flush(STOP_TIME)

    def disconnect(self) -> None:
        """Leave the network and forget the last readings."""
        link, self._link = self._link, None
        if link is not None:
            link.close()
        self._sent = None
        with self._lock:
            self._positions.clear()
            self._received.clear()
            self._stamps.clear()

    def _connected(self) -> RosLink:
        if self._link is None:
            raise DriverError("ROS 2 is not connected.")
        return self._link

    def _receive(self) -> None:
        messages, now = self._connected().states(), time.monotonic()
        with self._lock:
            for message in messages:
                for name, position in message.positions.items():
                    self._positions[name] = position
                    if message.stamp == 0 or self._stamps.get(name) != message.stamp:
                        self._received[name] = now
                    self._stamps[name] = message.stamp

    def _silence(self, timeout: float) -> str:
        link = self._connected()
        where = f"(waited {timeout:g} s, domain {self.domain}, {link.name})"
        if link.listeners():
            return f"'{self.state_topic}' is silent {where}: no joint state came."
        others = link.trajectory_topics()
        heard = f" Trajectories are listened for on: {', '.join(others)}." if others else ""
        return f"No controller listens on '{self.topic}' {where}.{heard}"


def open_link(interface: RosInterface, topic: str, state_topic: str, domain: int) -> RosLink:
    """Join the network through an installed interface.

    Raises:
        CommandError: neither rclpy nor cyclonedds is installed, or the requested one is missing.
    """
    chosen = installed_interface(interface)
    if chosen is RosInterface.ACTION:
        from .action_link import ActionLink

        return ActionLink(topic, state_topic, domain)
    if chosen is RosInterface.RCLPY:
        from .rclpy_link import RclpyLink

        return RclpyLink(topic, state_topic, domain)
    from .cyclone_link import CycloneLink

    return CycloneLink(topic, state_topic, domain)


def installed_interface(interface: RosInterface) -> RosInterface:
    """Return the interface to ROS 2: the requested one, else rclpy before cyclonedds.

    Raises:
        CommandError: neither is installed, or the requested one is missing.
    """
    found = [name for name, module in _MODULES.items() if importlib.util.find_spec(module)]
    if interface is not RosInterface.AUTO and interface not in found:
        raise CommandError(f"{_MODULES[interface]} is not installed; {_ADVICE[interface]}.")
    if interface is not RosInterface.AUTO:
        return interface
    if not set(found) & {RosInterface.RCLPY, RosInterface.CYCLONEDDS}:
        raise CommandError(f"No ROS 2 found: neither rclpy nor cyclonedds is installed; {_ADVICE[interface]}.")
    return RosInterface.RCLPY if RosInterface.RCLPY in found else RosInterface.CYCLONEDDS


#: The package that each interface needs.
_MODULES: Final = {
    RosInterface.RCLPY: "rclpy",
    RosInterface.CYCLONEDDS: "cyclonedds",
    RosInterface.ACTION: "control_msgs",
}
_ADVICE: Final = {
    RosInterface.AUTO: f"source a ROS installation, or: {how_to_install('ros2')}",
    RosInterface.RCLPY: f"source a ROS installation, or: {how_to_install('ros2')}",
    RosInterface.CYCLONEDDS: "pip install cyclonedds",
    RosInterface.ACTION: "source a ROS installation that has it (no package index does)",
}


def topic_name(text: str, key: str) -> str:
    """Return an absolute topic name.

    Raises:
        CommandError: empty, or with characters that no topic has.
    """
    name = "/" + text.strip("/")
    if not re.fullmatch(r"(/[A-Za-z_][A-Za-z0-9_]*)+", name):
        raise CommandError(f"{key}: expected a ROS name such as 'hand_controller', got '{text}'.")
    return name


def ros_domain(given: int | None) -> int:
    """Return the number of the ROS domain: the argument, else the number in the environment, else 0.

    Raises:
        CommandError: not a whole number from 0 to 232.
    """
    said = os.environ.get("ROS_DOMAIN_ID", "") or "0" if given is None else str(given)
    if not said.isdecimal() or int(said) > 232:
        raise CommandError(f"ROS domain: expected a whole number from 0 to 232, got '{said}'.")
    return int(said)


def on_this_machine_only() -> bool:
    """Return whether the environment asks ROS to talk within this machine only."""
    within = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() == "LOCALHOST"
    return within or os.environ.get("ROS_LOCALHOST_ONLY") == "1"
