"""How far a moving body is certainly clear of a resting one, by the hulls of its parts (docs/method.md section 5).

A window of travel is tried, see `hull_window`. Parts of the resting body that no plane keeps off the hull are split.
Where that does not help, the window becomes shorter. A window ends where convex parts touch, see `hull_meeting`. Else
the result is a lower bound only: what happens from there on, the sweep of all elements tells.
"""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.vectors import Vector
from clench.kernels.grid.grid_bound import closest_element
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import copy_pose, put_point
from clench.kernels.toi.toi_work import BodyPair, SweepWork
from clench.kernels.trees.obb import slab_top

from .enclosing_hulls import HullArrays
from .gjk import separating_direction
from .hull_meeting import keep_meeting, meet
from .hull_motion import HullMotion, height, motion_of_hull, put_pose
from .hull_window import (
    BOX,
    CORNERS,
    END,
    LAST,
    NOW,
    PLANES,
    SIMPLEX,
    begin_window,
    forget_planes,
    forget_shorter,
    keeps_off_box,
    keeps_off_hull,
    least_height,
    push_children,
    put_element,
    remember_plane,
    square_from_box,
    top_along,
    way_to_box,
)
from .turned_planes import left_over, normal_of, put_turned, remember_turned

#: Windows at most.
WINDOWS = 40
#: A window is tried that is longer than the one before by this factor [-].
LONGER = 2.0
#: A hull whose gap is below this fraction of the way of its points per unit of travel is near: the bound ends [-].
NEAR = 2e-5
#: Below this fraction, convex parts follow the gap itself, see `hull_meeting` [-].
REACH = 1e-2
#: The end of a shorter window is tried so often.
TRIALS = 6
#: A shorter window is meant to leave this share of the gap [-].
LEFT = 0.04
#: A plane that turns is worth a try where it leaves more of the gap than one that rests, by this factor [-].
MUCH = 2.0
#: A later end of a window is tried so often, each time so much of the way from the known end [-].
TURNS, BACK = 3, 0.5
#: A node whose gap is above this share of its ball's radius shortens the window; others are split [-].
FAR = 1.0
#: No plane is looked for between a hull and a node that is nearer than this share of the radius of the node's ball [-].
SOME = 1.0
#: How near to the best direction the directions between a hull and an element are [-].
FINE = 0.01
#: Where a window ends with a touch, a hull stays off other parts by this share of `touch` [-].
BESIDE = 0.125


@kernel
def clear_travel(pair: BodyPair, best: float, sweep: SweepWork) -> float:
    """Return a travel up to which body `m` stays off body `r`; infinite if it does until `best`.

    The gap stays above `touch`, or above an eighth of it where convex parts may touch. If they touch at the travel,
    `sweep.near` names them.

    Args:
        pair, sweep: see `sweep_body`.
    """
    hulls, m, until, near = pair.moving.hulls.body, pair.m, best, False
    sweep.near[1] = -1
    if pair.moving.root[m] < 0 or pair.resting.root[pair.r] < 0:
        return math.inf
    if hulls[m] == hulls[m + 1]:
        return 0.0
    lead = hull_of(pair.moving.hulls, m, sweep.near[5])
    for k in range(hulls[m] - 1, hulls[m + 1]):
        # The hull that may touch first goes first.
        hull = lead if k < hulls[m] else k
        if hull < 0 or k == lead:
            continue
        found = clear_hull(pair, hull, until, sweep)
        if found < math.inf:
            until, near = found, True
        if near and until <= 0.0:
            return 0.0
    return until if near else math.inf


@kernel
def hull_of(hulls: HullArrays, m: int, ball: int) -> int:
    """Return the hull of a body that a ball covers, or -1."""
    for hull in range(hulls.body[m], hulls.body[m + 1]):
        if hulls.cover[hull] <= ball < hulls.cover[hull + 1]:
            return hull
    return -1


@kernel
def clear_hull(pair: BodyPair, hull: int, best: float, sweep: SweepWork) -> float:
    """Return for one hull of the moving body what `clear_travel` returns."""
    motion, window = motion_of_hull(pair.moving, hull, pair.chain, pair.rows, sweep), sweep.hull
    forget_planes(window)
    put_pose(pair.chain, pair.rows, 0.0, sweep, window[NOW:END])
    for c in range(3):
        window[LAST, c] = window[NOW + c, 3] - pair.resting.box[pair.r, c]
    sweep.near[0], sweep.met[1] = -1, 0.0
    s, end = 0.0, best
    for _ in range(WINDOWS):
        sweep.met[0] = math.inf
        end = clear_window(pair, motion, s, end, sweep)
        if end < s:
            break
        if end == sweep.met[0]:
            keep_meeting(hull, sweep)
            return end
        if end >= best:
            return math.inf
        if sweep.met[0] < math.inf:
            sweep.met[1] = 1.0
        s, end = end, min(best, end + LONGER * (end - s))
        copy_pose(window[END:SIMPLEX], window[NOW:END])
    sweep.near[1] = -1
    return s


@kernel
def clear_window(pair: BodyPair, motion: HullMotion, s: float, end: float, sweep: SweepWork) -> float:
    """Return the end of a window from `s` in which a hull stays clear of a body, at most `end`; below `s` if near.

    `END` has the pose there.
    """
    begin_window(pair.moving, motion, pair.chain, pair.rows, end, end - s, sweep)
    parts, r = pair.resting.hulls, pair.r
    for part in range(parts.body[r], parts.body[r + 1]):
        w = parts.radius[part] + pair.touch
        if end >= s and not is_far(parts.box[part], motion, w, end - s, sweep.hull):
            end = keep_off(pair, motion, parts, part, 0, parts.radius[part], s, end, sweep)
    if parts.body[r] < parts.body[r + 1]:
        return end
    return clear_of_tree(pair, motion, s, end, sweep)


@kernel
def is_far(box: Floats, motion: HullMotion, w: float, length: float, window: Floats) -> bool:
    """Say whether the ball around a box, grown by `w`, is too far from the hull to be met in a window."""
    half = math.sqrt(box[0, 4] * box[0, 4] + box[1, 4] * box[1, 4] + box[2, 4] * box[2, 4])
    reach = half + w + motion.radius + motion.speed * length
    return bool(square_from_box(box[:, 3], window) > reach * reach)


@kernel
def clear_of_tree(pair: BodyPair, motion: HullMotion, s: float, end: float, sweep: SweepWork) -> float:
    """Return what `clear_window` returns for a body without hulls.

    The element that ended the window before is looked at first.
    """
    window, stack, known = sweep.hull, sweep.stack, sweep.near[0]
    hulls, resting = pair.moving.hulls, pair.resting
    first = known
    if known < 0 and s == 0.0 and resting.grid.square.shape[0] > 0:
        first = closest_element(resting, probe_of(pair, motion.hull, sweep), stack)[1]
    if first >= 0:
        end = keep_off_element(pair, motion, first, s, end, sweep)
    stack[0, 0], waiting = resting.root[pair.r], 1
    while waiting > 0 and end >= s:
        waiting -= 1
        n, touch = stack[waiting, 0], margin_at(pair, end, sweep)
        ball, away = resting.node[n, 3], square_from_box(resting.node[n], window)
        reach = ball + motion.radius + touch + motion.speed * (end - s)
        if away > reach * reach or keeps_off_box(hulls, motion, resting.slab[n], touch, end - s, window):
            continue
        if known < 0 and end != sweep.met[0] and away > (SOME * ball) ** 2:
            split, end = keep_off_node(pair, motion, n, s, end, sweep)
            if not split:
                continue
        if resting.count[n] == 0:
            waiting = push_children(resting, n, window, stack, waiting)
            continue
        for e in range(resting.first[n], resting.first[n] + resting.count[n]):
            if end >= s:
                end = keep_off_element(pair, motion, e, s, end, sweep)
    return end


@kernel
def probe_of(pair: BodyPair, hull: int, sweep: SweepWork) -> Vector:
    """Return where what rests is looked at first: the middle of the ball that may touch first, or of the hull's box."""
    hulls, window, ball = pair.moving.hulls, sweep.hull, sweep.near[5]
    if not hulls.cover[hull] <= ball < hulls.cover[hull + 1]:
        return window[BOX, 3], window[BOX + 1, 3], window[BOX + 2, 3]
    put_point(window[NOW:END], hulls.ball[ball], sweep.placed[0])
    return sweep.placed[0, 0], sweep.placed[0, 1], sweep.placed[0, 2]


@kernel
def keep_off_node(
    pair: BodyPair, motion: HullMotion, n: int, s: float, end: float, sweep: SweepWork
) -> tuple[bool, float]:
    """Look for a plane that keeps a hull off a node; return whether the node is to be split, and the window's end.

    The plane lies across the shortest way from the middle of the node to the box around the hull.
    """
    hulls, resting, window, slab = pair.moving.hulls, pair.resting, sweep.hull, pair.resting.slab[n]
    v = way_to_box(resting.node[n], window)
    start, top = height(hulls, motion, window[NOW:END], v), slab_top(slab, v[0], v[1], v[2]) + pair.touch
    if start <= top:
        return True, end
    low = least_height(hulls, motion, v, start, end - s, window)
    if low <= top and start - top < FAR * resting.node[n, 3]:
        return True, end
    remember_plane(v, start, low, end - s, window)
    if low <= top:
        end = shorten(pair, motion, v, start, top, s, end, sweep)
        put_turned(motion, window[NOW:END], window[END:SIMPLEX], end - s, window)
    return False, end


@kernel
def keep_off_element(pair: BodyPair, motion: HullMotion, e: int, s: float, end: float, sweep: SweepWork) -> float:
    """Return what `keep_off` returns for an element; one that ends the window is kept in `sweep.near`."""
    radius, corners = pair.resting.radius[e], put_element(pair.resting, e, sweep.hull)
    found = keep_off(pair, motion, pair.moving.hulls, -1, corners, radius, s, end, sweep)
    if found < end:
        sweep.near[0] = e
    return float(found)


@kernel
def keep_off(
    pair: BodyPair,
    motion: HullMotion,
    others: HullArrays,
    other: int,
    corners: int,
    radius: float,
    s: float,
    end: float,
    sweep: SweepWork,
) -> float:
    """Return the end of a window in which a hull stays off another one, at most `end`; below `s` if it is near.

    Args:
        motion: of the hull. others, other: the other one, or -1 for the first `corners` of the window's corners.
        radius: by which the other one is grown [m]. The rest as in `clear_window`.
    """
    hulls, window, points = pair.moving.hulls, sweep.hull, sweep.hull[CORNERS : CORNERS + corners]
    w = radius + margin_at(pair, end, sweep)
    if keeps_off_hull(hulls, motion, others, other, points, w, end - s, window):
        return end
    now, simplex, direction = window[NOW:END], window[SIMPLEX:CORNERS], window[LAST]
    good = (FINE, motion.radius + radius)
    if not separating_direction(hulls, motion.hull, now, others, other, points, good, simplex, direction):
        return -1.0
    n = (direction[0], direction[1], direction[2])
    start, top = height(hulls, motion, now, n), top_along(others, other, points, w, n)
    if start - top <= REACH * motion.speed and is_exact(hulls, motion.hull, others, other):
        return touch_at(pair, motion, others, other, corners, radius, (s, end), sweep)
    if start - top <= NEAR * motion.speed:
        # What lists the elements near by begins with this plane.
        remember_plane(n, start, -math.inf, -1.0, window)
        return -1.0
    low = least_height(hulls, motion, n, start, end - s, window)
    remember_plane(n, start, low, end - s, window)
    if low <= top:
        last, end = end, shorten(pair, motion, n, start, top, s, end, sweep)
        left = window[PLANES, 4] - top
        remember_turned(motion, n, start, now, window)
        put_turned(motion, now, window[END:SIMPLEX], end - s, window)
        later = left_over(0, top, top_along(others, other, points, w, normal_of(0, True, window)), window)
        if end < last and later > MUCH * left:
            end = lengthen(pair, motion, others, other, points, w, (start - top, later), (s, end, last), sweep)
    return end


@kernel
def margin_at(pair: BodyPair, end: float, sweep: SweepWork) -> float:
    """Return by how much a hull stays off what rests in a window: less where the window ends with a touch [m]."""
    return BESIDE * pair.touch if end == sweep.met[0] else pair.touch


@kernel
def is_exact(hulls: HullArrays, hull: int, others: HullArrays, other: int) -> bool:
    """Say whether two hulls are as their parts are; elements are, whose number is -1."""
    return bool(hulls.convex[hull] != 0 and (other < 0 or others.convex[other] != 0))


@kernel
def touch_at(
    pair: BodyPair,
    motion: HullMotion,
    others: HullArrays,
    other: int,
    corners: int,
    radius: float,
    span: tuple[float, float],
    sweep: SweepWork,
) -> float:
    """Return what `keep_off` does for a hull that is near another one; the window ends where they touch."""
    hulls, window, points, (s, last) = pair.moving.hulls, sweep.hull, sweep.hull[CORNERS : CORNERS + corners], span
    end = meet(pair, motion, others, other, points, radius, span, sweep)
    if s <= end < last:
        move_end(pair, motion, s, end, sweep)
        sweep.near[4] = other
        n = (window[LAST, 0], window[LAST, 1], window[LAST, 2])
        start = height(hulls, motion, window[NOW:END], n)
        remember_plane(n, start, least_height(hulls, motion, n, start, end - s, window), end - s, window)
    return float(end)


@kernel
def lengthen(
    pair: BodyPair,
    motion: HullMotion,
    others: HullArrays,
    other: int,
    points: Floats,
    w: float,
    gaps: tuple[float, float],
    ends: tuple[float, float, float],
    sweep: SweepWork,
) -> float:
    """Return a later end of a window, up to which the plane that turns and was found last keeps the hull off.

    Args:
        others, other, points, w: what rests, see `keep_off`. gaps: the plane's where the window begins, and where it
            ends. ends: of the window the start, the end, and the latest end.
    """
    window, (s, known, last), (gap, left) = sweep.hull, ends, gaps
    end = last
    top = top_along(others, other, points, w, normal_of(0, False, window))
    for _ in range(TURNS):
        if left < gap:
            end = min(end, s + (1.0 - LEFT) * (known - s) * gap / (gap - left))
        if end <= known:
            break
        move_end(pair, motion, s, end, sweep)
        if left_over(0, top, top_along(others, other, points, w, normal_of(0, True, window)), window) > 0.0:
            forget_shorter(end - s, window)
            return end
        end = known + BACK * (end - known)
    move_end(pair, motion, s, known, sweep)
    return known


@kernel
def move_end(pair: BodyPair, motion: HullMotion, s: float, end: float, sweep: SweepWork) -> None:
    """End a window from `s` elsewhere: write the hull's pose there, and where the planes that turn are."""
    window = sweep.hull
    put_pose(pair.chain, pair.rows, end, sweep, window[END:SIMPLEX])
    put_turned(motion, window[NOW:END], window[END:SIMPLEX], end - s, window)


@kernel
def shorten(
    pair: BodyPair,
    motion: HullMotion,
    n: Vector,
    start: float,
    top: float,
    s: float,
    end: float,
    sweep: SweepWork,
) -> float:
    """Return an earlier end of a window: until then a hull is above `top` along a direction.

    `END` gets the pose there, and the plane that was remembered last the bound on its height. Planes that turn stay.

    Args:
        n: the direction, from what rests to the hull. start: height of the hull along it at `s`.
        top: height of what rests [m].
    """
    hulls, window, gap, length = pair.moving.hulls, sweep.hull, start - top, end - s
    # No point reaches what rests before `least`; the window was looked at up to its end alone.
    least = min(gap / motion.speed, length)
    left = least_height(hulls, motion, n, start, length, window) - top
    for trial in range(TRIALS + 1):
        length = max(length * (1.0 - LEFT) * gap / (gap - left), least) if trial < TRIALS else least
        put_pose(pair.chain, pair.rows, s + length, sweep, window[END:SIMPLEX])
        left = least_height(hulls, motion, n, start, length, window) - top
        if left > 0.0 or length <= least:
            break
    window[PLANES, 4], window[PLANES, 5] = left + top, s + length - s
    return s + length
