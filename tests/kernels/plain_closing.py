"""Call the kernels of the closing candidate by candidate, as `clench.kernels.closing.free_closing` does."""

from __future__ import annotations

from typing import Any

import clench.kernels.sections.advance as on_planes
import clench.kernels.toi.toi_work as toi_work
from clench.kernels.closing.close_candidate import close_candidate
from clench.kernels.closing.solve_layout import Closing, ObjectArrays
from clench.kernels.geometry.bodies import no_body
from clench.kernels.runtime.by_reference import kept
from clench.kernels.sections.section_overlap import look_for_overlaps


def plain(kernel: Any) -> Any:
    """Return the Python function of a kernel; without compiling the kernel is one."""
    return getattr(kernel, "py_func", kernel)


def scratch(hand: Any) -> Any:
    """Return the scratch space for a hand."""
    return plain(on_planes.make_work)(hand.chain.rate.shape[0], hand.outlines)


def close_candidates(
    hand: Any,
    full_width: Any,
    obj: ObjectArrays,
    T: Any,
    sections: Any,
    candidates: Any,
    answer: Any,
    *,
    together: bool = False,
) -> None:
    """Close every candidate once; `sections` are those of the first axis groups, and the arena for later ones."""
    sweep = plain(toi_work.make_sweep_work)(hand.chain.rate.shape[0], full_width.checked.shape[0])
    for i in range(len(candidates.finger_posture)):
        work = scratch(hand)
        held = [kept(value) for value in (hand, full_width, obj)]
        rest = [kept(value) for value in (candidates, work, sweep, answer)]
        close_candidate(Closing(*held, T, *sections, *rest), i, 1, together)


def find_overlaps(hand: Any, tree: Any, rounds: Any, closed: bool, T: Any, sections: Any, overlaps: Any) -> None:
    """Find outlines that overlap at the start."""
    look_for_overlaps(hand, ObjectArrays(tree, rounds, closed, no_body()), T, sections, overlaps, scratch(hand))
