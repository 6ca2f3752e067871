"""Being told to end is being told to stop the hand."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def stopped_by_signals(stop: Callable[[], None] = lambda: None) -> Iterator[None]:
    """Turn SIGTERM and SIGHUP into the interrupt that Ctrl-C is, so that whatever moves is stopped on the way out.

    Signals that were ignored before, as `nohup` and shells in the background have it, stay ignored, except SIGTERM.

    Args:
        stop: called in the signal handler, before the interrupt is raised: code of others may lose the interrupt.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        stop()
        raise KeyboardInterrupt

    numbers = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    heeded = [n for n in numbers if n == signal.SIGTERM or signal.getsignal(n) is not signal.SIG_IGN]
    before = [(number, signal.signal(number, interrupt)) for number in heeded]
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)
