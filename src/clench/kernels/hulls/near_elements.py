"""The elements of a resting body that the hulls of a moving one come near to on a short way (section 5)."""

from __future__ import annotations

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import compose_inverse, copy_pose
from clench.kernels.toi.toi_work import BodyPair, SweepWork

from .enclosing_hulls import HullArrays
from .gjk import lowest_of, separating_direction
from .hull_motion import HullMotion, height, motion_of_hull, put_pose
from .hull_sweep import FINE
from .hull_window import (
    CORNERS,
    END,
    LAST,
    LISTED,
    NOW,
    PLANES,
    SIMPLEX,
    begin_window,
    forget_planes,
    keeps_off_box,
    keeps_off_hull,
    least_height,
    push_children,
    put_element,
    put_hull_box,
    remember_plane,
    square_from_box,
)


@kernel
def list_near(pair: BodyPair, end: float, sweep: SweepWork) -> int:
    """List in `sweep.listed` the elements of the resting body that the moving one may touch before `end`.

    The planes that `clear_travel` found last come first here.

    Returns:
        how many there are, or -1 where there are too many, or where the moving body has no hulls: then any can be met.
    """
    moving, m, chain, count = pair.moving, pair.m, pair.chain, pair.rows
    found, window = 0, sweep.hull
    if moving.hulls.body[m] == moving.hulls.body[m + 1]:
        return -1
    for hull in range(moving.hulls.body[m], moving.hulls.body[m + 1]):
        motion = motion_of_hull(moving, hull, chain, count, sweep)
        put_pose(chain, count, 0.0, sweep, window[NOW:END])
        begin_window(moving, motion, chain, count, end, end, sweep)
        found = list_near_hull(moving.hulls, motion, pair.resting, pair.r, pair.touch, end, found, sweep)
        if found < 0:
            return -1
    return found


@kernel
def list_touching(moving: BodyArrays, m: int, resting: BodyArrays, r: int, near: float, sweep: SweepWork) -> int:
    """List the elements of body `r` that body `m` may be nearer to than `near` at rest; see `list_near`.

    Args:
        sweep: has the poses `moving` and `resting` in one frame.
    """
    found, hulls, window = 0, moving.hulls, sweep.hull
    if moving.root[m] < 0 or resting.root[r] < 0:
        return 0
    if hulls.body[m] == hulls.body[m + 1]:
        return -1
    compose_inverse(sweep.resting, sweep.moving, window[NOW:END])
    copy_pose(window[NOW:END], window[END:SIMPLEX])
    for c in range(3):
        window[LAST, c] = window[NOW + c, 3] - resting.box[r, c]
    for hull in range(hulls.body[m], hulls.body[m + 1]):
        motion = HullMotion(hull, hulls.radius[hull], 0.0, 0.0, 0.0, 0.0, 0.0)
        forget_planes(window)
        if not is_off_hulls(hulls, motion, resting, r, near, window):
            put_hull_box(hulls.box[hull], window)
            found = list_near_hull(hulls, motion, resting, r, near, 0.0, found, sweep)
            if found < 0:
                return -1
    return found


@kernel
def is_off_hulls(
    hulls: HullArrays, motion: HullMotion, resting: BodyArrays, r: int, near: float, window: Floats
) -> bool:
    """Say whether planes keep a hull off all hulls of a body; not if that has none."""
    parts, none = resting.hulls, window[CORNERS:PLANES]
    for part in range(parts.body[r], parts.body[r + 1]):
        if not is_kept_off(hulls, motion, parts, part, none, (parts.radius[part], near), 0.0, window):
            return False
    return bool(parts.body[r] < parts.body[r + 1])


@kernel
def list_near_hull(
    hulls: HullArrays,
    motion: HullMotion,
    resting: BodyArrays,
    r: int,
    touch: float,
    end: float,
    found: int,
    sweep: SweepWork,
) -> int:
    """List what one hull comes near to in a window that has begun; see `list_near`."""
    window, stack = sweep.hull, sweep.stack
    stack[0, 0], waiting = resting.root[r], 1
    while waiting > 0:
        waiting -= 1
        n = stack[waiting, 0]
        reach = resting.node[n, 3] + motion.radius + touch + motion.speed * end
        if square_from_box(resting.node[n], window) > reach * reach:
            continue
        if keeps_off_box(hulls, motion, resting.slab[n], touch, end, window):
            continue
        if resting.count[n] == 0:
            waiting = push_children(resting, n, window, stack, waiting)
            continue
        for e in range(resting.first[n], resting.first[n] + resting.count[n]):
            count = put_element(resting, e, window)
            corners = window[CORNERS : CORNERS + count]
            if not is_kept_off(hulls, motion, hulls, -1, corners, (resting.radius[e], touch), end, window):
                found = add_once(e, found, sweep)
                if found < 0:
                    return -1
    return found


@kernel
def is_kept_off(
    hulls: HullArrays,
    motion: HullMotion,
    others: HullArrays,
    other: int,
    corners: Floats,
    grown: tuple[float, float],
    length: float,
    window: Floats,
) -> bool:
    """Say whether a plane keeps a hull off another one, see `lowest_of`, in a whole window.

    Args:
        grown: radius of the other one, and by how much more it has to be kept off [m].
    """
    now, w = window[NOW:END], grown[0] + grown[1]
    if keeps_off_hull(hulls, motion, others, other, corners, w, length, window):
        return True
    simplex, direction, good = window[SIMPLEX:CORNERS], window[LAST], (FINE, motion.radius + grown[0])
    if not separating_direction(hulls, motion.hull, now, others, other, corners, good, simplex, direction):
        return False
    n = (direction[0], direction[1], direction[2])
    start = height(hulls, motion, now, n)
    low = least_height(hulls, motion, n, start, length, window)
    top, _ = lowest_of(others, other, corners, -n[0], -n[1], -n[2])
    if low <= w - top:
        return False
    remember_plane(n, start, low, length, window)
    return True


@kernel
def add_once(e: int, found: int, sweep: SweepWork) -> int:
    """Add an element to the list, unless it is there; return the length of the list, -1 if it is full."""
    for k in range(found):
        if sweep.listed[k] == e:
            return found
    if found == sweep.listed.shape[0]:
        return -1
    sweep.listed[found] = e
    for c in range(3):
        sweep.hull[LISTED + found, c] = sweep.hull[LAST, c]
    return found + 1
