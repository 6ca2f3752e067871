"""A signal that ends the program also stops the hand."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def stopped_by_signals(stop: Callable[[], None] = lambda: None) -> Iterator[None]:
    """Turn SIGTERM and SIGHUP into the interrupt of Ctrl-C, so that a moving hand is stopped on the way out.

    A shell script starts background jobs with Ctrl-C ignored; a moving hand heeds it all the same. Only SIGHUP stays
    ignored if it was, because `nohup` asks for that.

    Args:
        stop: called in the signal handler, before the interrupt is raised: code of others may lose the interrupt.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        stop()
        raise KeyboardInterrupt

    heeded = [signal.SIGINT, signal.SIGTERM]
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        heeded.append(signal.SIGHUP)
    before = [(number, signal.signal(number, interrupt)) for number in heeded]
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)
