"""Where a convex part of a moving body touches a convex part of a resting one (docs/method.md section 5).

Steps follow the gap itself, and a plane that turns from the normal at one end of a step to that at the other keeps the
parts off each other in between. So the elements of the parts need no closer look before they touch.
"""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats, Ints
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.core_distance import separation
from clench.kernels.geometry.vectors import Vector
from clench.kernels.grid.grid_bound import square_to_core, to_ball
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.coupled import safe_step
from clench.kernels.sections.plane_pose import back, copy_pose
from clench.kernels.toi.toi_work import BodyPair, SweepWork, put_core

from .enclosing_hulls import HullArrays
from .gjk import widest_gap
from .hull_motion import HullMotion, lowest_between, put_pose
from .hull_window import CORNERS, END, LAST, MET, NOW, SIMPLEX, TOUCHING

#: Rows of a window's data: the poses of the moving body at both ends of a step.
HERE, THERE, REST = 62, 65, 68
#: Steps at most.
STEPS = 16
#: How near to the best direction the normals are [-].
FINELY = 1e-3
#: Parts touch at a gap below this share of `touch`, or of the gap that they begin with if that is smaller [-].
CLOSE = 0.75
#: On a step the gap stays above this share of the same [-].
KEPT = 0.25
#: No point passes more than this share of the gap on the first step [-].
FIRST = 0.5
#: A later step is meant to leave this share of the gap [-].
LEFT = 2.0 * FINELY
#: Elements that touch are nearer to the nearest points of two hulls than this share of `touch` [-].
EXACT = 0.1
#: A step that fails becomes shorter by this factor; one on which the gap does not close is followed by a longer one.
SHORTER, LONGER = 0.25, 4.0


@kernel
def meet(
    pair: BodyPair,
    motion: HullMotion,
    others: HullArrays,
    other: int,
    corners: Floats,
    radius: float,
    span: tuple[float, float],
    sweep: SweepWork,
) -> float:
    """Return a travel up to which a hull stays off another one; below the start of a span if none is seen.

    If they touch there, `sweep.met` has the travel, and the row `MET` of the window the nearest points.
    The search begins with what `separating_direction` found last.

    Args:
        motion: of the hull. others, other, corners: the other one, see `keep_off`. radius: by which that is grown [m].
        span: the travels between which it is of interest; where it begins `NOW` has the pose.
    """
    window, (s, end) = sweep.hull, span
    here, there, n, at = window[HERE:THERE], window[THERE:REST], window[LAST], s
    copy_pose(window[NOW:END], here)
    gap = hull_gap(pair, motion, here, others, other, corners, radius, sweep)
    if gap <= 0.0:
        return -1.0
    near, began = min(gap, pair.touch), gap <= pair.touch
    if s > 0.0 and gap <= CLOSE * pair.touch:
        if sweep.met[1] != 0.0:
            return -1.0
        put_meeting(s, others, other, corners, sweep)
        return s
    step = end - s if began else FIRST * gap / motion.speed
    for _ in range(STEPS):
        step = min(step, end - at)
        x, y, z = n[0], n[1], n[2]
        put_pose(pair.chain, pair.rows, at + step, sweep, there)
        later = hull_gap(pair, motion, there, others, other, corners, radius, sweep)
        turn = math.sqrt((n[0] - x) ** 2 + (n[1] - y) ** 2 + (n[2] - z) ** 2)
        sag = 0.125 * step * (motion.bend * step + 2.0 * turn * motion.speed)
        if later <= 0.0 or lowest_between(gap, later, sag) <= KEPT * near:
            n[0], n[1], n[2], step = x, y, z, SHORTER * step
            continue
        if step >= end - at:
            # Whether parts touch that begin to touch, and slide, their elements tell.
            return -1.0 if began and later <= pair.touch else end
        at, rate = at + step, (gap - later) / step
        gap = later
        if gap <= CLOSE * near:
            put_meeting(at, others, other, corners, sweep)
            return at
        # The rate may have grown since the middle of the step.
        left, rate = (1.0 - LEFT) * gap - 0.5 * near, rate + 0.5 * motion.bend * step
        step = min(safe_step(max(left, 0.0), -rate, motion.bend), LONGER * step) if motion.bend > 0.0 else LONGER * step
    return at if at > s and gap > pair.touch else -1.0


@kernel
def hull_gap(
    pair: BodyPair,
    motion: HullMotion,
    T: Floats,
    others: HullArrays,
    other: int,
    corners: Floats,
    radius: float,
    sweep: SweepWork,
) -> float:
    """Return how far a hull at a pose is off another one, a little less at most; below 0 if they overlap.

    Args:
        T: the pose. The rest as in `meet`. `LAST` gets the normal, and `SIMPLEX` has where the search begins.
    """
    hulls, window, grown = pair.moving.hulls, sweep.hull, motion.radius + radius
    simplex, good = window[SIMPLEX:CORNERS], (FINELY, grown)
    return widest_gap(hulls, motion.hull, T, others, other, corners, good, simplex, window[LAST]) - grown


@kernel
def put_meeting(at: float, others: HullArrays, other: int, corners: Floats, sweep: SweepWork) -> None:
    """Write that a hull touches another one after a travel, and the nearest points of their cores."""
    window, sweep.met[0] = sweep.hull, at
    out, simplex = window[MET], window[SIMPLEX:CORNERS]
    for c in range(6):
        out[c] = 0.0
    for k in range(int(simplex[4, 5])):
        b = others.points[int(simplex[k, 4])] if other >= 0 else corners[int(simplex[k, 4])]
        for c in range(3):
            out[c] += simplex[k, 5] * b[c]
            out[3 + c] += simplex[k, 5] * (b[c] + simplex[k, c])


@kernel
def keep_meeting(hull: int, sweep: SweepWork) -> None:
    """Keep what touches a hull at the end of the window that was looked at last."""
    sweep.near[1], sweep.near[2], sweep.near[3] = hull, sweep.near[4], sweep.near[0]
    for c in range(6):
        sweep.hull[TOUCHING, c] = sweep.hull[MET, c]


@kernel
def put_touching(pair: BodyPair, s: float, sweep: SweepWork) -> bool:
    """Write elements of two bodies that touch after a travel to `sweep.pair`; say whether there are any.

    Args:
        pair: the bodies, of which `clear_travel` tells that their hulls touch after the travel `s`.
    """
    window, listed = sweep.hull, sweep.listed
    T, p, half = window[NOW:END], window[TOUCHING], listed.shape[0] // 2
    put_pose(pair.chain, pair.rows, s, sweep, T)
    resting, listed[0] = 1, sweep.near[3]
    if sweep.near[2] >= 0:
        resting = list_at(pair.resting, pair.r, (p[0], p[1], p[2]), EXACT * pair.touch, listed[:half], sweep)
    x, y, z = back(T, p[3], p[4], p[5])
    moving = list_at(pair.moving, pair.m, (x, y, z), EXACT * pair.touch, listed[half:], sweep)
    for k in range(resting):
        for i in range(moving):
            a, e = listed[half + i], listed[k]
            if 0.0 < gap_at_rest(pair, a, e, sweep) <= pair.touch:
                sweep.pair[0], sweep.pair[1], sweep.pair[2], sweep.pair[3] = a, e, pair.m, pair.r
                return True
    return False


@kernel
def list_at(body: BodyArrays, b: int, p: Vector, most: float, listed: Ints, sweep: SweepWork) -> int:
    """List the elements of a body whose cores are nearer to a point than `most`, as many as fit; return how many."""
    stack, found, waiting = sweep.stack, 0, 1
    stack[0, 0] = body.root[b]
    while waiting > 0:
        waiting -= 1
        n = stack[waiting, 0]
        if to_ball(body.node[n], p) > (body.node[n, 3] + most) ** 2:
            continue
        if body.count[n] == 0:
            stack[waiting, 0], stack[waiting + 1, 0] = body.right[n], n + 1
            waiting += 2
            continue
        for e in range(body.first[n], body.first[n] + body.count[n]):
            if to_ball(body.ball[e], p) > (body.ball[e, 3] + most) ** 2:
                continue
            if found < listed.shape[0] and square_to_core(body, e, p) <= most * most:
                listed[found] = e
                found += 1
    return found


@kernel
def gap_at_rest(pair: BodyPair, a: int, e: int, sweep: SweepWork) -> float:
    """Return the gap between a moving element, at the pose `NOW`, and a resting one [m]."""
    moving, resting = pair.moving, pair.resting
    put_core(moving, a, sweep.hull[NOW:END], sweep.core)
    for k in range(resting.corners[e]):
        p = resting.vertices[resting.elements[e, k]]
        sweep.fixed[k, 0], sweep.fixed[k, 1], sweep.fixed[k, 2] = p[0], p[1], p[2]
    d = separation(sweep.core, moving.corners[a], sweep.fixed, resting.corners[e])[0]
    return float(d - moving.radius[a] - resting.radius[e])
