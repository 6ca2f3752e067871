"""How the corners of a moving capsule or sphere come near to planes in a window of travel (docs/method.md section 5).

The core is a segment or a point. In the scratch space `round` of a sweep, vectors are in the frame of the resting body.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.vectors import Vector
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import back
from clench.kernels.toi.core_motion import base_motion, corner_motion, move_core
from clench.kernels.toi.spatial_motion import is_spatial, point_motion
from clench.kernels.toi.toi_work import BodyPair, SweepWork

#: Rows of the scratch space: corners where a window begins; their ways from the axis, for one joint; their velocities,
#: for one joint per turn. Corners where the window ends, relative to the first pivot. The plane that kept an item off
#: last. Length of the window, sine, and one less cosine, of its turn. Bounds on the accelerations.
AT, ARM, SPEED, END, PLANE, LENGTH, BEND = 0, 2, 4, 6, 8, 9, 10
ROWS: Final = 11
#: Windows turn by at most this [rad].
HALF_TURN: Final = 3.0


class RoundMotion(NamedTuple):
    """A moving core: number of corners, radius, largest speed of a corner [m per travel]; whether one joint moves it.

    `turn`: how far it turns per travel, for one joint [rad].
    """

    corners: int
    radius: float
    fastest: float
    single: bool
    turn: float


@kernel
def motion_of_core(pair: BodyPair, corners: int, radius: float, work: SweepWork) -> RoundMotion:
    """Return how the core in `work` moves, and write bounds on its accelerations."""
    chain, rows, fastest = pair.chain, pair.rows, 0.0
    for k in range(corners):
        _, _, lever, bend = corner_motion(work.core, k, chain, rows, 1.0, 0.0, 0.0, 0.0)
        fastest, work.round[BEND, k] = max(fastest, lever), bend
    single = rows == 1 and not is_spatial(chain)
    return RoundMotion(corners, radius, fastest, single, abs(chain[0, 0]) if single else 0.0)


@kernel
def put_corners(pair: BodyPair, motion: RoundMotion, s: float, work: SweepWork) -> None:
    """Write where the corners are when the chain has moved by `s`."""
    placed, rows = work.placed, work.round
    move_core(work.core, motion.corners, pair.chain, pair.rows, s, placed)
    for k in range(motion.corners):
        rows[AT + k, 0], rows[AT + k, 1], rows[AT + k, 2] = back(work.resting, placed[k, 0], placed[k, 1], placed[k, 2])


@kernel
def begin_window(pair: BodyPair, motion: RoundMotion, s: float, end: float, work: SweepWork) -> None:
    """Write how the corners move from `s` on, where `put_corners` has put them, until `end`."""
    chain, count, placed, rows = pair.chain, pair.rows, work.placed, work.round
    for k in range(motion.corners):
        x, z = placed[k, 0], placed[k, 2]
        v = (0.0, 0.0, 0.0)
        if motion.single:
            sense = 1.0 if chain[0, 0] > 0.0 else -1.0
            v = (-sense * z, 0.0, sense * x)
            put_vector((x, 0.0, z), ARM + k, work)
        elif is_spatial(chain):
            v, _ = point_motion((work.core[k, 0], work.core[k, 1], work.core[k, 2]), chain, count, s)
        else:
            rate = chain[count - 1, 0]
            px, pz, along, _, _, _ = base_motion(chain, count, 1.0, 0.0, s)
            _, _, up, _, _, _ = base_motion(chain, count, 0.0, 1.0, s)
            v = (along - rate * (z - pz), 0.0, up + rate * (x - px))
        put_vector(v, SPEED + k, work)
    put_length(motion, end - s, work)
    move_core(work.core, motion.corners, chain, count, end, rows[END:])


@kernel
def put_length(motion: RoundMotion, length: float, work: SweepWork) -> None:
    """Write how long a window is."""
    rows, turn = work.round, motion.turn * length
    rows[LENGTH, 0], rows[LENGTH, 1], rows[LENGTH, 2] = length, math.sin(turn), 1.0 - math.cos(turn)


@kernel
def put_vector(v: Vector, row: int, work: SweepWork) -> None:
    """Write a vector, turned into the resting body's frame."""
    T = work.resting
    for c in range(3):
        work.round[row, c] = T[0, c] * v[0] + T[1, c] * v[1] + T[2, c] * v[2]


@kernel
def along(rows: Floats, row: int, n: Vector) -> float:
    """Return the part of a vector of the scratch space along another one."""
    part: float = rows[row, 0] * n[0] + rows[row, 1] * n[1] + rows[row, 2] * n[2]
    return part


@kernel
def stays_over(motion: RoundMotion, rows: Floats, n: Vector, top: float) -> bool:
    """Say whether all corners stay beyond the plane `n·p = top` in the whole window.

    For one joint, a corner's height is `g + b sin t - a (1 - cos t)`, with its least value in between or at an end; for
    others it is at least `g + b s - M s² / 2`, which has it at an end.
    """
    length, sine, less = rows[LENGTH, 0], rows[LENGTH, 1], rows[LENGTH, 2]
    for k in range(motion.corners):
        g = along(rows, AT + k, n) - top
        if g <= 0.0:
            return False
        b = along(rows, SPEED + k, n)
        if motion.single:
            a = along(rows, ARM + k, n)
            if g + b * sine - a * less <= 0.0:
                return False
            if b < 0.0 and b * (1.0 - less) - a * sine > 0.0 and (g <= a or g * (g - 2.0 * a) <= b * b):
                return False
        elif g + b * length <= 0.5 * rows[BEND, k] * length * length:
            return False
    return True
