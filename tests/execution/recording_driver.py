"""A controller in memory that keeps every call in order, and at which anything may happen at any call."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from fake_driver import FakeDriver

from clench.execution.hardware.driver import HandState, JointPath

#: Calls after which the hand may move.
MOVING = ("command", "pull")


class RecordingDriver(FakeDriver):
    """Keep the names of all calls, and do something at chosen ones.

    Args:
        joints: names and where they are at first. at: by the number of the call, what happens before it is answered.
    """

    def __init__(self, joints: dict[str, float], at: dict[int, Callable[[], object]] | None = None) -> None:
        super().__init__(joints)
        self.at_call = dict(at or {})
        self.calls: list[str] = []
        self.answered: list[str] = []

    def forget(self, at: dict[int, Callable[[], object]]) -> None:
        """Begin to count anew, with other happenings."""
        self.at_call, self.calls, self.answered, self.commands = dict(at), [], [], []

    def _called(self, what: str, answer: Callable[[], Any]) -> Any:
        self.calls.append(what)
        happening = self.at_call.pop(len(self.calls), None)
        if happening is not None:
            happening()
        answer = answer()
        self.answered.append(what)
        return answer

    def connect(self, timeout: float) -> None:
        self._called("connect", lambda: FakeDriver.connect(self, timeout))

    def disconnect(self) -> None:
        self._called("disconnect", lambda: FakeDriver.disconnect(self))

    def read(self) -> HandState:
        state: HandState = self._called("read", lambda: FakeDriver.read(self))
        return state

    def command(self, path: JointPath) -> None:
        self._called("command", lambda: FakeDriver.command(self, path))

    def pull(self, tensions: np.ndarray) -> None:
        self._called("pull", lambda: None)

    def stop(self) -> None:
        self._called("stop", lambda: FakeDriver.stop(self))

    def last_order(self) -> str:
        """Return what the hand was told last: to move, or to stop; nothing without either."""
        return next((call for call in reversed(self.calls) if call in (*MOVING, "stop")), "")
