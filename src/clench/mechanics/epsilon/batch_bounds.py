"""Compute lower bounds of epsilon for many grasps in one call (docs/method.md section 6)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from clench.core.pose import FloatArray
from clench.mechanics.grasp.contacts import edge_directions

from .epsilon_quality import EDGES, ROUNDS


def epsilon_bounds(
    first: ArrayLike,
    position: ArrayLike,
    normal: ArrayLike,
    friction: ArrayLike,
    center: ArrayLike,
    length: float,
    torsion: float | None = None,
    edges: int = EDGES,
) -> FloatArray:
    """Return the bound of `epsilon_bound` (L1) for N grasps, shape (N,) [N/N].

    Args:
        first: grasp n has the contacts `first[n]` up to `first[n + 1]`, shape (N + 1,).
        position: [m], shape (C, 3). normal: unit, out of the object, as in `clench.BatchContacts`, shape (C, 3).
        friction: of each contact, or one number for all [-]. center: of mass of each grasp, or of all [m].
        length: length scale of wrenches [m]. torsion: torsional coefficient of soft fingers [m]; None: point contacts.
        edges: of the friction polyhedra.
    """
    from clench.kernels.mechanics.grasp_bounds import bound_grasps

    begin = np.ascontiguousarray(first, dtype=np.int64)
    places = np.ascontiguousarray(position, dtype=np.float64).reshape(-1, 3)
    inward = -np.asarray(normal, dtype=np.float64).reshape(-1, 3)
    mu = np.broadcast_to(np.asarray(friction, dtype=np.float64), len(places)).copy()
    middle = np.broadcast_to(np.asarray(center, dtype=np.float64), (len(begin) - 1, 3)).copy()
    out = np.empty(len(begin) - 1)
    around, between = (np.ascontiguousarray(edge_directions(edges, turned)) for turned in (0.0, 0.5))
    bound_grasps(
        begin,
        places,
        np.ascontiguousarray(inward),
        mu,
        0.0 if torsion is None else float(torsion),
        middle,
        float(length),
        (around, between),
        ROUNDS,
        out,
    )
    return out
