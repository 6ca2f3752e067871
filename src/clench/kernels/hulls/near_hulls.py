"""How far the hulls of two links are apart, and along which direction."""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.vectors import Vector
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import compose_inverse
from clench.kernels.toi.toi_work import SweepWork

from .enclosing_hulls import HullArrays, lowest_corner
from .gjk import separating_direction
from .hull_window import CORNERS, END, LAST, NOW, PLANES, SIMPLEX

#: The search for a direction ends if no other one has a gap that is larger by more than this fraction [-].
NEARLY = 0.1


@kernel
def have_hulls(links: BodyArrays, m: int, r: int) -> bool:
    """Say whether two links have hulls around all their parts."""
    body = links.hulls.body
    return bool(body[m] < body[m + 1] and body[r] < body[r + 1])


@kernel
def put_between(one: Floats, other: Floats, sweep: SweepWork) -> None:
    """Write the pose of the first of two links in the frame of the second one, for `parting`."""
    compose_inverse(other, one, sweep.hull[NOW:END])


@kernel
def links_parting(links: BodyArrays, m: int, r: int, n: Vector, sweep: SweepWork) -> tuple[float, Vector, float]:
    """Return how far the hulls of two links are apart, a little less at most, and along which unit vector [m].

    If two hulls overlap, the distance is below 0: they overlap by so much along the vector. The last result is how far
    the other hulls are apart. Where that is less than the overlap, the search ends, and some may be nearer.

    Args:
        m, r: the links; without hulls, the results are -∞. n: where the search begins. sweep: has their poses.
    """
    hulls, least, side, others = links.hulls, math.inf, n, math.inf
    if not have_hulls(links, m, r):
        return -math.inf, n, -math.inf
    put_between(sweep.moving, sweep.resting, sweep)
    for i in range(hulls.body[m], hulls.body[m + 1]):
        for k in range(hulls.body[r], hulls.body[r + 1]):
            gap, found = parting(hulls, (i, k), n, sweep.moving, sweep.resting, sweep)
            others = min(others, max(gap, least))
            if gap < least:
                least, side = gap, found
            if least <= 0.0 and others <= -least:
                return least, side, others
    return least, side, others


@kernel
def parting(
    hulls: HullArrays, both: tuple[int, int], n: Vector, one: Floats, other: Floats, sweep: SweepWork
) -> tuple[float, Vector]:
    """Return how far two hulls are apart, a little less at most, and along which unit vector [m].

    If they overlap, the result is not positive.

    Args:
        both: the hulls. n: where the search begins. one, other: their poses. sweep: has what `put_between` wrote.
    """
    (i, k), T, found = both, other, sweep.hull[LAST]
    for c in range(3):
        found[c] = n[0] * T[0, c] + n[1] * T[1, c] + n[2] * T[2, c]
    none = sweep.hull[CORNERS:PLANES]
    good = (NEARLY, hulls.radius[i] + hulls.radius[k])
    separating_direction(hulls, i, sweep.hull[NOW:END], hulls, k, none, good, sweep.hull[SIMPLEX:], found)
    x, y, z = found[0], found[1], found[2]
    side = (
        T[0, 0] * x + T[0, 1] * y + T[0, 2] * z,
        T[1, 0] * x + T[1, 1] * y + T[1, 2] * z,
        T[2, 0] * x + T[2, 1] * y + T[2, 2] * z,
    )
    return hulls_gap(hulls, i, one, k, other, side), side


@kernel
def hulls_gap(hulls: HullArrays, i: int, one: Floats, k: int, other: Floats, n: Vector) -> float:
    """Return how far a hull lies beyond another one along a unit vector [m]; `one` and `other` are their poses."""
    x, y, z = n
    low, _ = lowest_corner(
        hulls,
        i,
        one[0, 0] * x + one[1, 0] * y + one[2, 0] * z,
        one[0, 1] * x + one[1, 1] * y + one[2, 1] * z,
        one[0, 2] * x + one[1, 2] * y + one[2, 2] * z,
    )
    top, _ = lowest_corner(
        hulls,
        k,
        -(other[0, 0] * x + other[1, 0] * y + other[2, 0] * z),
        -(other[0, 1] * x + other[1, 1] * y + other[2, 1] * z),
        -(other[0, 2] * x + other[1, 2] * y + other[2, 2] * z),
    )
    between = (one[0, 3] - other[0, 3]) * x + (one[1, 3] - other[1, 3]) * y + (one[2, 3] - other[2, 3]) * z
    return float(low + top + between - hulls.radius[i] - hulls.radius[k])
