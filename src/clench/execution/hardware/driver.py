"""The small interface between a hand's controller and its supervision: connect, joints, read, command, stop."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final, Protocol, runtime_checkable

import numpy as np

from clench.core.exceptions import ClenchError, CommandError
from clench.core.numbers import real_array
from clench.core.pose import FloatArray
from clench.core.showing.short_repr import short_repr


class DriverError(ClenchError):
    """Say that a controller failed while it was used: absent, silent, refusing. Execution fails; nothing was wrong
    with the input.
    """


class RefusedCommandError(DriverError):
    """Say why a command was not sent to the controller."""


@dataclass(frozen=True)
class HandState:
    """The last state that a controller reported, in its own names and units.

    Args:
        positions: of its joints. ages: how long ago each was measured, as far as known here [s]; joints that are left
            out were measured now.
    """

    positions: Mapping[str, float]
    ages: Mapping[str, float] = field(default_factory=dict)

    __repr__ = short_repr

    def age(self, names: Iterable[str]) -> float:
        """Return how long ago the oldest of some joints was measured [s]."""
        return max((self.ages.get(name, 0.0) for name in names), default=0.0)


@dataclass(frozen=True, eq=False)
class JointPath:
    """The path that a driver sends: targets of joints at future times.

    Between two points the joints move at constant speed.

    Args:
        joints: the controller's names. times: from now [s], shape (N,), rising, above 0.
        positions: in the controller's units, shape (N, J). period: when the next path is due to replace this one [s].
    """

    joints: tuple[str, ...]
    times: FloatArray
    positions: FloatArray
    period: float

    __repr__ = short_repr

    def at(self, time: float) -> dict[str, float]:
        """Return the targets at a time from the moment of sending [s]; before the first point, the first targets."""
        values = [float(np.interp(time, self.times, column)) for column in self.positions.T]
        return dict(zip(self.joints, values, strict=True))


@dataclass(frozen=True)
class DriverLimits:
    """Limits that the controller itself sets, in its own names and units.

    A joint that is left out has no limit.

    Args:
        positions: lowest and highest. velocities: largest, per second.
    """

    positions: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    velocities: Mapping[str, float] = field(default_factory=dict)

    __repr__ = short_repr


@runtime_checkable
class TendonDriver(Protocol):
    """Pull tendons: the extra methods of a driver of a tendon-driven hand, besides `HandDriver`."""

    def pull(self, tensions: FloatArray) -> None:
        """Bring the tendons to these tensions [N], shape (T,), in the order of the hand file, and keep them there.

        `stop` ends it: the joints then hold their angles.
        """


@runtime_checkable
class OneTargetDriver(Protocol):
    """Pass on one target of a path, ``path.at(path.period)``: the extra property besides `HandDriver`."""

    @property
    def one_target(self) -> bool:
        """Whether, after a pause of this program, the hand stands at that target and not at the end of the path."""


#: Members of every driver; joints and limits may come with the connection.
MEMBERS: Final = ("name", "joints", "limits", "connect", "read", "command", "stop", "disconnect")
_WHEN_CONNECTED: Final = ("joints", "limits")


def check_driver(driver: object) -> None:
    """Check that a driver has the members that it needs before it is connected.

    Raises:
        CommandError: with the driver's class and the members that are missing.
    """
    missing = [each for each in MEMBERS if each not in _WHEN_CONNECTED and not hasattr(driver, each)]
    if missing:
        listed = ", ".join(f"'{each}'" for each in missing)
        raise CommandError(f"driver: {type(driver).__name__} lacks {listed}; a driver has {', '.join(MEMBERS)}.")


def connected_joints(driver: HandDriver) -> tuple[str, ...]:
    """Return the names of a connected driver's joints.

    Raises:
        DriverError: they are missing, or no names.
    """
    joints = getattr(driver, "joints", None)
    if isinstance(joints, str) or not isinstance(joints, Iterable):
        raise DriverError(
            f"joints of {type(driver).__name__}: expected names of joints once connected, got {joints!r}."
        )
    return tuple(joints)


def connected_limits(driver: HandDriver) -> DriverLimits:
    """Return the limits of a connected driver.

    Raises:
        DriverError: it is no `DriverLimits`.
    """
    limits = getattr(driver, "limits", None)
    if not isinstance(limits, DriverLimits):
        raise DriverError(f"limits of {type(driver).__name__}: expected DriverLimits once connected, got {limits!r}.")
    return limits


def read_state(driver: HandDriver) -> HandState:
    """Return the state that a driver reads.

    Raises:
        DriverError: it is no `HandState` of numbers by joint.
    """
    state: object = driver.read()
    source = f"read() of {type(driver).__name__}"
    if not isinstance(state, HandState):
        raise DriverError(f"{source}: expected a HandState, got {state!r}.")
    for key, values in (("positions", state.positions), ("ages", state.ages)):
        if not isinstance(values, Mapping):
            raise DriverError(f"{source}: {key}: expected numbers by joint, got {values!r}.")
        for name, value in values.items():
            if np.ndim(value) or real_array(value) is None:
                raise DriverError(f"{source}: {key} of joint '{name}': expected a number, got {value!r}.")
    return state


class HandDriver(Protocol):
    """Talk to the controller of a hand, in the controller's own joint names and units.

    Every method returns within its timeout or a fraction of a second, and raises `DriverError` when the controller
    fails. A call that takes longer than 1 s is a fault. The calls of one execution come from one thread, which is not
    the caller's; only `stop` may come meanwhile from another one. A driver need not check commands: `HardwareHand`
    checks them before it calls `command`.
    """

    @property
    def name(self) -> str:
        """Name of the driver, for reports."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints that it reads and moves; known once connected."""

    @property
    def limits(self) -> DriverLimits:
        """Limits of the controller; known once connected."""

    def connect(self, timeout: float) -> None:
        """Find the controller and its joints, within a time [s]; moves nothing."""

    def read(self) -> HandState:
        """Return the newest state, without waiting for another one."""

    def command(self, path: JointPath) -> None:
        """Replace the present motion by a path; at its end the hand stands still, even if no more commands come."""

    def stop(self) -> None:
        """Make the hand stand still immediately. Any thread may call this at any time, more than once."""

    def disconnect(self) -> None:
        """Let the controller go; may be called more than once."""
