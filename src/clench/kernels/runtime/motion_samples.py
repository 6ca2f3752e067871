"""The kernels of forces and motions that a command calls after a solve, and arguments of the right types for them."""

from __future__ import annotations

from typing import Any

import numpy as np

from clench.kernels.mechanics.least_cost import least_cost
from clench.kernels.mechanics.weak_direction import nearer_facets
from clench.kernels.toi.pair_motion import PathProblem
from clench.kernels.toi.path_overlap import first_overlap

#: What `warming` compiles for motions, the longest first.
MOTIONS: tuple[Any, ...] = (first_overlap, nearer_facets, least_cost)


def motion_values(values: dict[str, Any]) -> dict[str, Any]:
    """Return a value for every parameter of these kernels, by name; arrays are empty.

    Args:
        values: those of the kernels of a solve.
    """
    row, table, numbers = np.empty(0), np.empty((0, 0)), np.empty(0, dtype=np.int64)
    pairs, body = np.empty((0, 0), dtype=np.int64), values["links"]
    problem = PathProblem(
        *(values["frames"], body, values["meshes"], numbers, pairs, table, pairs, row),
        *(body, values["solid"], table, table),
    )
    named = {"problem": problem, "out": row, "points": table, "starts": table, "found": table}
    return {**named, "reach": row, "rows": table, "most": row, "cost": row, "x": row}
