"""Pairs of parts of two bodies, through their trees: scratch space, gaps and overlaps (docs/method.md section 5)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clench.kernels.closing.layout import Floats, Ints
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.core_distance import crosses, separation
from clench.kernels.geometry.crossing import only_touch
from clench.kernels.hulls.enclosing_hulls import BODY_BALLS
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import put_point
from clench.kernels.trees.obb import put_slab_core, slab_misses, slab_slack

from .sides import gap_over, sides_of
from .spatial_motion import SPATIAL

#: Pairs of nodes that wait at most: every level of either tree adds one, and no tree is deeper than 96.
PAIRS = 512
#: Largest number of pairs that wait in the order in which they can meet; further pairs wait in order of depth.
QUEUE = 256


class SweepWork(NamedTuple):
    """The scratch space of a sweep.

    Args:
        core, fixed: corners of a pair, (4, 3) and (3, 3). placed: those of the moving one on its way, and scratch
            space, see `sweep_pair` and `off_box`, (8, 3).
        axis, anchor: of the joints where a segment begins, in the palm frame, (J, 3) each. spatial: see
            `spatial_motion`, (J, 7).
        moving, resting: poses of two bodies relative to their pivots, (3, 4).
        poses: `T_palm_link` of every link, (L, 3, 4).
        lane: extent of every link, and of the object last, along the axis that a segment turns about, (L + 1, 2).
        after: the first joint that moves and does not move a link, (L,).
        stack: pairs of items that wait, and whether `walk_item` has been there, (PAIRS, 3). keys: when they can meet at
            the earliest, for one joint as a `turn_measure`; since: a travel before which they do not, (PAIRS,) each.
        box: that around a node of either body, see `put_box`, (5, 3).
        plane: normal and offset of a separating plane, relative to the first pivot, then in the resting body's frame,
            (8,).
        begun, turned, level: pose of a body that continues from its place, (3, 4), and its chain there, for any axes
            (J, 7) and for parallel ones (J + 1, 3).
        hull: scratch space of `hull_window`, (70, 6). round: that of `round_motion`, (12, 3).
        near: numbers or -1, (6,). 0: the element that the hull came near to last. 1: the hull that touches. 2 and 3:
            the resting hull that it touches; without one, the element. 4: number 2 in the last window. 5: the ball
            that may touch first.
        met: the travel after which a hull touches in a window; whether the ends of earlier windows lay before such a
            touch: then parts may be as near as that, (2,).
        listed: resting elements that a short sweep can meet, (32,).
        balls: those of a moving body, see `grid_travel`, (BODY_BALLS, 6).
        clear: a travel before which each link does not meet the object, (L,). order: links by this travel, (L,); lead:
            the ball of each that may touch first, or -1, (L,).
        pair, winner: the pair found last, and that of the stage: element of the moving body, that of the resting one,
            moving body, resting body, (4,). skipped: how many pairs of links were left alone, (1,).
    """

    core: Floats
    fixed: Floats
    placed: Floats
    axis: Floats
    anchor: Floats
    spatial: Floats
    moving: Floats
    resting: Floats
    poses: Floats
    lane: Floats
    after: Ints
    stack: Ints
    keys: Floats
    since: Floats
    box: Floats
    plane: Floats
    begun: Floats
    turned: Floats
    level: Floats
    hull: Floats
    round: Floats
    near: Ints
    met: Floats
    listed: Ints
    balls: Floats
    clear: Floats
    order: Ints
    lead: Ints
    pair: Ints
    winner: Ints
    skipped: Ints


class BodyPair(NamedTuple):
    """A moving body and a resting one that it may meet; kernels hold both by pointers.

    Args:
        moving, m: the bodies that the moving one is among, and its number. resting, r: those of the resting one.
        chain, rows: what moves, and how many rows of it count, see `MovingCore`. touch: gaps up to this touch [m].
    """

    moving: BodyArrays
    m: int
    resting: BodyArrays
    r: int
    chain: Floats
    rows: int
    touch: float


@kernel(allocates=True)
def make_sweep_work(joints: int, links: int) -> SweepWork:
    """Allocate the scratch space for sweeps of a hand."""
    return SweepWork(
        np.empty((4, 3)),
        np.empty((3, 3)),
        np.empty((8, 3)),
        np.empty((joints, 3)),
        np.empty((joints, 3)),
        np.empty((joints, SPATIAL)),
        np.empty((3, 4)),
        np.empty((3, 4)),
        np.empty((links, 3, 4)),
        np.empty((links + 1, 2)),
        np.empty(links, dtype=np.int64),
        np.empty((PAIRS, 3), dtype=np.int64),
        np.empty(PAIRS),
        np.empty(PAIRS),
        np.empty((5, 3)),
        np.empty(8),
        np.empty((3, 4)),
        np.empty((joints, SPATIAL)),
        np.empty((joints + 1, 3)),
        np.empty((70, 6)),
        np.empty((12, 3)),
        np.full(6, -1, dtype=np.int64),
        np.zeros(2),
        np.zeros(32, dtype=np.int64),
        np.empty((BODY_BALLS, 6)),
        np.empty(links),
        np.empty(links, dtype=np.int64),
        np.empty(links, dtype=np.int64),
        np.zeros(4, dtype=np.int64),
        np.zeros(4, dtype=np.int64),
        np.zeros(1, dtype=np.int64),
    )


@kernel
def put_core(bodies: BodyArrays, element: int, T: Floats, out: Floats) -> None:
    """Write the corners of an element in the frame that a pose leads to."""
    for k in range(bodies.corners[element]):
        put_point(T, bodies.vertices[bodies.elements[element, k]], out[k])


@kernel
def put_ball(bodies: BodyArrays, n: int, T: Floats, out: Floats) -> float:
    """Write the centre of the ball around node `n`, or around element `-1 - n`, as `put_point`; return its radius."""
    ball = bodies.node[n] if n >= 0 else bodies.ball[-1 - n]
    put_point(T, ball, out)
    return float(ball[3])


@kernel
def put_item(bodies: BodyArrays, n: int, T: Floats, out: Floats) -> tuple[int, float]:
    """Write the core of element `-1 - n`, or of the capsule around node `n`; return its corners and its radius."""
    if n >= 0:
        return put_slab_core(bodies.slab[n], T, out)
    put_core(bodies, -1 - n, T, out)
    return bodies.corners[-1 - n], bodies.radius[-1 - n]


@kernel
def item_of(bodies: BodyArrays, n: int) -> int:
    """Return a node as an item; where it has one element that one."""
    return -1 - bodies.first[n] if n >= 0 and bodies.count[n] == 1 else n


@kernel
def push_parts(bodies: BodyArrays, n: int, column: int, other: int, stack: Ints, waiting: int) -> int:
    """Put the children of a node, or the elements of a leaf, on the stack against `other`; return its new height."""
    if bodies.count[n] == 0:
        stack[waiting, column], stack[waiting, 1 - column] = item_of(bodies, bodies.right[n]), other
        stack[waiting + 1, column], stack[waiting + 1, 1 - column] = item_of(bodies, n + 1), other
        return waiting + 2
    for k in range(bodies.count[n]):
        stack[waiting + k, column], stack[waiting + k, 1 - column] = -1 - (bodies.first[n] + k), other
    return waiting + int(bodies.count[n])


@kernel
def elements_of(bodies: BodyArrays, m: int) -> tuple[int, int]:
    """Return the first element of a body that has some, and the one after its last."""
    first = last = bodies.root[m]
    while bodies.count[first] == 0:
        first += 1
    while bodies.count[last] == 0:
        last = bodies.right[last]
    return int(bodies.first[first]), int(bodies.first[last] + bodies.count[last])


@kernel
def push_roots(moving: BodyArrays, m: int, resting: BodyArrays, r: int, stack: Ints) -> int:
    """Put two bodies on the empty stack, unless one has no elements; return its height."""
    if moving.root[m] < 0 or resting.root[r] < 0:
        return 0
    stack[0, 0], stack[0, 1] = item_of(moving, moving.root[m]), item_of(resting, resting.root[r])
    return 1


@kernel
def push_first(
    moving: BodyArrays, m: int, resting: BodyArrays, r: int, listed: int, elements: Ints, stack: Ints
) -> int:
    """Put the first pairs on the empty stack: two bodies, or one and the listed elements; return its height.

    Args:
        listed: so many of `elements` are the only ones of the resting body that can be met; -1: any can.
    """
    if listed < 0:
        return push_roots(moving, m, resting, r, stack)
    for k in range(listed):
        stack[k, 0], stack[k, 1] = item_of(moving, moving.root[m]), -1 - elements[k]
    return listed


@kernel
def is_wider(moving: BodyArrays, a: int, resting: BodyArrays, b: int) -> bool:
    """Say whether the moving one of two items, that are not both elements, has the larger ball, or is the only node."""
    return bool(b < 0 or (a >= 0 and moving.node[a, 3] >= resting.node[b, 3]))


@kernel
def is_looser(moving: BodyArrays, a: int, resting: BodyArrays, b: int) -> bool:
    """Say whether the moving one of two items has the looser box, or is the only node.

    It need not be the wider one, which may be a strip of a wall.
    """
    return bool(b < 0 or (a >= 0 and slab_slack(moving.slab[a]) >= slab_slack(resting.slab[b])))


@kernel
def split_pair(moving: BodyArrays, a: int, resting: BodyArrays, b: int, first: bool, stack: Ints, waiting: int) -> int:
    """Put the parts of one of two items, of `a` where `first`, on the stack against the other; see `push_parts`."""
    if first:
        return push_parts(moving, a, 0, b, stack, waiting)
    return push_parts(resting, b, 1, a, stack, waiting)


@kernel
def body_gap(
    moving: BodyArrays, m: int, resting: BodyArrays, r: int, listed: int, bound: float, slack: float, work: SweepWork
) -> float:
    """Return the gap between two bodies if it is below `bound`, else `bound`; writes the closest pair.

    Args:
        listed: see `push_first`.
        slack: the result may be larger than the gap by up to this factor, which saves most of the work if many pairs
            are about as close [-]. work: has `moving` and `resting`, the bodies' poses in one frame.
    """
    stack, best = work.stack, bound
    waiting = push_first(moving, m, resting, r, listed, work.listed, stack)
    while waiting > 0:
        waiting -= 1
        a, b = stack[waiting, 0], stack[waiting, 1]
        if slack * ball_gap(moving, a, resting, b, work) >= best:
            continue
        if a < 0 or b < 0:
            # The ball around a long element tells little.
            gap = element_gap(moving, a, resting, b, work)
            if gap >= best or (slack * gap >= best and (a >= 0 or b >= 0)):
                continue
            if a < 0 and b < 0:
                best = gap
                work.pair[0], work.pair[1], work.pair[2], work.pair[3] = -1 - a, -1 - b, m, r
                continue
        height = split_pair(moving, a, resting, b, is_wider(moving, a, resting, b), stack, waiting)
        put_nearest_last(moving, resting, stack, waiting, height, work)
        waiting = height
    return best


@kernel
def put_nearest_last(
    moving: BodyArrays, resting: BodyArrays, stack: Ints, low: int, high: int, work: SweepWork
) -> None:
    """Swap the nearest of the pairs from `low` on to the top of the stack, so that it is looked at next."""
    nearest, least = low, math.inf
    for k in range(low, high):
        gap = ball_gap(moving, stack[k, 0], resting, stack[k, 1], work)
        if gap < least:
            nearest, least = k, gap
    for column in range(2):
        top = stack[high - 1, column]
        stack[high - 1, column] = stack[nearest, column]
        stack[nearest, column] = top


@kernel
def ball_gap(moving: BodyArrays, a: int, resting: BodyArrays, b: int, work: SweepWork) -> float:
    """Return the gap between the balls of two nodes or elements."""
    reach = put_ball(moving, a, work.moving, work.core[0]) + put_ball(resting, b, work.resting, work.fixed[0])
    return point_distance(work.core, work.fixed) - reach


@kernel
def element_gap(moving: BodyArrays, a: int, resting: BodyArrays, b: int, work: SweepWork) -> float:
    """Return the gap between two items, elements or nodes' balls; their cores are left in `work`."""
    ka, wa = put_item(moving, a, work.moving, work.core)
    kb, wb = put_item(resting, b, work.resting, work.fixed)
    return separation(work.core, ka, work.fixed, kb)[0] - wa - wb


@kernel
def bodies_overlap(
    moving: BodyArrays, m: int, resting: BodyArrays, r: int, allowed: float, flush: bool, listed: int, work: SweepWork
) -> bool:
    """Say whether two bodies cross each other's surface; see `body_gap`. Round ones may overlap by `allowed`.

    The elements that cross are left in `work.pair`.

    Args:
        flush: sharp faces that only touch do not count. Faces alone do not tell bodies whose edges coincide from such
            that lie in each other: only where depth is measured as well. listed: see `push_first`.
    """
    stack, sides = work.stack, sides_of((0.0, 0.0, 0.0), work.moving, work.resting)
    waiting = push_first(moving, m, resting, r, listed, work.listed, stack)
    while waiting > 0:
        waiting -= 1
        a, b = stack[waiting, 0], stack[waiting, 1]
        # A plane that separated two elements separates most of their neighbours.
        if ball_gap(moving, a, resting, b, work) > 0.0 or gap_over(moving, a, resting, b, sides) > 0.0:
            continue
        if a < 0 or b < 0:
            ka, wa = put_item(moving, a, work.moving, work.core)
            kb, wb = put_item(resting, b, work.resting, work.fixed)
            if a < 0 and b < 0:
                d, nx, ny, nz, _, _, _, _, _ = separation(work.core, ka, work.fixed, kb)
                work.pair[0], work.pair[1] = -1 - a, -1 - b
                if d - wa - wb < -allowed:
                    return True
                if crosses(work.core, ka, work.fixed, kb):
                    if not (flush and wa + wb == 0.0 and only_touch(work.core, ka, work.fixed, kb)):
                        return True
                else:
                    sides = sides_of((nx, ny, nz), work.moving, work.resting)
                continue
            if a >= 0 and slab_misses(moving.slab[a], work.moving, work.fixed, kb, wb):
                continue
            if b >= 0 and slab_misses(resting.slab[b], work.resting, work.core, ka, wa):
                continue
        waiting = split_pair(moving, a, resting, b, is_wider(moving, a, resting, b), stack, waiting)
    return False


@kernel
def point_distance(a: Floats, b: Floats) -> float:
    """Return the distance between the first rows."""
    return math.sqrt((a[0, 0] - b[0, 0]) ** 2 + (a[0, 1] - b[0, 1]) ** 2 + (a[0, 2] - b[0, 2]) ** 2)
