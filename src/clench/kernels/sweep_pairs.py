"""First contact of two convex cores, one of which turns (METHOD.md section 5, exact width).

A plane between the two cores, fixed with the resting one, keeps them apart until a corner of the moving core meets it:
the vertex-on-face event, whose root has a closed form. There the next plane is laid, through the closest points, until
the gap is used up. No step passes a contact, since every plane separates; vertex-face contacts, of either core, take
one step, edge-edge ones and rounded ones a few, as the planes' directions converge quadratically. Nothing is asked of
the neighbours of a core: open, thin and flipped meshes are as good as closed ones.
"""

from __future__ import annotations

import math

from .closest import crosses, face_normal, separation
from .compiling import inner_kernel
from .coupled import safe_step
from .layout import Floats
from .turning import is_blocking

#: Planes that are laid for one pair at most; a pair that needs more stops there, which is safe.
PLANES = 400
#: From this plane on, one is also laid ahead of the present place.
PLAIN = 8
#: A pair stops when its gap is below this many times the level that its planes leave open [-].
CLOSE = 1.5
#: Below this fraction of the touch tolerance a gap has no direction of its own [-].
FLAT = 1.0 / 256.0
#: A pair that overlaps by up to this many touch tolerances at the start touches: METHOD.md section 3 says 1e-9 of the
#: finger's length [-].
OVERLAPPING = 10.0
#: Answers for a touching pair: no plane permits the motion; no plane separates it.
BLOCKED, OVERLAP = 0.0, -1.0


@inner_kernel
def move_core(core: Floats, corners: int, chain: Floats, count: int, s: float, out: Floats) -> None:
    """Write a core's corners when the chain has moved by `s`; they are given relative to its last pivot."""
    x, z = 0.0, 0.0
    for i in range(count - 1):
        c, d = math.cos(chain[i, 0] * s), math.sin(chain[i, 0] * s)
        x += c * chain[i, 1] - d * chain[i, 2]
        z += d * chain[i, 1] + c * chain[i, 2]
    c, d = math.cos(chain[count - 1, 0] * s), math.sin(chain[count - 1, 0] * s)
    for k in range(corners):
        out[k, 0] = x + c * core[k, 0] - d * core[k, 2]
        out[k, 1] = core[k, 1]
        out[k, 2] = z + d * core[k, 0] + c * core[k, 2]


@inner_kernel
def base_motion(chain: Floats, count: int, nx: float, nz: float, s: float) -> tuple[float, float, float, float]:
    """Return speed and acceleration of the last pivot along n at `s`, and bounds on both."""
    slope, curvature, lever, bound = 0.0, 0.0, 0.0, 0.0
    for i in range(count - 1):
        rate = chain[i, 0]
        c, d = math.cos(rate * s), math.sin(rate * s)
        x, z = c * chain[i, 1] - d * chain[i, 2], d * chain[i, 1] + c * chain[i, 2]
        slope += rate * (nz * x - nx * z)
        curvature -= rate * rate * (nx * x + nz * z)
        arm = math.sqrt(x * x + z * z)
        lever += abs(rate) * arm
        bound += rate * rate * arm
    return slope, curvature, lever, bound


@inner_kernel
def corner_motion(
    core: Floats, k: int, chain: Floats, count: int, nx: float, nz: float, s: float
) -> tuple[float, float, float, float]:
    """Return speed and acceleration of a corner along n at `s`, and bounds on both."""
    rate = chain[count - 1, 0]
    c, d = math.cos(rate * s), math.sin(rate * s)
    x, z = c * core[k, 0] - d * core[k, 2], d * core[k, 0] + c * core[k, 2]
    slope, curvature, lever, bound = base_motion(chain, count, nx, nz, s)
    arm = math.sqrt(x * x + z * z)
    return (
        slope + rate * (nz * x - nx * z),
        curvature - rate * rate * (nx * x + nz * z),
        lever + abs(rate) * arm,
        bound + rate * rate * arm,
    )


@inner_kernel
def plane_offset(core: Floats, corners: int, nx: float, ny: float, nz: float) -> float:
    """Return the largest coordinate of a core along n."""
    top: float = nx * core[0, 0] + ny * core[0, 1] + nz * core[0, 2]
    for k in range(1, corners):
        top = max(top, nx * core[k, 0] + ny * core[k, 1] + nz * core[k, 2])
    return top


@inner_kernel
def turn_to_plane(gap: float, slope: float, curvature: float, best: float) -> float:
    """Return the next turn at which a point comes down to a plane, for a gap `K + A cos + B sin` >= 0 now.

    Args:
        gap: now. slope: B. curvature: -A. best: turns from here on are of no interest.
    """
    a = -curvature
    size = math.sqrt(a * a + slope * slope)
    # The gap stays above gap + slope s - size s²/2.
    if gap + best * (slope - 0.5 * size * best) > 0.0:
        return best
    constant = gap - a
    if constant >= size:
        return best
    turn = math.atan2(slope, a) + math.acos(min(max(-constant / size, -1.0), 1.0))
    return max(turn, 0.0)


@inner_kernel
def step_to_plane(
    core: Floats,
    placed: Floats,
    corners: int,
    chain: Floats,
    count: int,
    nx: float,
    ny: float,
    nz: float,
    offset: float,
    s: float,
    best: float,
) -> float:
    """Return how far the motion goes from `s` before a corner comes down to the plane `n·p = offset`, at most `best`.

    Args:
        core, placed: the moving core relative to the last pivot, and where it is at `s`.
    """
    rate = chain[count - 1, 0]
    step = best
    for k in range(corners):
        gap = nx * placed[k, 0] + ny * placed[k, 1] + nz * placed[k, 2] - offset
        slope, curvature, _, bound = corner_motion(core, k, chain, count, nx, nz, s)
        if gap <= 0.0:
            return 0.0
        if count == 1:
            limit = step * abs(rate)
            turn = turn_to_plane(gap, slope / abs(rate), curvature / (rate * rate), limit)
            if turn < limit:
                step = turn / abs(rate)
        elif bound > 0.0:
            step = min(step, safe_step(gap, slope, bound))
    return step


@inner_kernel
def plane_permits(
    core: Floats,
    placed: Floats,
    corners: int,
    chain: Floats,
    count: int,
    nx: float,
    ny: float,
    nz: float,
    offset: float,
    s: float,
    touch: float,
) -> bool:
    """Say whether no corner that touches a plane at `s` moves on into it."""
    for k in range(corners):
        gap = nx * placed[k, 0] + ny * placed[k, 1] + nz * placed[k, 2] - offset
        if gap <= touch:
            slope, curvature, lever, _ = corner_motion(core, k, chain, count, nx, nz, s)
            if is_blocking(slope, curvature, lever, touch):
                return False
    return True


@inner_kernel
def leave_plane(
    core: Floats,
    placed: Floats,
    corners: int,
    chain: Floats,
    count: int,
    nx: float,
    ny: float,
    nz: float,
    offset: float,
    s: float,
    touch: float,
    best: float,
) -> float:
    """Return for how long after `s` a plane that permits the motion goes on to separate, at most `best`."""
    step = best
    rate = abs(chain[count - 1, 0])
    for k in range(corners):
        gap = nx * placed[k, 0] + ny * placed[k, 1] + nz * placed[k, 2] - offset
        slope, curvature, _, bound = corner_motion(core, k, chain, count, nx, nz, s)
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
        else:
            least = math.sqrt(2.0 * touch / bound)
            step = min(step, max(safe_step(max(gap, 0.0), max(slope, 0.0), bound), least))
    return step


@inner_kernel
def try_direction(
    core: Floats,
    placed: Floats,
    ka: int,
    fixed: Floats,
    kb: int,
    w: float,
    chain: Floats,
    count: int,
    nx: float,
    ny: float,
    nz: float,
    s: float,
    touch: float,
    best: float,
) -> float:
    """Return how far a touching pair may move on from `s` if a plane across n separates it and permits the motion.

    `BLOCKED` when the plane does not permit it, `OVERLAP` when it does not even separate.
    """
    offset = plane_offset(fixed, kb, nx, ny, nz) + w
    if -plane_offset(placed, ka, -nx, -ny, -nz) - offset < -OVERLAPPING * touch:
        return OVERLAP
    if not plane_permits(core, placed, ka, chain, count, nx, ny, nz, offset, s, touch):
        return BLOCKED
    return leave_plane(core, placed, ka, chain, count, nx, ny, nz, offset, s, touch, best)


@inner_kernel
def lies_in_plane(a: Floats, ka: int, b: Floats, kb: int, nx: float, ny: float, nz: float, touch: float) -> bool:
    """Say whether two cores lie in one plane with normal n, so that it separates them whichever way it looks."""
    high = max(plane_offset(a, ka, nx, ny, nz), plane_offset(b, kb, nx, ny, nz))
    low = -max(plane_offset(a, ka, -nx, -ny, -nz), plane_offset(b, kb, -nx, -ny, -nz))
    return high - low <= touch


@inner_kernel
def is_under(face: Floats, nx: float, ny: float, nz: float) -> bool:
    """Say whether a moving face looks against n, so that its body lies on the side to which n points."""
    mx, my, mz, _ = face_normal(face)
    return nx * mx + ny * my + nz * mz <= 0.0


@inner_kernel
def leave_touch(
    core: Floats,
    placed: Floats,
    ka: int,
    fixed: Floats,
    kb: int,
    chain: Floats,
    count: int,
    s: float,
    touch: float,
    best: float,
) -> float:
    """Return how far a sharp pair that touches at `s` may move on; see `try_direction`.

    Two convex cores that touch are blocked when no plane between them permits the motion. The planes to look at are
    those of the faces and those along two edges.
    """
    found = OVERLAP
    for face in range(2):
        nx, ny, nz, size = 0.0, 0.0, 0.0, 0.0
        if face == 0 and kb == 3:
            nx, ny, nz, size = face_normal(fixed)
        if face == 1 and ka == 3:
            nx, ny, nz, size = face_normal(placed)
        if size > 0.0:
            flat = lies_in_plane(fixed, kb, placed, ka, nx, ny, nz, touch)
            for _ in range(2):
                nx, ny, nz = -nx, -ny, -nz
                if flat and not is_under(placed, nx, ny, nz):
                    continue
                one = try_direction(core, placed, ka, fixed, kb, 0.0, chain, count, nx, ny, nz, s, touch, best)
                found = max(found, one)
    for i in range(ka if ka > 1 else 0):
        for k in range(kb if kb > 1 else 0):
            j, m = (i + 1) % ka, (k + 1) % kb
            ux, uy, uz = placed[j, 0] - placed[i, 0], placed[j, 1] - placed[i, 1], placed[j, 2] - placed[i, 2]
            vx, vy, vz = fixed[m, 0] - fixed[k, 0], fixed[m, 1] - fixed[k, 1], fixed[m, 2] - fixed[k, 2]
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            size = math.sqrt(nx * nx + ny * ny + nz * nz)
            scale = (ux * ux + uy * uy + uz * uz) * (vx * vx + vy * vy + vz * vz)
            if size * size > 1e-12 * scale:
                nx, ny, nz = nx / size, ny / size, nz / size
                for _ in range(2):
                    nx, ny, nz = -nx, -ny, -nz
                    one = try_direction(core, placed, ka, fixed, kb, 0.0, chain, count, nx, ny, nz, s, touch, best)
                    found = max(found, one)
    return found


@inner_kernel
def sweep_pair(
    core: Floats,
    ka: int,
    fixed: Floats,
    kb: int,
    w: float,
    chain: Floats,
    count: int,
    touch: float,
    best: float,
    rough: bool,
    placed: Floats,
) -> float:
    """Return the first `s` before `best` at which two cores come within `w` of each other, else `best`.

    The gap that is left is positive and at most the touch tolerance. A pair that starts closer than that may close
    half of what it has. `OVERLAP` where the cores are nearer than `w` at the start.

    Args:
        core: the moving core relative to the last pivot [m], (3, 3). ka: its corners.
        fixed: the resting one relative to the first pivot [m], (3, 3). kb: its corners.
        w: sum of their radii [m].
        chain, count: what moves, rows (Ω, e_x, e_z); the last row gives only its rate.
        touch: gaps up to this touch [m]. rough: what touches at the start has met, whichever way it goes.
        placed: scratch space, (6, 3); its first rows are the moving core at the contact.
    """
    s, level, leap = 0.0, -1.0, 2.0
    for turn in range(PLANES):
        move_core(core, ka, chain, count, s, placed)
        d, nx, ny, nz, _, _, _, _, _ = separation(placed, ka, fixed, kb)
        gap = d - w
        if s == 0.0 and crosses(placed, ka, fixed, kb):
            gap = -w
        if level >= 0.0 and gap <= CLOSE * level:
            return s
        if level < 0.0 and rough and gap <= touch:
            return s
        if level < 0.0 and gap <= FLAT * touch:
            if w > 0.0:
                free = try_direction(core, placed, ka, fixed, kb, w, chain, count, nx, ny, nz, s, touch, best - s)
            else:
                free = leave_touch(core, placed, ka, fixed, kb, chain, count, s, touch, best - s)
            if free <= 0.0:
                return s if free == BLOCKED else OVERLAP
            if s + free >= best:
                return best
            s += 0.5 * free
        else:
            if level < 0.0:
                level = 0.5 * min(gap, touch)
            offset = plane_offset(fixed, kb, nx, ny, nz) + w + level
            step = step_to_plane(core, placed, ka, chain, count, nx, ny, nz, offset, s, best - s)
            if step <= 0.0:
                return s
            if turn >= PLAIN:
                # Edges almost parallel: the closest points run along them. A plane laid ahead lasts longer.
                move_core(core, ka, chain, count, s + leap * step, placed[3:])
                _, nx, ny, nz, _, _, _, _, _ = separation(placed[3:], ka, fixed, kb)
                offset = plane_offset(fixed, kb, nx, ny, nz) + w + level
                longer = step_to_plane(core, placed, ka, chain, count, nx, ny, nz, offset, s, best - s)
                leap = 2.0 * leap if longer > step else max(0.5 * leap, 1.0)
                step = max(step, longer)
            s += step
            if s >= best:
                return best
    return s
