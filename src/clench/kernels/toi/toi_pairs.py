"""First contact of two convex cores, one of which turns (docs/method.md section 5, full width).

A plane between the two cores, fixed with the resting one, keeps them apart until a corner of the moving core meets it:
the vertex-on-face event, whose root has a closed form. There the next plane is laid, through the closest points, until
the gap is used up. No step passes a contact, since every plane separates; vertex-face contacts, of either core, take
one step, edge-edge ones and rounded ones a few, as the planes' directions converge quadratically. Nothing is asked of
the neighbours of a core: open, thin and flipped meshes are as good as closed ones.
"""

from __future__ import annotations

import math

from clench.kernels.geometry.core_distance import crosses, separation
from clench.kernels.runtime.compiling import entry_kernel, kernel
from clench.kernels.sections.coupled import safe_step

from .core_motion import (
    CorePair,
    MovingCore,
    base_motion,
    corner_motion,
    move_core,
    pair_gap,
    place_core,
    plane_gap,
    plane_offset,
    turn_rate,
    turn_to_plane,
    widest_motion,
)
from .separating import FLAT, OVERLAP, OVERLAPPING, move_on
from .spatial_motion import is_spatial

#: Planes that are laid for one pair at most; a pair that needs more stops there, which is safe.
PLANES = 2000
#: From this plane on, planes that turn are tried as well.
PLAIN = 8
#: A pair stops when its gap is below this many times the level that its planes leave open [-].
CLOSE = 1.5


@kernel
def fall_to_plane(moving: MovingCore, nx: float, ny: float, nz: float, offset: float, s: float, best: float) -> float:
    """Return the result of `step_to_plane` from bounds on the corners' accelerations, for any axes."""
    step, placed = best, moving.placed
    for k in range(moving.corners):
        gap = nx * placed[k, 0] + ny * placed[k, 1] + nz * placed[k, 2] - offset
        if gap <= 0.0:
            return 0.0
        slope, _, _, bound = corner_motion(moving.core, k, moving.chain, moving.rows, nx, ny, nz, s)
        if bound > 0.0:
            step = min(step, safe_step(gap, slope, bound))
    return step


@kernel
def step_to_plane(moving: MovingCore, nx: float, ny: float, nz: float, offset: float, s: float, best: float) -> float:
    """Return how far the motion goes from `s` before a corner comes down to the plane `n·p = offset`, at most `best`.

    Args:
        moving: the core, placed at `s`.
    """
    chain, count, placed = moving.chain, moving.rows, moving.placed
    if is_spatial(chain):
        return float(fall_to_plane(moving, nx, ny, nz, offset, s, best))
    rate, step, across = chain[count - 1, 0], best, math.sqrt(nx * nx + nz * nz)
    # The position and motion of the last pivot are the same for all corners, and the corners' positions are known.
    px, pz, base_slope, _, _, base_bound = base_motion(chain, count, nx, nz, s)
    for k in range(moving.corners):
        gap = nx * placed[k, 0] + ny * placed[k, 1] + nz * placed[k, 2] - offset
        if gap <= 0.0:
            return 0.0
        x, z = placed[k, 0] - px, placed[k, 2] - pz
        along, over = nx * x + nz * z, nz * x - nx * z
        if count == 1:
            limit = step * abs(rate)
            turn = turn_to_plane(gap, over if rate > 0.0 else -over, -along, limit)
            if turn < limit:
                step = turn / abs(rate)
        else:
            bound = base_bound + across * rate * rate * math.sqrt(x * x + z * z)
            if bound > 0.0:
                step = min(step, safe_step(gap, base_slope + rate * over, bound))
    return step


@kernel
def passes_by(pair: CorePair, apart: float) -> bool:
    """Say whether cores lie farther apart than that along the axis that everything turns about: it stays so."""
    placed, ka, fixed, kb = pair.moving.placed, pair.moving.corners, pair.fixed, pair.corners
    one, other = plane_gap(placed, ka, fixed, kb, 0.0, 1.0, 0.0), plane_gap(placed, ka, fixed, kb, 0.0, -1.0, 0.0)
    return bool(max(one, other) > apart)


@kernel
def turning_step(
    pair: CorePair, nx: float, ny: float, nz: float, s: float, level: float, leap: float, best: float
) -> float:
    """Return a step from `s` on which a plane that turns evenly keeps the cores `w + level` apart, or 0.

    Between the plane across n, now, and one across the closest points after the step, a corner's height over the plane
    bends by its own acceleration and by twice the plane's turn times its speed; it lies above its chord less that.

    Args:
        pair: whose moving core is placed at `s`.
        leap: factor on the step that is tried [-]. best: the longest step of interest.
    """
    moving, fixed, kb = pair.moving, pair.fixed, pair.corners
    rate, (speed, bend) = turn_rate(moving.chain, moving.rows), widest_motion(moving, s)
    margin = pair_gap(pair, nx, ny, nz) - level
    if margin <= 0.0 or speed == 0.0:
        return 0.0
    step = min(leap * math.sqrt(4.0 * margin / (bend + 2.0 * rate * speed)), best)
    ahead, ka = moving.placed[3:], moving.corners
    move_core(moving.core, ka, moving.chain, moving.rows, s + step, ahead)
    _, mx, my, mz, _, _, _, _, _ = separation(ahead, ka, fixed, kb)
    margin = min(margin, plane_gap(ahead, ka, fixed, kb, mx, my, mz) - pair.w - level)
    turn = math.sqrt((mx - nx) ** 2 + (my - ny) ** 2 + (mz - nz) ** 2)
    return step if 0.125 * step * (bend * step + 2.0 * turn * speed) <= margin else 0.0


@entry_kernel
def sweep_pair(pair: CorePair, begin: float, best: float) -> float:
    """Return the first `s` before `best` at which two cores come within `w` of each other, else `best`.

    The gap that is left is positive and at most the touch tolerance. A pair that starts closer than that may close half
    of its gap. `OVERLAP` where the cores are nearer than `w` at the start.

    Args:
        pair: the cores. The first rows of `placed` are the moving core at the contact. If nothing is met before a
            positive `best`, the sixth row is the normal of a plane that keeps the cores apart all the way from `begin`,
            or zero.
        begin: a travel up to which they are known to be farther apart, or 0.
    """
    moving, fixed, kb, w, touch = pair.moving, pair.fixed, pair.corners, pair.w, pair.touch
    placed, ka = moving.placed, moving.corners
    s, level, leap = begin, -1.0, 1.0
    for turn in range(PLANES):
        place_core(moving, s)
        d, nx, ny, nz, _, _, _, _, _ = separation(placed, ka, fixed, kb)
        gap = d - w
        if s == 0.0 and crosses(placed, ka, fixed, kb):
            gap = -w
        flat = level < 0.0 and gap <= FLAT * touch
        step = 0.0
        if not flat and (level < 0.0 or gap > CLOSE * level):
            if level < 0.0:
                level = 0.5 * min(gap, touch)
            offset = plane_offset(fixed, kb, nx, ny, nz) + w + level
            step = step_to_plane(moving, nx, ny, nz, offset, s, best - s)
        if step <= 0.0:
            # They touch. The sides of the triangles of a wall do not stop a body that moves along the wall.
            if flat and w == 0.0:
                nx, ny, nz = 0.0, 0.0, 0.0
            free = move_on(pair, nx, ny, nz, s, best - s)
            if free <= 0.0:
                # Round cores are apart: their distance says whether they overlap; a plane may not be known to 1e-10.
                apart = w > 0.0 and gap >= -OVERLAPPING * touch
                return OVERLAP if flat and free == OVERLAP and not apart else s
            level, step = -1.0, free if s + free >= best else 0.5 * free
        elif turn >= PLAIN and not is_spatial(moving.chain) and passes_by(pair, w + level):
            step = math.inf
        elif turn >= PLAIN:
            # Edges that slide along each other: the closest points run, and no plane that rests lasts.
            longer = turning_step(pair, nx, ny, nz, s, level, leap, best - s)
            leap = 2.0 * leap if longer > 0.0 else 0.25 * leap
            step = max(step, longer)
        s += step
        if s >= best:
            if turn > 0 or level < 0.0:
                nx, ny, nz = 0.0, 0.0, 0.0
            placed[5, 0], placed[5, 1], placed[5, 2] = nx, ny, nz
            return best
    return s
