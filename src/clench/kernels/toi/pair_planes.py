"""Planes that keep two bodies of a hand apart while its joints move on straight lines (docs/method.md section 7).

Two bodies that slide along each other touch all the way. A plane between the two shows that they do no more than that.
"""

from __future__ import annotations

import math
from typing import Final

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.core_distance import separation
from clench.kernels.geometry.vectors import Vector, cross, dot, plus, scaled
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import put_point

from .pair_motion import PathProblem, PathWork, moves_one, place_pair, target_of, turned, turned_back
from .toi_work import put_core

#: The rest of a segment that a plane may prove at once is shortened by this factor, and so many lengths are tried.
SHORTER: Final = 0.25
WINDOWS: Final = 3
#: A way-point, and the share of the way to the next one.
Place = tuple[int, float]


@kernel
def highest(bodies: BodyArrays, m: int, T: Floats, n: Vector, c: Vector, radius: float, work: PathWork) -> float:
    """Return the largest coordinate along a unit vector of a body's elements that come near a ball [m].

    Elements that the ball does not reach may be left out.

    Args:
        T: the body's pose. n: the vector. c, radius: the ball [m].
    """
    stack, placed, most, waiting = work.sweep.stack, work.placed[0], -math.inf, 1
    stack[0, 0] = bodies.root[m]
    while waiting > 0:
        waiting -= 1
        node = stack[waiting, 0]
        put_point(T, bodies.node[node], placed)
        r = bodies.node[node, 3]
        away = (placed[0] - c[0]) ** 2 + (placed[1] - c[1]) ** 2 + (placed[2] - c[2]) ** 2
        if away > (r + radius) ** 2 or n[0] * placed[0] + n[1] * placed[1] + n[2] * placed[2] + r <= most:
            continue
        if bodies.count[node] == 0:
            stack[waiting, 0], stack[waiting + 1, 0] = node + 1, bodies.right[node]
            waiting += 2
            continue
        for e in range(bodies.first[node], bodies.first[node] + bodies.count[node]):
            for corner in range(bodies.corners[e]):
                put_point(T, bodies.vertices[bodies.elements[e, corner]], placed)
                most = max(most, dot(n, (placed[0], placed[1], placed[2])) + bodies.radius[e])
    return most


@kernel
def approach(
    problem: PathProblem, m: int, other: int, n: Vector, k: int, sign: float, work: PathWork
) -> tuple[float, float]:
    """Return bounds on how one link's points move along a unit vector, per segment: slowest speed, and acceleration.

    Joints that move the other link as well are left out. `work.poses` places the links.

    Args:
        m, other: the links. n: in the root's frame. sign: of the direction along `n`.
    """
    frames, path, links = problem.frames, work.lines.path, problem.links
    put_point(work.poses[m], links.node[links.root[m]], work.placed[0])
    center = (work.placed[0, 0], work.placed[0, 1], work.placed[0, 2])
    speed, omega, rates, bend = 0.0, (0.0, 0.0, 0.0), 0.0, 0.0
    for i in range(frames.joint.shape[0]):
        if not moves_one(problem, m, other, i):
            continue
        j = frames.joint[i]
        rate = path[k + 1, j] - path[k, j]
        if rate == 0.0:
            continue
        T = work.poses[i]
        axis = turned(T, (frames.axis[j, 0], frames.axis[j, 1], frames.axis[j, 2]))
        put_point(T, frames.anchor[j], work.placed[0])
        arm = plus(center, (-work.placed[0, 0], -work.placed[0, 1], -work.placed[0, 2]))
        speed += rate * dot(n, cross(axis, arm))
        omega = plus(omega, scaled(axis, rate))
        bend += abs(rate) * problem.reach[m, j] * (abs(rate) + 2.0 * rates)
        rates += abs(rate)
    twist = cross(n, omega)
    return sign * speed - math.sqrt(dot(twist, twist)) * links.node[links.root[m], 3], bend


@kernel
def palm_moves(problem: PathProblem, m: int, k: int, path: Floats) -> bool:
    """Say whether a joint moves the palm, and the object with it, but not a link, on a segment."""
    frames, palm, moves = problem.frames, problem.frames.palm[0], False
    for i in range(frames.joint.shape[0]):
        if moves_one(problem, palm, m, i):
            moves = moves or path[k, frames.joint[i]] != path[k + 1, frames.joint[i]]
    return moves


@kernel
def keep_normal(problem: PathProblem, r: int, work: PathWork) -> None:
    """Write the direction between the closest elements, in the frame of the second body, to `work.normal`."""
    sweep, links = work.sweep, problem.links
    target, _ = target_of(problem, r)
    i, e = sweep.pair[0], sweep.pair[1]
    put_core(links, i, sweep.moving, sweep.core)
    put_core(target, e, sweep.resting, sweep.fixed)
    _, nx, ny, nz, _, _, _, _, _ = separation(sweep.core, links.corners[i], sweep.fixed, target.corners[e])
    keep_direction((nx, ny, nz), work)


@kernel
def keep_direction(n: Vector, work: PathWork) -> None:
    """Write a direction between the two bodies, in the frame of the second one, to `work.normal`."""
    T = work.sweep.resting
    for axis in range(3):
        work.normal[axis] = T[0, axis] * n[0] + T[1, axis] * n[1] + T[2, axis] * n[2]


@kernel
def height_between(problem: PathProblem, m: int, r: int, n: Vector, motion: float, work: PathWork) -> float:
    """Return how far the first body of a pair lies beyond the second one along a unit vector [m].

    Elements that no relative motion of `motion` [m] can bring to the other body may be left out.

    Args:
        m, r: the pair, as `place_pair` has placed it. n: in the palm's frame.
    """
    sweep, links, ball = work.sweep, problem.links, problem.links.node[problem.links.root[m]]
    target, b = target_of(problem, r)
    put_point(sweep.moving, ball, work.placed[0])
    c = (work.placed[0, 0], work.placed[0, 1], work.placed[0, 2])
    below = -highest(links, m, sweep.moving, (-n[0], -n[1], -n[2]), c, ball[3], work)
    return float(below - highest(target, b, sweep.resting, n, c, ball[3] + motion, work))


@kernel
def base_of(problem: PathProblem, m: int, r: int) -> int:
    """Return the last link from which both bodies of a pair hang: the palm for the object."""
    if r < 0:
        return int(problem.frames.palm[0])
    base = 0
    for i in range(problem.frames.joint.shape[0]):
        if problem.lineage[m, i] != 0 and problem.lineage[r, i] != 0:
            base = i
    return base


@kernel
def stays_above(start: float, end: float, bend: float) -> bool:
    """Say whether a height that changes from `start` to `end` and bends by at most `bend` is never below 0.

    After a share s of the way it is at least `(1 - s) start + s end - bend s (1 - s) / 2`.
    """
    if start < 0.0 or end < 0.0:
        return False
    change = abs(end - start)
    if 2.0 * change >= bend:
        return True
    return 0.5 * (start + end) - 0.5 * change * change / bend - 0.125 * bend >= 0.0


@kernel
def parted_window(
    problem: PathProblem, m: int, r: int, place: Place, n: Vector, h: float, bend: float, margin: float, work: PathWork
) -> float:
    """Return for which share of a segment a plane keeps a pair apart, by its heights at both ends of a window.

    Args:
        m, r: the pair. place: its way-point and share, where `place_pair` leaves it. n: normal of the plane, in the
            palm's frame. h: height there, with the margin [m]. bend: bound on its acceleration on a whole segment [m].
        margin: part of the heights [m].
    """
    (k, t), base, palm = place, base_of(problem, m, r), problem.frames.palm[0]
    motion = work.left[k] - work.left[k + 1]
    local, length, found = turned_back(work.poses[base], turned(work.poses[palm], n)), 1.0 - t, 0.0
    for _ in range(WINDOWS):
        place_pair(problem, m, r, k, t + length, work)
        there = turned_back(work.poses[palm], turned(work.poses[base], local))
        end = height_between(problem, m, r, there, motion, work) + margin
        if stays_above(h, end, bend * length * length):
            found = length
            break
        length *= SHORTER
    place_pair(problem, m, r, k, t, work)
    return found


@kernel
def parted_share(problem: PathProblem, m: int, r: int, k: int, t: float, margin: float, work: PathWork) -> float:
    """Return for which share of a segment the plane of `work.normal` keeps a pair apart, up to `margin` [m]; 0 without.

    The plane turns with the joints that move both bodies. A gap that begins as `h`, changes at a speed of at least `b`
    and bends by at most `M` is at least `h + b s - M s² / 2`. If that is not enough for the rest of the segment, the
    heights at both ends of a window may be, see `stays_above`. `place_pair` has placed the pair.
    """
    palm, kept = problem.frames.palm[0], (work.normal[0], work.normal[1], work.normal[2])
    if dot(kept, kept) == 0.0 or (r < 0 and palm_moves(problem, m, k, work.lines.path)):
        return 0.0
    n = turned(work.sweep.resting, kept)
    h = height_between(problem, m, r, n, work.left[k] - work.left[k + 1], work) + margin
    if not h > 0.0:
        return 0.0
    # `work.poses` places links in the root's frame, `sweep` in the palm's.
    root = turned(work.poses[palm], n)
    speed, bend = approach(problem, m, r if r >= 0 else palm, root, k, 1.0, work)
    if r >= 0:
        other, more = approach(problem, r, m, root, k, -1.0, work)
        speed, bend = speed + other, bend + more
    share = share_above(h, speed, bend)
    if share >= 1.0 - t:
        return share
    return max(share, parted_window(problem, m, r, (k, t), n, h, bend, margin, work))


@kernel
def share_above(h: float, speed: float, bend: float) -> float:
    """Return up to which share s, at most 1, `h + speed s - bend s² / 2` is not negative."""
    if bend <= 0.0:
        return 1.0 if h + speed >= 0.0 else -h / speed
    root = math.sqrt(speed * speed + 2.0 * bend * h)
    return min(1.0, (speed + root) / bend if speed >= 0.0 else 2.0 * h / (root - speed))
