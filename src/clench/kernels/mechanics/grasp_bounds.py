"""How well many grasps resist wrenches: a lower bound of epsilon for each, without Python between them."""

from __future__ import annotations

import numpy as np

from clench.kernels.closing.layout import Floats, Ints
from clench.kernels.runtime.compiling import entry_kernel, kernel

from .wrench_bound import resisted_ball

#: Directions of the edges, and of the faces, of a friction polyhedron.
Directions = tuple[Floats, Floats]


@entry_kernel(allocates=True)
def bound_grasps(
    first: Ints,
    position: Floats,
    inward: Floats,
    friction: Floats,
    torsion: float,
    center: Floats,
    length: float,
    directions: Directions,
    rounds: int,
    out: Floats,
) -> None:
    """Write lower bounds of epsilon (L1) of N grasps, 0 where none was found.

    Args:
        first: contacts `first[n]` up to `first[n + 1]` are those of grasp n, (N + 1,).
        position: [m], inward: unit normals into the object, friction: [-]; of all contacts, (C, 3), (C, 3), (C,).
        torsion: torsional coefficient of soft fingers [m]; 0: point contacts with friction.
        center: of mass, in the frame of the contacts [m], (N, 3). length: length scale of wrenches [m].
        directions: unit directions of the edges and of the faces of the friction polyhedra, (E, 2).
        rounds: of reweighting, see `resisted_ball`. out: [N per N of normal force], (N,).
    """
    soft = 1 if torsion > 0.0 else 0
    edges, width = len(directions[0]), 3 + soft
    for n in range(len(out)):
        out[n] = 0.0
        begin, count = first[n], first[n + 1] - first[n]
        if count < 2:
            continue
        G = np.zeros((6, width * count))
        generators = np.zeros((count, edges + 2 * soft, width))
        faces = np.zeros((count, edges * (1 + soft), width))
        reach, caps = np.ones((count, width)), np.zeros((1, width * count))
        for i in range(count):
            _put_columns(G, width, i, position[begin + i], inward[begin + i], center[n], length)
            _put_cone(generators[i], faces[i], reach[i], friction[begin + i], torsion, directions)
            caps[0, width * i + 2] = 1.0
        out[n] = resisted_ball(G, generators, faces, reach, caps, np.ones(1), rounds)


@kernel
def _put_cone(
    generators: Floats, faces: Floats, reach: Floats, mu: float, torsion: float, directions: Directions
) -> None:
    """Write the edges and the inward face normals of a friction polyhedron, and its semi-axes."""
    around, between = directions
    edges = len(around)
    lean = np.cos(np.pi / edges)
    reach[0] = reach[1] = mu
    for e in range(edges):
        generators[e, 0], generators[e, 1], generators[e, 2] = mu * around[e, 0], mu * around[e, 1], 1.0
    for e in range(len(faces)):
        for k in range(2):
            faces[e, k] = -between[e % edges, k] / (mu * lean)
        faces[e, 2] = 1.0
    if torsion > 0.0:
        reach[3] = torsion
        for k in range(2):
            generators[edges + k, 2], generators[edges + k, 3] = 1.0, torsion * (1.0 - 2.0 * k)
        for e in range(edges):
            faces[e, 3], faces[edges + e, 3] = 1.0 / torsion, -1.0 / torsion


@kernel
def _put_columns(G: Floats, width: int, i: int, p: Floats, n: Floats, center: Floats, length: float) -> None:
    """Write the columns of the grasp map of a contact: two tangents and the inward normal, right-handed.

    With a width of 4, the fourth one is a torque about the normal.
    """
    far = 0
    for k in range(1, 3):
        if abs(n[k]) < abs(n[far]):
            far = k
    # The first tangent is the cross product of the axis farthest from the normal with the normal.
    a, b = (far + 1) % 3, (far + 2) % 3
    size = np.sqrt(n[a] * n[a] + n[b] * n[b])
    column = width * i
    G[far, column], G[a, column], G[b, column] = 0.0, -n[b] / size, n[a] / size
    for r in range(3):
        G[r, column + 2] = n[r]
    G[0, column + 1] = n[1] * G[2, column] - n[2] * G[1, column]
    G[1, column + 1] = n[2] * G[0, column] - n[0] * G[2, column]
    G[2, column + 1] = n[0] * G[1, column] - n[1] * G[0, column]
    x, y, z = (p[0] - center[0]) / length, (p[1] - center[1]) / length, (p[2] - center[2]) / length
    for k in range(column, column + 3):
        G[3, k] = y * G[2, k] - z * G[1, k]
        G[4, k] = z * G[0, k] - x * G[2, k]
        G[5, k] = x * G[1, k] - y * G[0, k]
    if width == 4:
        for r in range(3):
            G[3 + r, column + 3] = n[r] / length
