"""A controller in memory that behaves like a real one: it goes along the last path and stands still at its end."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from clench.execution.hardware.driver import DriverError, DriverLimits, HandState, JointPath


class FakeDriver:
    """Follow paths by the clock, ideally; faults are set from outside.

    Args:
        joints: names and where they are at first. limits: what the controller allows.
        fault: given the seconds since the first command, called at every read; returns changes of the state:
            ``age``, ``positions`` (by name), or raises.
    """

    name = "fake"

    def __init__(
        self,
        joints: dict[str, float],
        limits: DriverLimits | None = None,
        fault: Callable[[float], dict[str, object]] = lambda _: {},
    ) -> None:
        self.joints = tuple(joints)
        self.limits = limits or DriverLimits()
        self.fault = fault
        self.start = dict(joints)
        self.path: JointPath | None = None
        self.sent_at = 0.0
        self.commands: list[JointPath] = []
        self.stops = 0
        self.stopped_after: float | None = None
        self.connected = False

    def connect(self, timeout: float) -> None:
        self.connected = True

    def disconnect(self) -> None:
        self.connected = False

    def where(self) -> dict[str, float]:
        return self.at(time.monotonic())

    def at(self, moment: float) -> dict[str, float]:
        path = self.path  # a stop from another thread takes it away
        if path is None:
            return dict(self.start)
        since = moment - self.sent_at
        times = np.concatenate([[0.0], path.times])
        return {
            **self.start,
            **{
                name: float(np.interp(since, times, [self.start[name], *path.positions[:, j]]))
                for j, name in enumerate(path.joints)
            },
        }

    def read(self) -> HandState:
        since = time.monotonic() - self.begun if self.commands else 0.0
        changes = self.fault(since)
        positions = {**self.where(), **changes.get("positions", {})}  # type: ignore[dict-item]
        age = float(changes.get("age", 0.0))  # type: ignore[arg-type]
        return HandState({k: v for k, v in positions.items() if v is not None}, dict.fromkeys(self.joints, age))

    def command(self, path: JointPath) -> None:
        if not self.connected:
            raise DriverError("not connected")
        now = time.monotonic()
        if not self.commands:
            self.begun = now
        self.start, self.path, self.sent_at = self.at(now), path, now
        self.commands.append(path)

    def stop(self) -> None:
        if self.stops == 0 and self.commands:
            self.stopped_after = time.monotonic() - self.begun
        self.stops += 1
        self.start, self.path = self.where(), None
