"""A thread that always works on the newest request: nothing queues up."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable
from typing import Generic, TypeVar

Item = TypeVar("Item")


class NewestWins(Generic[Item]):
    """Work in a thread on the newest request, and drop older ones.

    Args:
        work: called with one request after another, never twice at a time. Its exceptions are printed.
        name: of the thread.
    """

    def __init__(self, work: Callable[[Item], None], name: str = "clench-viewer") -> None:
        self._work = work
        self._changed = threading.Condition()
        self._waiting: list[Item] = []
        self._busy = self._closed = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def ask(self, item: Item) -> None:
        """Ask for something; it replaces a request that the thread has not begun."""
        with self._changed:
            self._waiting[:] = [item]
            self._changed.notify_all()

    def is_outdated(self, within: float = 0.0) -> bool:
        """Say whether something newer was asked for, or is within so many seconds; for the work to leave off."""
        with self._changed:
            return self._changed.wait_for(lambda: bool(self._waiting) or self._closed, within)

    def wait(self, seconds: float) -> bool:
        """Wait until everything is done; return whether it is."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._waiting and not self._busy, seconds)

    def close(self) -> None:
        """End the thread after the item it is at."""
        with self._changed:
            self._closed = True
            self._waiting.clear()
            self._changed.notify_all()
        if self._thread is not threading.current_thread():
            self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: bool(self._waiting) or self._closed)
                if self._closed:
                    return
                item = self._waiting.pop()
                self._busy = True
            try:
                self._work(item)
            except Exception:  # the next item may well succeed
                traceback.print_exc()
            finally:
                with self._changed:
                    self._busy = False
                    self._changed.notify_all()
