"""How far a body certainly moves before it may touch an object, by the object's grid alone (section 5).

Balls cover the moving body. Each of them can move as far as its distance from the object lets the fastest way of its
middle. The ball that may touch first is looked at again where it may, until it stops to get on.
"""

from __future__ import annotations

import math

from clench.kernels.hulls.enclosing_hulls import BODY_BALLS
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import back, put_point
from clench.kernels.toi.core_motion import corner_motion, move_core
from clench.kernels.toi.toi_work import BodyPair, SweepWork

from .grid_bound import square_bound

#: A ball stops to get on when its gap is below this share of a cube's edge [-].
NEAR = 0.3
#: Bounds are rounded down to a multiple of 1/64 of the travel: the rounding of the grid's distances depends on where
#: the object is, and seldom changes such a multiple.
PARTS = 64.0
#: Balls are looked at so often at most.
LOOKS = 4 * BODY_BALLS
#: Columns of the scratch space: middle of a ball relative to the last pivot, radius, speed of the middle, and a travel
#: until which the ball does not touch.
RADIUS, SPEED, UNTIL = 3, 4, 5


@kernel
def clear_by_grid(pair: BodyPair, best: float, work: SweepWork) -> float:
    """Return a travel up to which a moving body is farther than `touch` from an object; infinite if until `best`.

    The result is 0 for a body that no balls cover, and for an object without a grid. Surfaces count: whether one body
    lies within the other is not seen. The ball that may touch first is left in `work.near`.

    Args:
        pair, work: see `sweep_body`.
    """
    hulls, m, work.near[5] = pair.moving.hulls, pair.m, -1
    first, last = hulls.cover[hulls.body[m]], hulls.cover[hulls.body[m + 1]]
    if first == last or pair.resting.grid.square.shape[0] == 0:
        return 0.0
    near = NEAR * pair.resting.grid.place[3]
    for k in range(last - first):
        put_moving_ball(pair, first + k, k, work)
        look_at(pair, k, 0.0, work)
    until = 0.0
    for _ in range(LOOKS):
        k = earliest(last - first, work)
        work.near[5] = first + k
        until, speed = float(work.balls[k, UNTIL]), work.balls[k, SPEED]
        if until > best:
            return math.inf
        # A look at the bodies where they are has nowhere to go on to.
        if until == 0.0 and best == 0.0:
            return 0.0
        look_at(pair, k, until, work)
        if (work.balls[k, UNTIL] - until) * speed <= near:
            break
    return math.floor(PARTS * until) / PARTS


@kernel
def put_moving_ball(pair: BodyPair, ball: int, k: int, work: SweepWork) -> None:
    """Write a ball of the moving body, and how fast its middle is at most."""
    balls, of_body = work.balls, pair.moving.hulls.ball
    put_point(work.moving, of_body[ball], balls[k])
    balls[k, RADIUS] = of_body[ball, 3]
    _, _, lever, _ = corner_motion(balls, k, pair.chain, pair.rows, 1.0, 0.0, 0.0, 0.0)
    balls[k, SPEED] = lever


@kernel
def look_at(pair: BodyPair, k: int, s: float, work: SweepWork) -> None:
    """Write until when a ball does not touch the object, seen from where it is after a travel."""
    balls, placed, T = work.balls, work.placed, work.resting
    move_core(balls[k:], 1, pair.chain, pair.rows, s, placed)
    x, y, z = back(T, placed[0, 0], placed[0, 1], placed[0, 2])
    square = square_bound(pair.resting, (x, y, z), work.stack)
    gap = (math.sqrt(square) if square > 0.0 else 0.0) - balls[k, RADIUS] - pair.touch
    if gap <= 0.0:
        balls[k, UNTIL] = s
    elif balls[k, SPEED] > 0.0:
        balls[k, UNTIL] = s + gap / balls[k, SPEED]
    else:
        balls[k, UNTIL] = math.inf


@kernel
def earliest(count: int, work: SweepWork) -> int:
    """Return the ball that may touch first."""
    k = 0
    for i in range(1, count):
        if work.balls[i, UNTIL] < work.balls[k, UNTIL]:
            k = i
    return k
