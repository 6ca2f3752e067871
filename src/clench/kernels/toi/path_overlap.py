"""Find where a hand that moves along a path first overlaps itself or the object (docs/method.md section 7).

The sweep takes a pair of bodies along every segment of the path until the two touch. From there on the pair is
looked at in steps so short that it cannot overlap by more than `OVERLAP` between two looks, until it is apart again.
Thus no deeper overlap is missed.
"""

from __future__ import annotations

import math
from typing import Final

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.link_meshes import LinkMeshArrays, ObjectMesh, depth_of, has_contained, mesh_of
from clench.kernels.geometry.vectors import dot
from clench.kernels.hulls.near_elements import list_touching
from clench.kernels.hulls.near_hulls import links_parting
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.sections.plane_pose import compose_inverse

from .pair_motion import (
    PathProblem,
    PathWork,
    free_share,
    make_path_work,
    place_pair,
    put_left,
    put_turning,
    target_of,
    turned,
)
from .pair_planes import keep_direction, keep_normal, parted_share
from .path_lines import PAIR, keep_lines, place_on_path
from .toi_work import ball_gap, bodies_overlap, body_gap

#: Two bodies may overlap by this much and still count as touching: the tolerance of the proof [m].
OVERLAP: Final = 1e-5
#: A look finds an overlap from this depth on [m]. The rest of `OVERLAP` is the least motion between two looks.
FOUND: Final = 5e-6
#: The sweep takes a pair up to this gap [m].
TOUCH: Final = 1e-6
#: The sweep continues with a pair whose gap has grown to this [m].
APART: Final = 3e-6
#: Bodies that overlapped where the path began are looked at in steps of this motion until they are apart [m].
EXEMPT_STEP: Final = 2e-4
#: No pair is looked at more often on one path: bodies that rub against each other all the way are given up.
MOST_LOOKS: Final = 3_000
#: The gap between two balls is enough for a step if it is this share of the motion that is left [-].
BALLS: Final = 0.25


@kernel
def gap_between(problem: PathProblem, p: int, was_apart: bool, work: PathWork) -> float:
    """Return the gap of a pair in its present place, minus its depth where the pair overlaps; `APART` if larger [m].

    For two links, the distance of their hulls takes the place of the gap if they are apart, and minus their overlap if
    that is too small to count: neither is larger than the gap. The direction between the hulls, or between the closest
    elements, is kept as the normal of a plane that may part the pair.

    Args:
        was_apart: the pair did not overlap at all where it was looked at last. It has not moved by more than `OVERLAP`
            beyond a touch since. So no closed body lies in the other one if no elements cross. Otherwise a point of
            each part tells.
    """
    m, r = problem.pairs[p, 0], problem.pairs[p, 1]
    if balls_gap(problem, m, r, work) >= APART:
        return APART
    if r >= 0:
        gap = gap_of_hulls(problem, m, r, work)
        if gap >= -FOUND:
            return min(gap, APART)
    target, b = target_of(problem, r)
    work.sweep.pair[0] = -1
    listed = list_touching(problem.links, m, target, b, APART, work.sweep)
    gap = body_gap(problem.links, m, target, b, listed, APART, 1.0, work.sweep)
    for axis in range(3):
        work.normal[axis] = 0.0
    if work.sweep.pair[0] >= 0:
        keep_normal(problem, r, work)
    crossing = not are_closed(problem, m, r) or cross(problem, p, listed, work)
    if not crossing and (was_apart or not holds_part(problem, m, r, work)):
        return gap
    depth = depth_between(problem, m, r, work)
    return -depth if depth > max(0.0, -gap) else gap


@kernel
def gap_of_hulls(problem: PathProblem, m: int, r: int, work: PathWork) -> float:
    """Return how far the hulls of two links are apart in their present place; minus how far they overlap at most [m].

    The direction between the hulls is kept. A point in two hulls that moves along it leaves one of them after their
    overlap, and no other hull is as near as that. Otherwise the result is -∞.
    """
    sweep, kept = work.sweep, (work.normal[0], work.normal[1], work.normal[2])
    n = turned(sweep.resting, kept) if dot(kept, kept) > 0.0 else (0.0, 0.0, 1.0)
    gap, side, others = links_parting(problem.links, m, r, n, sweep)
    if gap <= 0.0 and others <= -gap:
        return -math.inf
    keep_direction(side, work)
    return gap


@kernel
def are_closed(problem: PathProblem, m: int, r: int) -> bool:
    """Say whether both bodies of a pair are closed: a surface can get into an open one without crossing it."""
    closed = problem.meshes.closed
    return bool(closed[problem.mesh[m]] and (problem.solid.closed if r < 0 else closed[problem.mesh[r]]))


@kernel
def cross(problem: PathProblem, p: int, listed: int, work: PathWork) -> bool:
    """Say whether elements of a pair cross, by more than `TOUCH` if they are round.

    The gap of elements that cross, which is that of their corners and edges, does not tell.

    Args:
        listed: so many elements of the second body are near the first one, see `list_touching`.
    """
    if listed == 0:
        return False
    m, (target, b) = problem.pairs[p, 0], target_of(problem, problem.pairs[p, 1])
    return bool(bodies_overlap(problem.links, m, target, b, TOUCH, False, listed, work.sweep))


@kernel
def balls_gap(problem: PathProblem, m: int, r: int, work: PathWork) -> float:
    """Return the gap between the balls around a pair in its present place [m]."""
    target, b = target_of(problem, r)
    return float(ball_gap(problem.links, problem.links.root[m], target, target.root[b], work.sweep))


@kernel
def solid_link(meshes: LinkMeshArrays, k: int) -> ObjectMesh:
    """Return the surface of a link as that of an object."""
    return ObjectMesh(
        mesh_of(meshes, k),
        meshes.owners[meshes.triangle_first[k] : meshes.triangle_first[k + 1]],
        meshes.closed[k] != 0,
        meshes.points[meshes.point_first[k] : meshes.point_first[k + 1]],
    )


@kernel
def holds_part(problem: PathProblem, m: int, r: int, work: PathWork) -> bool:
    """Say whether a part of one body of a pair lies in the other one, in their present place."""
    meshes, k, T, p = problem.meshes, problem.mesh[m], work.depth.poses[0], work.depth.points[0]
    compose_inverse(work.sweep.resting, work.sweep.moving, T)
    if r < 0:
        return bool(has_contained(meshes, k, T, problem.solid, p))
    return bool(has_contained(meshes, k, T, solid_link(meshes, problem.mesh[r]), p))


@kernel
def depth_between(problem: PathProblem, m: int, r: int, work: PathWork) -> float:
    """Return how deep a pair overlaps in its present place [m]; 0 when it is apart."""
    meshes, k, sweep = problem.meshes, problem.mesh[m], work.sweep
    limit = 2.0 * meshes.radius[k]
    if r < 0:
        return float(depth_of(meshes, k, sweep.moving, problem.solid, sweep.resting, limit, work.depth)[0])
    other = solid_link(meshes, problem.mesh[r])
    return float(depth_of(meshes, k, sweep.moving, other, sweep.resting, limit, work.depth)[0])


@kernel
def step_on(left: Floats, last: int, k: int, t: float, motion: float) -> tuple[int, float]:
    """Return the place at which a pair has moved by `motion` [m] since a place; the last way-point at the latest."""
    while k < last:
        own = left[k] - left[k + 1]
        rest = (1.0 - t) * own
        if own > 0.0 and motion < rest:
            return k, t + motion / own
        motion -= rest
        k, t = k + 1, 0.0
    return last, 0.0


@kernel
def next_touch(problem: PathProblem, m: int, r: int, k: int, t: float, work: PathWork) -> tuple[int, float]:
    """Return the place at which a pair that is apart touches next; the last way-point where it does not."""
    left, last = work.left, work.lines.last[PAIR]
    while k < last:
        place_pair(problem, m, r, k, t, work)
        balls = balls_gap(problem, m, r, work)
        rest = left[k] - t * (left[k] - left[k + 1])
        if balls > BALLS * rest:
            k, t = step_on(left, last, k, t, balls)
            continue
        share = free_share(problem, m, r, k, t, TOUCH, work)
        if share < 1.0:
            return k, t + max(share, 0.0) * (1.0 - t)
        k, t = k + 1, 0.0
    return last, 0.0


@kernel
def pass_plane(
    problem: PathProblem, m: int, r: int, k: int, t: float, least: float, work: PathWork
) -> tuple[int, float, bool]:
    """Return the place up to which the plane of `work.normal` proves a pair, and whether that is `least` [m] on."""
    share, motion = parted_share(problem, m, r, k, t, OVERLAP, work), work.left[k] - work.left[k + 1]
    if share >= 1.0 - t:
        return k + 1, 0.0, True
    if share * motion >= least:
        return k, t + share, True
    return k, t, False


@kernel
def overlap_of(problem: PathProblem, p: int, until: float, work: PathWork) -> tuple[float, float, bool]:
    """Return the place at which a pair first overlaps, and the depth there [m]; infinite and 0 without an overlap.

    Return also whether the pair overlaps where the path begins. Such a pair may stay as deep as it was at any look
    since, until it is apart. The depth is not a number where `MOST_LOOKS` are not enough to prove that the pair stays
    apart.

    Args:
        until: later places on the path are of no interest.
    """
    m, r, pad = problem.pairs[p, 0], problem.pairs[p, 1], problem.allowed[p]
    put_left(problem, m, r, work)
    left, last, k, t, exempt, looks, gap, begun = work.left, work.lines.last[PAIR], 0, 0.0, 0.0, 0, -1.0, False
    for axis in range(3):
        work.normal[axis] = 0.0
    while until == math.inf or place_of(problem, m, r, k, t, work) <= until:
        place_pair(problem, m, r, k, t, work)
        rest, passed = left[k] - t * (left[k] - left[min(k + 1, last)]), False
        if k < last and exempt == 0.0:
            k, t, passed = pass_plane(problem, m, r, k, t, FOUND, work)
            if passed:
                continue
        looks += 1
        if looks > MOST_LOOKS:
            return place_of(problem, m, r, k, t, work), math.nan, begun
        gap = gap_between(problem, p, gap >= 0.0, work)
        depth = -gap - pad
        if k + t == 0.0 and depth > FOUND:
            exempt, begun = depth, True
        if depth > (exempt + OVERLAP if exempt > 0.0 else FOUND):
            return place_of(problem, m, r, k, t, work), depth + pad, begun
        exempt = min(exempt, depth) if depth > FOUND else 0.0
        motion = EXEMPT_STEP if exempt > 0.0 else OVERLAP - depth
        if k == last or (exempt == 0.0 and motion >= rest):
            break
        if gap >= APART:
            k, t = next_touch(problem, m, r, k, t, work)
            if k == last:
                break
            continue
        if exempt == 0.0:
            k, t, passed = pass_plane(problem, m, r, k, t, motion, work)
        if not passed:
            k, t = step_on(left, last, k, t, motion)
    return math.inf, 0.0, begun


@kernel
def place_of(problem: PathProblem, m: int, r: int, k: int, t: float, work: PathWork) -> float:
    """Return the place on the path of a place on a line of a pair."""
    return float(place_on_path(problem.path, k, t, work.turning, put_turning(problem, m, r, work), work.lines))


@entry_kernel(allocates=True)
def first_overlap(problem: PathProblem, out: Floats) -> int:
    """Return the pair that overlaps first on a path, -1 when none does.

    Write to `out`, (3,), the place and the depth, and how many pairs overlap where the path begins. The place is the
    number of the way-point before, plus the share of the way to the next one.
    """
    work = make_path_work(problem.path.shape[1], problem.frames.parent.shape[0], problem.path.shape[0])
    found, until, out[2] = -1, math.inf, 0.0
    keep_lines(problem.path, problem.frames, work.turning, work.lines)
    for p in range(problem.pairs.shape[0]):
        place, depth, begun = overlap_of(problem, p, until, work)
        if begun:
            out[2] += 1.0
        if place < until:
            found, until = p, place
            out[0], out[1] = place, depth
    return found
