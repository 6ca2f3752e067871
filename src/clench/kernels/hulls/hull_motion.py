"""How a hull that joints move gets on, and how low it may come over a plane meanwhile (docs/method.md section 5)."""

from __future__ import annotations

import math
from typing import NamedTuple

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.vectors import Vector
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import copy_pose
from clench.kernels.toi.core_motion import base_motion
from clench.kernels.toi.spatial_motion import is_spatial, move_pose, point_bounds
from clench.kernels.toi.toi_work import SweepWork

from .enclosing_hulls import HullArrays, lowest_corner


class HullMotion(NamedTuple):
    """The bounds on how the points of one hull move; the joints' rates are per unit of travel.

    Args:
        hull: number of the hull. radius: of the hull [m].
        speed: no point is faster [m]. bend: no point has a larger acceleration [m].
        x, y, z: in the resting body's frame, the axis along which nothing moves; zero without one.
    """

    hull: int
    radius: float
    speed: float
    bend: float
    x: float
    y: float
    z: float


@kernel
def motion_of_hull(bodies: BodyArrays, hull: int, chain: Floats, count: int, sweep: SweepWork) -> HullMotion:
    """Return how a hull moves with a chain.

    Args:
        bodies: with the hull. sweep: has `moving`, the pose relative to the last pivot, and `resting`.
    """
    T, box, radius, speed, bend = sweep.moving, bodies.hulls.box[hull], bodies.hulls.radius[hull], 0.0, 0.0
    # No point is farther from an axis than some corner of the box.
    for k in range(8):
        u = box[0, 4] if k & 1 else -box[0, 4]
        v = box[1, 4] if k & 2 else -box[1, 4]
        w = box[2, 4] if k & 4 else -box[2, 4]
        px = box[0, 3] + u * box[0, 0] + v * box[0, 1] + w * box[0, 2]
        py = box[1, 3] + u * box[1, 0] + v * box[1, 1] + w * box[1, 2]
        pz = box[2, 3] + u * box[2, 0] + v * box[2, 1] + w * box[2, 2]
        x = T[0, 0] * px + T[0, 1] * py + T[0, 2] * pz + T[0, 3]
        y = T[1, 0] * px + T[1, 1] * py + T[1, 2] * pz + T[1, 3]
        z = T[2, 0] * px + T[2, 1] * py + T[2, 2] * pz + T[2, 3]
        if is_spatial(chain):
            lever, bound = point_bounds((x, y, z), chain, count)
            speed, bend = max(speed, lever), max(bend, bound)
        else:
            bend = max(bend, x * x + z * z)
    if is_spatial(chain):
        return HullMotion(hull, radius, speed, bend, 0.0, 0.0, 0.0)
    rate, arm = abs(chain[count - 1, 0]), math.sqrt(bend)
    _, _, _, _, lever, bound = base_motion(chain, count, 1.0, 0.0, 0.0)
    R = sweep.resting
    return HullMotion(hull, radius, lever + rate * arm, bound + rate * rate * arm, R[1, 0], R[1, 1], R[1, 2])


@kernel
def bend_along(motion: HullMotion, n: Vector) -> float:
    """Return a bound on the acceleration of a hull's points along a unit vector."""
    along = motion.x * n[0] + motion.y * n[1] + motion.z * n[2]
    return motion.bend * math.sqrt(max(1.0 - along * along, 0.0))


@kernel
def put_pose(chain: Floats, count: int, s: float, sweep: SweepWork, out: Floats) -> None:
    """Write the pose of the moving body in the resting one's frame when the chain has moved by `s`, (3, 4)."""
    copy_pose(sweep.moving, out)
    if is_spatial(chain):
        move_pose(chain, count, s, out)
    else:
        px, pz, _, _, _, _ = base_motion(chain, count, 0.0, 0.0, s)
        turn = chain[count - 1, 0] * s
        co, si = math.cos(turn), math.sin(turn)
        for c in range(4):
            x, z = out[0, c], out[2, c]
            out[0, c], out[2, c] = co * x - si * z, si * x + co * z
        out[0, 3], out[2, 3] = out[0, 3] + px, out[2, 3] + pz
    for c in range(4):
        put_back(sweep.resting, out[0, c], out[1, c], out[2, c], c, out)


@kernel
def put_back(T: Floats, x: float, y: float, z: float, column: int, out: Floats) -> None:
    """Write a column of a pose in the frame of another one; the last column is a point."""
    if column == 3:
        x, y, z = x - T[0, 3], y - T[1, 3], z - T[2, 3]
    for r in range(3):
        out[r, column] = T[0, r] * x + T[1, r] * y + T[2, r] * z


@kernel
def height(hulls: HullArrays, motion: HullMotion, T: Floats, n: Vector) -> float:
    """Return the smallest coordinate of a hull along a unit vector, where a pose puts it [m]."""
    x = T[0, 0] * n[0] + T[1, 0] * n[1] + T[2, 0] * n[2]
    y = T[0, 1] * n[0] + T[1, 1] * n[1] + T[2, 1] * n[2]
    z = T[0, 2] * n[0] + T[1, 2] * n[1] + T[2, 2] * n[2]
    low, _ = lowest_corner(hulls, motion.hull, x, y, z)
    return float(low + n[0] * T[0, 3] + n[1] * T[1, 3] + n[2] * T[2, 3] - motion.radius)


@kernel
def lowest_between(start: float, end: float, sag: float) -> float:
    """Return the least height of points whose heights are at least `start`, then `end`, and bend by little between.

    A point's height at a share u of the way is above its chord less `4 u (1 - u) sag`.

    Args:
        sag: an eighth of the largest acceleration times the square of the time [m].
    """
    low, drop = min(start, end), abs(start - end)
    if sag > 0.0 and drop < 4.0 * sag:
        low -= (4.0 * sag - drop) ** 2 / (16.0 * sag)
    return low
