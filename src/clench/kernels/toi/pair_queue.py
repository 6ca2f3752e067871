"""Pairs of items in the order in which they can meet: a heap in the first rows of a sweep's stack."""

from __future__ import annotations

from clench.kernels.runtime.compiling import kernel

from .toi_work import SweepWork


@kernel
def swap_pairs(work: SweepWork, i: int, k: int) -> None:
    """Swap two pairs that wait."""
    stack, keys, since = work.stack, work.keys, work.since
    keys[i], keys[k] = keys[k], keys[i]
    since[i], since[k] = since[k], since[i]
    for column in range(3):
        stack[i, column], stack[k, column] = stack[k, column], stack[i, column]


@kernel
def lift_pair(work: SweepWork, i: int) -> None:
    """Move a pair of the heap up to where it belongs."""
    while i > 0 and work.keys[i] < work.keys[(i - 1) // 2]:
        swap_pairs(work, i, (i - 1) // 2)
        i = (i - 1) // 2


@kernel
def take_first(work: SweepWork, size: int) -> int:
    """Move the earliest pair of a heap to the heap's last row; return the size of the rest, where the pair lies."""
    size -= 1
    swap_pairs(work, 0, size)
    i = 0
    while 2 * i + 1 < size:
        k = 2 * i + 1
        if k + 1 < size and work.keys[k + 1] < work.keys[k]:
            k += 1
        if work.keys[i] <= work.keys[k]:
            break
        swap_pairs(work, i, k)
        i = k
    return size


@kernel
def take_in(work: SweepWork, size: int, row: int) -> int:
    """Take the pair of a row outside a heap into it; return its size."""
    swap_pairs(work, size, row)
    lift_pair(work, size)
    return size + 1
