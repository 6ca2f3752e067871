"""Call the kernels of the closing item by item, as `clench.kernels.closing.free_closing` does."""

from __future__ import annotations

from typing import Any

import clench.kernels.sections.advance as on_planes
import clench.kernels.toi.toi_work as toi_work
from clench.kernels.closing.close_item import close_item
from clench.kernels.closing.solve_layout import ObjectArrays
from clench.kernels.sections.section_overlap import look_for_overlaps


def plain(kernel: Any) -> Any:
    """Return the Python function of a kernel; without compiling the kernel is one."""
    return getattr(kernel, "py_func", kernel)


def scratch(hand: Any) -> Any:
    """Return the scratch space for a hand."""
    return plain(on_planes.make_work)(hand.chain.rate.shape[0], hand.outlines)


def close_items(
    hand: Any, exact: Any, obj: ObjectArrays, T: Any, sections: Any, items: Any, answer: Any, *, together: bool = False
) -> None:
    """Close every item once; `sections` are those of the first families, and the arena for later ones."""
    sweep = plain(toi_work.make_sweep_work)(hand.chain.rate.shape[0], exact.checked.shape[0])
    for i in range(len(items.entry)):
        close_item(hand, exact, obj, T, *sections, items, i, 1, together, scratch(hand), sweep, answer)


def find_overlaps(hand: Any, tree: Any, rounds: Any, closed: bool, T: Any, sections: Any, overlaps: Any) -> None:
    """Find outlines that overlap at the start."""
    look_for_overlaps(hand, tree, rounds, closed, T, sections, overlaps, scratch(hand))
