"""In which order links of a hand that moves along a line may touch an object (docs/method.md section 9).

A ball around each link tells: it can move as far as its distance from the object, by the object's grid.
"""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.link_meshes import LinkMeshArrays
from clench.kernels.grid.grid_bound import AWAY, square_bound
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import put_point
from clench.kernels.trees.bvh import Ints as Stack

#: A ball that is nearer than this share of a cube's edge is not followed any more [-].
CLOSE = 0.3
#: Columns of a ball: its middle, its radius, and a travel up to which it does not touch.
RADIUS, UNTIL, COLUMNS = 3, 4, 5


@kernel
def follow_links(meshes: LinkMeshArrays, T: Floats, along: Floats, whole: Floats, balls: Floats) -> None:
    """Begin to follow all links.

    Args:
        meshes: of the links. T: their poses where the motion begins, (M, 3, 4). along: the direction, (3,).
        whole: centre and radius of a ball around the object [m], (4,). balls: written, (M, COLUMNS).
    """
    for k in range(meshes.link.shape[0]):
        put_point(T[k], meshes.center[k], balls[k])
        balls[k, RADIUS] = meshes.radius[k]
        balls[k, UNTIL] = way_to_ball(balls[k], whole, along)


@kernel
def way_to_ball(ball: Floats, other: Floats, along: Floats) -> float:
    """Return how far a ball moves until it touches another one, infinite if it does not.

    Args:
        ball, other: centre and radius [m]. along: the direction, (3,).
    """
    ahead, square, reach = 0.0, 0.0, ball[3] + other[3]
    for c in range(3):
        ahead += along[c] * (other[c] - ball[c])
        square += (other[c] - ball[c]) ** 2
    if square <= reach * reach:
        return 0.0
    inside = reach * reach - (square - ahead * ahead)
    return ahead - math.sqrt(inside) if ahead > 0.0 and inside > 0.0 else math.inf


@kernel
def next_link(body: BodyArrays, along: Floats, best: float, balls: Floats, stack: Stack) -> tuple[int, float]:
    """Return the link that may touch the object next, and a travel before which it does not; follow it no more.

    The link is -1 if none may touch it before `best`.

    Args:
        body: the object as one body. along: the direction, (3,). balls: see `follow_links`.
        stack: scratch space, (PAIRS, 3).
    """
    while True:
        k, start = -1, best
        for i in range(balls.shape[0]):
            if balls[i, UNTIL] < start:
                k, start = i, float(balls[i, UNTIL])
        if k < 0:
            return -1, best
        if not moves_on(body, along, balls[k], stack):
            balls[k, UNTIL] = math.inf
            return k, start


@kernel
def moves_on(body: BodyArrays, along: Floats, ball: Floats, stack: Stack) -> bool:
    """Move a ball on as far as it does not touch an object; say whether that is far enough to follow it."""
    if body.grid.square.shape[0] == 0:
        return False
    s, edge = ball[UNTIL], body.grid.place[3]
    p = ball[0] + s * along[0], ball[1] + s * along[1], ball[2] + s * along[2]
    square = square_bound(body, p, stack)
    # Polyhedra of the same round shape differ.
    gap = (math.sqrt(square) if square > 0.0 else 0.0) - ball[RADIUS] - AWAY * edge
    if gap <= CLOSE * edge:
        return False
    ball[UNTIL] = s + gap
    return True
