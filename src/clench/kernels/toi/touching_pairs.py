"""Which elements touch at given postures, and along which direction (docs/method.md section 5, *Sensitivity*)."""

from __future__ import annotations

import math
from typing import NamedTuple

from clench.kernels.closing.layout import Floats, Ints
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.core_distance import Separation, above_face, edge_count, edge_pair, face_normal, separation
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.sections.plane_pose import copy_pose

from .toi_work import SweepWork, ball_gap, is_wider, make_sweep_work, put_item, split_pair

#: Columns of the integers: posture, moving link, touched body (a link, or the number of links for the object).
PAIR_STAGE, PAIR_LINK, PAIR_MET = 0, 1, 2
PAIR_INTEGERS = 3
#: Columns of the numbers: place of the contact, direction from the touched body to the link, and the gap.
PAIR_X, PAIR_NX, PAIR_GAP = 0, 3, 6
PAIR_FLOATS = 7
#: Directions that differ by less are the same [-].
SAME_DIRECTION = 1e-9


class TouchRows(NamedTuple):
    """Where the touches of two bodies are listed: `numbers` and `tie` of `touching_pairs`, and their first row."""

    numbers: Floats
    first: int
    tie: float


@entry_kernel(allocates=True)
def touching_pairs(
    links: BodyArrays,
    obj: BodyArrays,
    checked: Ints,
    poses: Floats,
    moves: Ints,
    T_palm_object: Floats,
    within: float,
    tie: float,
    found: Ints,
    numbers: Floats,
) -> int:
    """List the pairs of elements, of moving links and of forbidden bodies, that are as close as given.

    Args:
        links: one body per link of the hand. obj: one body. checked: whether two links may not overlap, (L, L).
        poses: `T_palm_link` of every link at every posture, (S, L, 3, 4). moves: whether a link moves there, (S, L).
        T_palm_object: shape (3, 4). within: largest gap of interest [m].
        tie: features of a pair whose distances differ by no more touch at once [m].
        found: written, (N, 3). numbers: written, in the palm frame [m], (N, 7); the last two rows are scratch.

    Returns:
        how many there are, at most N - 2.
    """
    count, work = 0, make_sweep_work(0, checked.shape[0])
    for s in range(poses.shape[0]):
        for m in range(checked.shape[0]):
            if moves[s, m] == 0:
                continue
            copy_pose(poses[s, m], work.moving)
            for r in range(checked.shape[0] + 1):
                before = count
                if r == checked.shape[0]:
                    copy_pose(T_palm_object, work.resting)
                    count = _add_pairs(links, m, obj, 0, within, tie, numbers, count, work)
                elif checked[m, r] != 0 and (moves[s, r] == 0 or r < m):
                    copy_pose(poses[s, r], work.resting)
                    count = _add_pairs(links, m, links, r, within, tie, numbers, count, work)
                found[before:count, PAIR_STAGE], found[before:count, PAIR_LINK] = s, m
                found[before:count, PAIR_MET] = r
    return count


@kernel
def _add_pairs(
    moving: BodyArrays,
    m: int,
    resting: BodyArrays,
    r: int,
    within: float,
    tie: float,
    numbers: Floats,
    count: int,
    work: SweepWork,
) -> int:
    """Append the pairs of two bodies whose gap is small; `work` has their poses. Return the number of rows in use."""
    stack, rows = work.stack, TouchRows(numbers, count, tie)
    stack[0, 0], stack[0, 1] = moving.root[m], resting.root[r]
    waiting = 1 if stack[0, 0] >= 0 and stack[0, 1] >= 0 else 0
    while waiting > 0:
        waiting -= 1
        a, b = stack[waiting, 0], stack[waiting, 1]
        if ball_gap(moving, a, resting, b, work) > within:
            continue
        if a < 0 or b < 0:
            ka, wa = put_item(moving, a, work.moving, work.core)
            kb, wb = put_item(resting, b, work.resting, work.fixed)
            found = separation(work.core, ka, work.fixed, kb)
            if found[0] - wa - wb > within:
                continue
            if a < 0 and b < 0:
                if found[0] - wa - wb >= -within:
                    count = _add_touches(found, ka, kb, wa, wb, rows, count, work)
                continue
        waiting = split_pair(moving, a, resting, b, is_wider(moving, a, resting, b), stack, waiting)
    return count


@kernel
def _add_touches(
    found: Separation, ka: int, kb: int, wa: float, wb: float, rows: TouchRows, count: int, work: SweepWork
) -> int:
    """Append the touches of one pair of elements, whose cores `work` has; return the number of rows in use.

    Parallel features touch at several places at once: their ends have rows of their own.
    """
    a, b, tie = work.core, work.fixed, rows.tie
    d, nx, ny, nz, _, _, x, y, z = found
    row = rows.numbers[-1]
    row[3], row[4], row[5], row[6] = nx, ny, nz, d - wb - wa
    count = _add_row(x, y, z, wb, rows, count)
    count = _add_corners(a, ka, b, kb, d, d, wb, rows, count)
    count = _add_corners(b, kb, a, ka, d, 0.0, wb, rows, count)
    for p in range(edge_count(ka)):
        for q in range(edge_count(kb)):
            last = (q + 1) % kb
            _, t, _, _, _, apart = edge_pair(a, p, (p + 1) % ka, b, q, last)
            if abs(math.sqrt(apart) - d) <= tie:
                x = b[q, 0] + t * (b[last, 0] - b[q, 0])
                y = b[q, 1] + t * (b[last, 1] - b[q, 1])
                z = b[q, 2] + t * (b[last, 2] - b[q, 2])
                count = _add_row(x, y, z, wb, rows, count)
    return count


@kernel
def _add_corners(
    a: Floats, ka: int, b: Floats, kb: int, d: float, back: float, w: float, rows: TouchRows, count: int
) -> int:
    """Append the corners of `a` that are as far from the face of `b` as the cores are, moved back along n."""
    if kb < 3:
        return count
    mx, my, mz, size = face_normal(b)
    for p in range(ka if size > 0.0 else 0):
        x, y, z = a[p, 0], a[p, 1], a[p, 2]
        h = abs(mx * (x - b[0, 0]) + my * (y - b[0, 1]) + mz * (z - b[0, 2]))
        if abs(h - d) <= rows.tie and above_face(b, mx, my, mz, x, y, z):
            n = rows.numbers[-1]
            count = _add_row(x - back * n[3], y - back * n[4], z - back * n[5], w, rows, count)
    return count


@kernel
def _add_row(x: float, y: float, z: float, w: float, rows: TouchRows, count: int) -> int:
    """Append a touch on the surface that lies `w` outside of a point; return the rows in use.

    The last row has its direction and gap. A touch is left out where there is no room, and where an earlier row of the
    same bodies, from `first` on, is the same.
    """
    numbers, first, tie = rows.numbers, rows.first, rows.tie
    last, row = numbers[-1], numbers[count]
    row[0], row[1], row[2] = x + w * last[3], y + w * last[4], z + w * last[5]
    for k in range(3, row.shape[0]):
        row[k] = last[k]
    for k in range(first, count):
        apart, turned = 0.0, 0.0
        for i in range(3):
            apart = max(apart, abs(numbers[k, i] - row[i]))
            turned = max(turned, abs(numbers[k, i + 3] - row[i + 3]))
        if apart <= tie and turned <= SAME_DIRECTION:
            return count
    return count + 1 if count + 1 < numbers.shape[0] - 1 else count
