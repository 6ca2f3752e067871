"""How far two links go on that are near each other: their nearest elements, and planes between their parts."""

from __future__ import annotations

import math
from typing import NamedTuple

from clench.kernels.closing.layout import Floats, Ints
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.core_distance import separation
from clench.kernels.geometry.vectors import Vector
from clench.kernels.hulls.near_hulls import have_hulls, hulls_gap, parting, put_between
from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.core_motion import plane_gap
from clench.kernels.toi.sides import Sides, gap_over, sides_of
from clench.kernels.toi.toi_work import (
    SweepWork,
    ball_gap,
    is_wider,
    push_roots,
    put_core,
    put_nearest_last,
    split_pair,
)

from .finger_motion import approach_along, even_until, links_of, place_links_at, speeds_of
from .meeting_layout import LinkPair

#: Gap at which links meet [m].
TOUCH = 1e-11
#: How many lengths of a step are tried with one plane.
LENGTHS = 6
#: Parts count on a step that are nearer than so many times the gap of their links [-].
AROUND = 8.0
#: A direction along which links approach each other by less than this share of their speed counts as that [-].
FLAT = 1e-2
#: A step leads so far of the way to where a gap closes [-].
CLOSING = 0.999


class StepPlane(NamedTuple):
    """A plane between two links on a step.

    Args:
        now, ahead: its normal where the step begins, and where it ends. bend: see `lowest_on`.
    """

    now: Sides
    ahead: Sides
    bend: float


@kernel
def are_apart(links: BodyArrays, a: int, b: int, gap: float, along: float, sides: Sides, sweep: SweepWork) -> bool:
    """Say whether two items are that far apart, as balls tell, or so far along a vector."""
    return bool(ball_gap(links, a, links, b, sweep) >= gap or gap_over(links, a, links, b, sides) >= along)


@kernel
def elements_gap(links: BodyArrays, i: int, k: int, sweep: SweepWork) -> tuple[float, Vector, Vector]:
    """Return the gap of two elements, the direction to the first and the closest point of the second."""
    put_core(links, i, sweep.moving, sweep.core)
    put_core(links, k, sweep.resting, sweep.fixed)
    d, nx, ny, nz, _, _, x, y, z = separation(sweep.core, links.corners[i], sweep.fixed, links.corners[k])
    w = links.radius[k]
    return d - w - links.radius[i], (nx, ny, nz), (x + w * nx, y + w * ny, z + w * nz)


@kernel
def links_gap(links: BodyArrays, m: int, r: int, bound: float, n: Vector, near: Ints, sweep: SweepWork) -> float:
    """Return the gap of two links below a bound, else the bound; their poses are in `sweep`.

    Args:
        n: a direction along which most of their parts lie apart.
        near: two elements that are near each other, or -1; those that are nearest are written.
    """
    stack, best = sweep.stack, bound
    if near[0] >= 0:
        gap, there, _ = elements_gap(links, near[0], near[1], sweep)
        if gap < best:
            best, n = gap, there
    sides = sides_of(n, sweep.moving, sweep.resting)
    last = sides
    waiting = push_roots(links, m, links, r, stack)
    while waiting > 0:
        waiting -= 1
        a, b = stack[waiting, 0], stack[waiting, 1]
        if are_apart(links, a, b, best, best, sides, sweep) or gap_over(links, a, links, b, last) >= best:
            continue
        if a < 0 and b < 0:
            gap, n, _ = elements_gap(links, -1 - a, -1 - b, sweep)
            last = sides_of(n, sweep.moving, sweep.resting)
            if gap < best:
                best, sides, near[0], near[1] = gap, last, -1 - a, -1 - b
            continue
        height = split_pair(links, a, links, b, is_wider(links, a, links, b), stack, waiting)
        put_nearest_last(links, links, stack, waiting, height, sweep)
        waiting = height
    return best


@kernel
def lowest_on(step: float, margin: float, left: float, bend: float) -> float:
    """Return a lower bound of the gap between two parts along a direction, anywhere on a step.

    Args:
        margin, left: how far they are where it begins and ends. bend: how fast the rate may change at which that
            changes. The lowest curve through both ends is a parabola.
    """
    if bend <= 0.0:
        return min(margin, left)
    low = 0.5 * step - (left - margin) / (bend * step)
    if low <= 0.0 or low >= step:
        return min(margin, left)
    return margin - 0.5 * bend * low * low


@kernel
def shorter_step(step: float, margin: float, left: float, bend: float) -> float:
    """Return a step that may be safe where a longer one is not; see `lowest_on`."""
    slope = max((margin - left) / step, 0.0)
    shorter = 2.0 * margin / (slope + math.sqrt(slope * slope + 0.5 * bend * margin))
    return 0.999 * min(shorter, step)


@kernel
def step_by_parts(pair: LinkPair, gap: float, n: Vector, near: Ints, at: float, end: float) -> float:
    """Return how far two links advance from a place of the motion, kept apart by planes between their parts.

    The parts are their hulls; where these overlap, or a link has none, they are its elements. Parts that are farther
    apart than links approach each other on the step do not count.

    Args:
        pair: the links. gap: of the links [m].
        n, near: unit vector between their nearest elements, and these. at: the place. end: of their motion.
    """
    until, speed = even_until(pair, at, end), speeds_of(pair, at)
    _, across, _ = approach_along(pair, n, at, until)
    least = gap / speed
    step = min(until - at, AROUND * gap / max(across, FLAT * speed))
    if step <= least:
        return least
    put_ahead(pair, at + step)
    found = step_by_hulls(pair, n, at, until, step, across)
    if found < 0.0:
        put_ahead(pair, at + step)
        sides = sides_of(n, pair.sweep.moving, pair.sweep.resting)
        found = step_by_elements(pair, near, at, until, step, across / speed, sides)
    return max(found, least)


@kernel
def step_by_elements(
    pair: LinkPair, near: Ints, at: float, until: float, step: float, share: float, sides: Sides
) -> float:
    """Return how far of a step planes between the elements of two links keep these apart; see `step_by_parts`.

    The plane between two elements keeps most of their neighbours apart as well.

    Args:
        sides: the direction between the links. share: how fast they approach each other along it, as a share of their
            speed [-].
    """
    links, sweep, stack = pair.full_width.links, pair.sweep, pair.sweep.stack
    speed = speeds_of(pair, at)
    # The nearest elements tell most.
    step, n = step_of_elements(pair, near[0], near[1], at, until, step)
    plane = plane_across(pair, n, at, until)
    m, r = pair.rows
    waiting = push_roots(links, pair.fingers.link[m], links, pair.fingers.link[r], stack)
    while waiting > 0:
        waiting -= 1
        a, b = stack[waiting, 0], stack[waiting, 1]
        if are_apart(links, a, b, speed * step, share * speed * step, sides, sweep):
            continue
        if stay_apart(links, a, b, plane, step):
            continue
        if a < 0 and b < 0:
            step, n = step_of_elements(pair, -1 - a, -1 - b, at, until, step)
            plane = plane_across(pair, n, at, until)
            continue
        height = split_pair(links, a, links, b, is_wider(links, a, links, b), stack, waiting)
        put_nearest_last(links, links, stack, waiting, height, sweep)
        waiting = height
    return step


@kernel
def plane_across(pair: LinkPair, n: Vector, at: float, until: float) -> StepPlane:
    """Return the plane across a unit vector on a step, to which `workspace.ahead` belongs."""
    sweep, ahead = pair.sweep, pair.workspace.ahead
    bend = approach_along(pair, n, at, until)[2]
    return StepPlane(sides_of(n, sweep.moving, sweep.resting), sides_of(n, ahead[0], ahead[1]), bend)


@kernel
def stay_apart(links: BodyArrays, a: int, b: int, plane: StepPlane, step: float) -> bool:
    """Say whether a plane keeps two items apart on a step, to which its `ahead` belongs; see `lowest_on`."""
    margin = gap_over(links, a, links, b, plane.now)
    if margin <= TOUCH:
        return False
    return bool(lowest_on(step, margin, gap_over(links, a, links, b, plane.ahead), plane.bend) > 0.5 * TOUCH)


@kernel
def step_by_hulls(pair: LinkPair, n: Vector, at: float, until: float, step: float, across: float) -> float:
    """Return how far of a step planes between the hulls of two links keep these apart, or -1 where hulls overlap.

    Args:
        across: how fast the links approach each other along `n`; see `step_by_parts`.
    """
    links, sweep = pair.full_width.links, pair.sweep
    m, r = links_of(pair)
    if not have_hulls(links, m, r):
        return -1.0
    put_between(sweep.moving, sweep.resting, sweep)
    for i in range(links.hulls.body[m], links.hulls.body[m + 1]):
        for k in range(links.hulls.body[r], links.hulls.body[r + 1]):
            if hulls_gap(links.hulls, i, sweep.moving, k, sweep.resting, n) >= across * step:
                continue
            margin, side = parting(links.hulls, (i, k), n, sweep.moving, sweep.resting, sweep)
            if margin <= TOUCH:
                return -1.0
            step = step_along(pair, -1 - i, -1 - k, margin, side, at, until, step)
    return step


@kernel
def put_ahead(pair: LinkPair, at: float) -> None:
    """Write the poses of two links at a place of the motion to `workspace.ahead`."""
    ahead = pair.workspace.ahead
    place_links_at(pair, at, ahead[0], ahead[1])


@kernel
def step_of_elements(pair: LinkPair, i: int, k: int, at: float, until: float, step: float) -> tuple[float, Vector]:
    """Return how far of a step, to which `workspace.ahead` belongs, a plane is seen to keep two elements apart.

    Return also the unit vector between them where the step begins.

    Args:
        i, k: the elements. until: up to where every joint turns evenly.
    """
    gap, n, _ = elements_gap(pair.full_width.links, i, k, pair.sweep)
    return step_along(pair, i, k, gap, n, at, until, step), n


@kernel
def step_along(pair: LinkPair, i: int, k: int, gap: float, n: Vector, at: float, until: float, step: float) -> float:
    """Return how far of a step, to which `workspace.ahead` belongs, planes across a direction keep two parts apart.

    Args:
        i, k: two elements, or -1 minus two hulls. gap: how far planes keep them apart now [m].
    """
    _, speed, bend = approach_along(pair, n, at, until)
    level, longest, ahead = min(0.5 * gap, 0.5 * TOUCH), step, pair.workspace.ahead
    if speed * step < gap - level:
        return step
    least = max(gap - level, 0.0) / speed
    for _ in range(LENGTHS):
        if step <= least:
            break
        left = gap_along(pair, (i, k), n, ahead[0], ahead[1])
        if lowest_on(step, gap, left, bend) > level:
            break
        step = max(shorter_step(step, gap - level, left - level, bend), least)
        put_ahead(pair, at + step)
    else:
        step = least
        put_ahead(pair, at + step)
    return step_farther(pair, (i, k), gap, n, at, until, (step, longest))


@kernel
def step_farther(
    pair: LinkPair,
    both: tuple[int, int],
    gap: float,
    n: Vector,
    at: float,
    until: float,
    steps: tuple[float, float],
) -> float:
    """Return how far of a step planes are seen to keep two parts apart that are apart after a shorter step.

    A plane that fits the parts where the step begins loses them where a face turns. So the plane that fits them at the
    end of a longer step is tried. That step leads to where their gap would close if it went on as on the shorter one.

    Args:
        both, gap, n, at, until: see `step_along`.
        steps: the shorter step, to which `workspace.ahead` belongs, and the longest one that is of use.
    """
    step, longest = steps
    ahead, sweep = pair.workspace.ahead, pair.sweep
    if step >= longest:
        return step
    left, n = parts_ahead(pair, both, n)
    longer = longest
    if left < gap:
        longer = min(longest, CLOSING * step * gap / (gap - left))
    if longer <= step:
        return step
    put_ahead(pair, at + longer)
    _, n = parts_ahead(pair, both, n)
    begin, left = gap_along(pair, both, n, sweep.moving, sweep.resting), gap_along(pair, both, n, ahead[0], ahead[1])
    if lowest_on(longer, begin, left, approach_along(pair, n, at, until)[2]) > min(0.5 * left, 0.5 * TOUCH):
        return longer
    put_ahead(pair, at + step)
    return step


@kernel
def parts_ahead(pair: LinkPair, both: tuple[int, int], n: Vector) -> tuple[float, Vector]:
    """Return how far two parts are apart at the poses `workspace.ahead`, and along which unit vector; see `step_along`.

    If they overlap, neither means anything.

    Args:
        n: where a search begins.
    """
    links, ahead, sweep, (i, k) = pair.full_width.links, pair.workspace.ahead, pair.sweep, both
    if i < 0:
        put_between(ahead[0], ahead[1], sweep)
        gap, n = parting(links.hulls, (-1 - i, -1 - k), n, ahead[0], ahead[1], sweep)
        put_between(sweep.moving, sweep.resting, sweep)
        return gap, n
    placed = sweep.placed
    put_core(links, i, ahead[0], placed)
    put_core(links, k, ahead[1], placed[4:])
    d, nx, ny, nz, _, _, _, _, _ = separation(placed, links.corners[i], placed[4:], links.corners[k])
    return d - links.radius[i] - links.radius[k], (nx, ny, nz)


@kernel
def gap_along(pair: LinkPair, both: tuple[int, int], n: Vector, one: Floats, other: Floats) -> float:
    """Return how far two parts are apart along a unit vector at poses of their links; see `step_along`."""
    links, placed, (i, k) = pair.full_width.links, pair.sweep.placed, both
    if i < 0:
        return hulls_gap(links.hulls, -1 - i, one, -1 - k, other, n)
    put_core(links, i, one, placed)
    put_core(links, k, other, placed[4:])
    gap = plane_gap(placed, links.corners[i], placed[4:], links.corners[k], n[0], n[1], n[2])
    return float(gap - links.radius[i] - links.radius[k])
