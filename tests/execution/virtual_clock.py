"""A clock that goes on when it is asked to: supervision is tested to the microsecond, on a machine however busy."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType, SimpleNamespace

import pytest

from clench.execution import driven_hand, following


class VirtualClock:
    """Stand in for the module `time`.

    Args:
        pause: called at every look at the clock, returns by how much it went on since the last one [s].
    """

    def __init__(self, pause: Callable[[], float] = lambda: 0.0) -> None:
        self.now, self.pause = 1000.0, pause
        self.due: list[tuple[float, Callable[[], object]]] = []

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
        for module in (following, *modules):
            monkeypatch.setattr(module, "time", self)
        monkeypatch.setattr(driven_hand, "threading", SimpleNamespace(Event=lambda: VirtualEvent(self)))


class VirtualEvent:
    """Stand in for `threading.Event`."""

    def __init__(self, clock: VirtualClock) -> None:
        self.clock, self.happened = clock, False

    def set(self) -> None:
        self.happened = True

    def clear(self) -> None:
        self.happened = False

    def is_set(self) -> bool:
        return self.happened

    def wait(self, timeout: float) -> bool:
        self.clock.sleep(timeout, self.is_set)
        return self.happened
