"""Decide whether two convex cores that touch may move on, and how far (docs/method.md section 3, touching at the
start).

They may if a plane separates them now and continues to do so. Planes that rest are looked at first: those of faces and
those along two edges. A core that tilts off a corner, or rolls off an edge, takes its plane along; that is probed by a
step so short that nothing is missed on it.
"""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.core_distance import edge_count, face_normal, separation
from clench.kernels.geometry.vectors import Vector
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.coupled import safe_step
from clench.kernels.sections.turning import is_blocking

from .core_motion import (
    CorePair,
    carried_back,
    corner_motion,
    move_core,
    pair_gap,
    plane_gap,
    plane_offset,
    turn_rate,
    turn_to_plane,
    widest_motion,
)

#: Below this fraction of the touch tolerance a gap has no direction of its own [-].
FLAT = 1.0 / 256.0
#: A pair that overlaps by up to this many touch tolerances at the start touches: docs/method.md section 3 says 1e-9 of
#: the finger's length [-].
OVERLAPPING = 10.0
#: Answers for a touching pair: no plane permits the motion; no plane separates it.
BLOCKED, OVERLAP = 0.0, -1.0
#: Edges with a smaller sine between them give no plane; with one below the second it is made square to them [-].
ALONG, BARELY = 1e-9, 1e-4
#: A plane across which the cores are known to lie the other way round does not separate them: the cosine [-].
OPPOSED = -0.5
#: A plane that separates a touching pair may turn this many times as fast as the moving core [-].
TILT = 64.0


@kernel
def plane_permits(pair: CorePair, nx: float, ny: float, nz: float, offset: float, s: float) -> bool:
    """Say whether no corner that touches a plane at `s` moves on into it."""
    moving, placed = pair.moving, pair.moving.placed
    for k in range(moving.corners):
        gap = nx * placed[k, 0] + ny * placed[k, 1] + nz * placed[k, 2] - offset
        if gap <= pair.touch:
            slope, curvature, lever, _ = corner_motion(moving.core, k, moving.chain, moving.rows, nx, ny, nz, s)
            if is_blocking(slope, curvature, lever, pair.touch):
                return False
    return True


@kernel
def leave_plane(pair: CorePair, nx: float, ny: float, nz: float, offset: float, s: float, best: float) -> float:
    """Return for how long after `s` a plane that permits the motion keeps separating, at most `best`."""
    moving, placed, count, touch, step = pair.moving, pair.moving.placed, pair.moving.rows, pair.touch, best
    rate = abs(moving.chain[count - 1, 0])
    for k in range(moving.corners):
        gap = nx * placed[k, 0] + ny * placed[k, 1] + nz * placed[k, 2] - offset
        slope, curvature, _, bound = corner_motion(moving.core, k, moving.chain, count, nx, ny, nz, s)
        if bound == 0.0:
            continue
        if count == 1:
            limit = step * rate
            if gap <= touch:
                # The touch is one root, and half way between the two the point is farthest from the plane.
                turn = 2.0 * math.atan2(slope / rate, -curvature / (rate * rate))
                turn = limit if turn <= 0.0 else min(turn, limit)
            else:
                turn = turn_to_plane(gap, slope / rate, curvature / (rate * rate), limit)
            if turn < limit:
                step = turn / rate
        elif gap <= touch:
            least = math.sqrt(2.0 * touch / bound)
            step = min(step, max(safe_step(max(gap, 0.0), max(slope, 0.0), bound), least))
        else:
            step = min(step, safe_step(gap, slope, bound))
    return step


@kernel
def lies_in_plane(a: Floats, ka: int, b: Floats, kb: int, nx: float, ny: float, nz: float, touch: float) -> bool:
    """Say whether two cores lie in one plane with normal n, so that it separates them with either orientation."""
    return -plane_gap(a, ka, b, kb, nx, ny, nz) <= touch and -plane_gap(b, kb, a, ka, nx, ny, nz) <= touch


@kernel
def looks_along(face: Floats, nx: float, ny: float, nz: float) -> bool:
    """Say whether a moving face looks along n, so that its body lies on the side from which n points."""
    mx, my, mz, _ = face_normal(face)
    return nx * mx + ny * my + nz * mz > 0.0


@kernel
def separates(pair: CorePair, nx: float, ny: float, nz: float) -> bool:
    """Say whether a plane across n keeps a touching pair apart.

    A plane in which both lie does so only with the body of the moving one on its own side.
    """
    if pair_gap(pair, nx, ny, nz) < -OVERLAPPING * pair.touch:
        return False
    placed, corners = pair.moving.placed, pair.moving.corners
    if corners < 3 or pair.w > 0.0 or not looks_along(placed, nx, ny, nz):
        return True
    return not lies_in_plane(placed, corners, pair.fixed, pair.corners, nx, ny, nz, pair.touch)


@kernel
def try_direction(pair: CorePair, nx: float, ny: float, nz: float, known: Vector, s: float, best: float) -> float:
    """Return how far a touching pair may move on from `s` if a plane across n separates it and permits the motion.

    `BLOCKED` when the plane does not permit it, `OVERLAP` when it does not even separate.

    Args:
        known: unit direction from the resting to the moving core; zeros where they are too close to have one.
    """
    if nx * known[0] + ny * known[1] + nz * known[2] < OPPOSED:
        return OVERLAP
    if not separates(pair, nx, ny, nz):
        return OVERLAP
    offset = plane_offset(pair.fixed, pair.corners, nx, ny, nz) + pair.w
    if not plane_permits(pair, nx, ny, nz, offset, s):
        return BLOCKED
    return leave_plane(pair, nx, ny, nz, offset, s, best)


@kernel
def try_across(pair: CorePair, u: Vector, v: Vector, known: Vector, s: float, best: float) -> float:
    """Return the better answer of `try_direction` for the two directions across u and v (none where parallel)."""
    nx, ny, nz = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
    square, uu = nx * nx + ny * ny + nz * nz, u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
    scale = uu * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    if square <= ALONG * ALONG * scale:
        return OVERLAP
    if square <= BARELY * BARELY * scale:
        # Rounding leaves a part along the edges; over their length the plane would cut into the elements.
        along = (nx * u[0] + ny * u[1] + nz * u[2]) / uu
        nx, ny, nz = nx - along * u[0], ny - along * u[1], nz - along * u[2]
        square = nx * nx + ny * ny + nz * nz
    size = math.sqrt(square)
    nx, ny, nz = nx / size, ny / size, nz / size
    one = try_direction(pair, nx, ny, nz, known, s, best)
    other = try_direction(pair, -nx, -ny, -nz, known, s, best)
    return max(one, other)


@kernel
def side(core: Floats, corners: int, k: int) -> Vector:
    """Return a core's edge from corner `k` on."""
    j = (k + 1) % corners
    return core[j, 0] - core[k, 0], core[j, 1] - core[k, 1], core[j, 2] - core[k, 2]


@kernel
def leave_touch(pair: CorePair, known: Vector, s: float, best: float) -> float:
    """Return how far a sharp pair that touches at `s` may move on from planes that rest; see `try_direction`.

    The planes to look at are those of the faces, those along two edges, and, for cores in one plane, those across a
    face along an edge.
    """
    placed, ka, fixed, kb, found = pair.moving.placed, pair.moving.corners, pair.fixed, pair.corners, OVERLAP
    for i in range(ka if ka > 1 else 0):
        for k in range(kb if kb > 1 else 0):
            u, v = side(placed, ka, i), side(fixed, kb, k)
            found = max(found, try_across(pair, u, v, known, s, best))
    for face in range(2):
        nx, ny, nz, size = 0.0, 0.0, 0.0, 0.0
        if face == 0 and kb == 3:
            nx, ny, nz, size = face_normal(fixed)
        if face == 1 and ka == 3:
            nx, ny, nz, size = face_normal(placed)
        if size > 0.0:
            n = (nx, ny, nz)
            for _ in range(2):
                nx, ny, nz = -nx, -ny, -nz
                found = max(found, try_direction(pair, nx, ny, nz, known, s, best))
            for k in range(ka if ka > 1 else 0):
                u = side(placed, ka, k)
                found = max(found, try_across(pair, n, u, known, s, best))
            for k in range(kb if kb > 1 else 0):
                v = side(fixed, kb, k)
                found = max(found, try_across(pair, n, v, known, s, best))
    return found


@kernel
def starts_apart(pair: CorePair, m: Vector, back: Vector, turn: float) -> bool:
    """Say whether a plane separates a touching pair from which one across m is reached by a turn of that size.

    Tried are m itself, m on its way with the moving core, and the planes along two edges.

    Args:
        m: unit direction across the plane that separates the pair after the step. back: the same direction before the
            step if it goes along with the moving core. turn: of that core on the step, at most [rad].
    """
    if separates(pair, m[0], m[1], m[2]):
        return True
    if separates(pair, back[0], back[1], back[2]):
        return True
    placed, ka, fixed, kb = pair.moving.placed, pair.moving.corners, pair.fixed, pair.corners
    for i in range(edge_count(ka)):
        for k in range(edge_count(kb)):
            u, v = side(placed, ka, i), side(fixed, kb, k)
            nx, ny, nz = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
            size = math.sqrt(nx * nx + ny * ny + nz * nz)
            if size == 0.0:
                continue
            if nx * m[0] + ny * m[1] + nz * m[2] < 0.0:
                size = -size
            nx, ny, nz = nx / size, ny / size, nz / size
            away = (nx - m[0]) ** 2 + (ny - m[1]) ** 2 + (nz - m[2]) ** 2
            if away <= (TILT * turn) ** 2 and separates(pair, nx, ny, nz):
                return True
    return False


@kernel
def probe(pair: CorePair, known: Vector, s: float, best: float) -> float:
    """Return a short step after which a touching pair is apart and on which it does not overlap, or `BLOCKED`.

    One plane separates the pair now, and another one after the step. A plane that turns evenly between them separates
    the pair on the way, up to the bends of the corners' paths. The step keeps these below the touch tolerance.
    """
    moving = pair.moving
    core, ka, chain, count, placed = moving.core, moving.corners, moving.chain, moving.rows, moving.placed
    fixed, kb, w, touch = pair.fixed, pair.corners, pair.w, pair.touch
    rate, (speed, bend) = turn_rate(chain, count), widest_motion(pair.moving, s)
    bend += 2.0 * TILT * rate * speed
    if bend == 0.0:
        return BLOCKED
    step = min(math.sqrt(8.0 * touch / bend), best)
    ahead = placed[3:]
    move_core(core, ka, chain, count, s + step, ahead)
    d, mx, my, mz, _, _, _, _, _ = separation(ahead, ka, fixed, kb)
    if d - w <= FLAT * touch or plane_gap(ahead, ka, fixed, kb, mx, my, mz) - w <= 0.5 * FLAT * touch:
        return BLOCKED
    if mx * known[0] + my * known[1] + mz * known[2] < OPPOSED:
        return BLOCKED
    m = (mx, my, mz)
    back = carried_back(m, chain, count, s, step)
    return step if starts_apart(pair, m, back, rate * step) else BLOCKED


@kernel
def move_on(pair: CorePair, nx: float, ny: float, nz: float, s: float, best: float) -> float:
    """Return how far a pair that touches at `s` may move on, at most `best`; `BLOCKED` or `OVERLAP` where it may not.

    Args:
        pair: whose moving core is placed at `s`.
        nx, ny, nz: unit direction from the resting to the moving core; zeros where they are too close to have one, and
            w = 0.
    """
    known = (nx, ny, nz)
    free = try_direction(pair, nx, ny, nz, known, s, best) if pair.w > 0.0 else leave_touch(pair, known, s, best)
    if free == BLOCKED:
        free = probe(pair, known, s, best)
    return free
