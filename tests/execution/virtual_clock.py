"""A clock that goes on when it is asked to: supervision is tested to the microsecond, on a machine however busy."""

from __future__ import annotations

import threading
from collections.abc import Callable
from itertools import takewhile
from types import ModuleType

import pytest

from clench.execution.hardware import following, halting
from clench.execution.hardware.driver_line import Call
from clench.execution.hardware.supervision import Supervision


class VirtualClock:
    """Stand in for the module `time`.

    Args:
        pause: called at every look at the clock, returns by how much it went on since the last one [s].
    """

    def __init__(self, pause: Callable[[], float] = lambda: 0.0) -> None:
        self.now, self.pause = 1000.0, pause
        self.due: list[tuple[float, Callable[[], object]]] = []
        #: Set when a call of a driver hangs: then nobody waits for it any longer.
        self.hanging = threading.Event()

    def monotonic(self) -> float:
        self.sleep(self.pause())
        return self.now

    def sleep(self, seconds: float, woken: Callable[[], bool] = lambda: False) -> None:
        until = self.now + seconds
        for when, call in sorted(self.due, key=lambda entry: entry[0]):
            if when <= until and not woken():
                self.due.remove((when, call))
                self.now = max(self.now, when)
                call()
        if not woken():
            self.now = max(self.now, until)

    def after(self, seconds: float, call: Callable[[], object]) -> None:
        """Have something called when so much time went by, as another thread would."""
        self.due.append((self.now + seconds, call))

    def use(self, monkeypatch: pytest.MonkeyPatch, *modules: ModuleType) -> None:
        """Let supervision, and other modules that import `time`, look at this clock."""
        for module in (following, halting, *modules):
            monkeypatch.setattr(module, "time", self)
        monkeypatch.setattr(Supervision, "wait", lambda supervision, seconds: self._wait(supervision, seconds))
        wait = Call.wait
        monkeypatch.setattr(Call, "wait", lambda call, _: self._patiently(lambda: wait(call, 0.05)))

    def _wait(self, supervision: Supervision, seconds: float) -> None:
        self.sleep(max(seconds, 0.0), lambda: bool(supervision.cause))

    def _patiently(self, wait: Callable[[], bool]) -> bool:
        """Wait for a call of a driver, however busy the machine is, or until the call is said to hang."""
        return any(wait() for _ in takewhile(lambda _: not self.hanging.is_set(), range(1200))) or wait()
