"""A grid of distances from a body, which is filled where sweeps come by (docs/method.md section 5)."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

#: Cubes along the longest side of the box around the body.
CUBES: Final = 32
#: Cubes beyond every side of that box.
MARGIN: Final = 8


class DistanceGrid(NamedTuple):
    """Squared distances from a body at the corners of cubes, at most 49 of them along each axis: 0.5 MB.

    What a corner holds depends on nothing but the body and the corner. So threads may fill the same grid at once.

    Args:
        square: rounded down [m²]; below 0 where no sweep came by yet, (X, Y, Z); empty: no grid.
        place: the first corner, and the edge of the cubes [m], (4,).
    """

    square: NDArray[np.float32]
    place: NDArray[np.float64]


def no_grid() -> DistanceGrid:
    """Return the grid of bodies that have none."""
    return DistanceGrid(np.empty((0, 0, 0), np.float32), np.zeros(4))


def grid_around(box: NDArray[np.float64]) -> DistanceGrid:
    """Return an empty grid around one body.

    Args:
        box: middle and half size of the box around the body [m], (6,).
    """
    middle, half = box[:3], box[3:]
    edge = 2.0 * float(half.max()) / CUBES
    if not (edge > 0.0 and np.isfinite(box).all()):
        return no_grid()
    corners = np.ceil(2.0 * half / edge).astype(np.int64) + 2 * MARGIN + 1
    first = middle - 0.5 * edge * (corners - 1)
    return DistanceGrid(np.full(tuple(corners), -1.0, np.float32), np.array([*first, edge]))
