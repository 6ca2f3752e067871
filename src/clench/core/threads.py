"""Share work among threads; kernels hold no lock, so they run concurrently."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import TypeVar

Part = TypeVar("Part")


@lru_cache(maxsize=1)
def core_count() -> int:
    """Return how many cores there are; asking the system takes a tenth of a millisecond."""
    return os.cpu_count() or 1


@lru_cache(maxsize=4)
def kernel_threads(count: int) -> ThreadPoolExecutor:
    """Return so many threads for kernels to run in."""
    return ThreadPoolExecutor(count, thread_name_prefix="clench")


def share_out(work: Callable[[Part], None], parts: Iterable[Part], threads: int) -> None:
    """Do parts of a work in this thread and others; a free thread takes the next part.

    At the end, this thread does not wait for threads that have not begun, as on a busy machine.
    """
    waiting = deque(parts)

    def take_parts() -> None:
        while waiting:
            try:
                part = waiting.popleft()
            except IndexError:  # another thread took the last one in the meantime
                return
            work(part)

    others = min(threads, len(waiting)) - 1
    helpers = [kernel_threads(others).submit(take_parts) for _ in range(others)]
    try:
        take_parts()
    finally:
        waiting.clear()
        for helper in helpers:
            if not helper.cancel():
                helper.result()


# A forked process has none of its parent's threads.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=kernel_threads.cache_clear)
