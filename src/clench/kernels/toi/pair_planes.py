"""Planes that keep two bodies of a hand apart while its joints move on straight lines (docs/method.md section 7).

Two bodies that slide along each other touch all the way. A plane between the two shows that they do no more than that.
"""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.core_distance import separation
from clench.kernels.geometry.vectors import Vector, cross, dot, plus, scaled
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import put_point

from .pair_motion import PathProblem, PathWork, moves_one, target_of, turned
from .toi_work import put_core


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
    frames, path, links = problem.frames, problem.path, problem.links
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
def palm_moves(problem: PathProblem, m: int, k: int) -> bool:
    """Say whether a joint moves the palm, and the object with it, but not a link, on a segment."""
    frames, palm, moves = problem.frames, problem.frames.palm[0], False
    for i in range(frames.joint.shape[0]):
        if moves_one(problem, palm, m, i):
            moves = moves or problem.path[k, frames.joint[i]] != problem.path[k + 1, frames.joint[i]]
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
def parted_share(problem: PathProblem, m: int, r: int, k: int, margin: float, work: PathWork) -> float:
    """Return for which share of a segment the plane of `work.normal` keeps a pair apart, up to `margin` [m]; 0 without.

    The plane turns with the joints that move both bodies. A gap that begins as `h`, changes at a speed of at least `b`
    and bends by at most `M` is at least `h + b s - M s² / 2`. `place_pair` has placed the pair.
    """
    sweep, links, ball = work.sweep, problem.links, problem.links.node[problem.links.root[m]]
    palm, kept = problem.frames.palm[0], (work.normal[0], work.normal[1], work.normal[2])
    if dot(kept, kept) == 0.0 or (r < 0 and palm_moves(problem, m, k)):
        return 0.0
    target, b = target_of(problem, r)
    n = turned(sweep.resting, kept)
    put_point(sweep.moving, ball, work.placed[0])
    c = (work.placed[0, 0], work.placed[0, 1], work.placed[0, 2])
    below = -highest(links, m, sweep.moving, (-n[0], -n[1], -n[2]), c, ball[3], work)
    radius = ball[3] + work.left[k] - work.left[k + 1]
    h = below - highest(target, b, sweep.resting, n, c, radius, work) + margin
    if not h > 0.0:
        return 0.0
    # `work.poses` places links in the root's frame, `sweep` in the palm's.
    n = turned(work.poses[palm], n)
    speed, bend = approach(problem, m, r if r >= 0 else palm, n, k, 1.0, work)
    if r >= 0:
        other, more = approach(problem, r, m, n, k, -1.0, work)
        speed, bend = speed + other, bend + more
    if bend <= 0.0:
        return 1.0 if h + speed >= 0.0 else -h / speed
    root = math.sqrt(speed * speed + 2.0 * bend * h)
    return min(1.0, (speed + root) / bend if speed >= 0.0 else 2.0 * h / (root - speed))
