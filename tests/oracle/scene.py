"""The planar data contract: a finger and a curve in one curl plane, and both packed into flat arrays.

Coordinates are ``(x, z)`` in the plane [m]; angles are counter-clockwise positive [rad].
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .compiled import Floats, Ints


@dataclass(frozen=True, eq=False)
class PlanarOutline:
    """A rounded outline: the points within ``radius`` of a core.

    ``vertices`` (n, 2): relative to the pivot of ``joint``, at the open posture. ``sides`` (m, 2): pairs of vertex
    indices, counter-clockwise, so the outward normal is to the right of the direction. One vertex and no side is a
    disk, two vertices with two opposite sides a capsule; with three or more the core is the polygon, convex or not.
    """

    joint: int
    vertices: Floats
    sides: Ints
    radius: float


@dataclass(frozen=True, eq=False)
class PlanarFinger:
    """A planar chain that closes in stages, one per degree of freedom, degrees of freedom ordered by their most
    proximal joint (the leader).

    ``pivots`` (J, 2): offset of a joint's pivot from the one before at the open posture, the first from the origin.
    ``rates`` (J,): turning of a joint per unit of its degree of freedom's parameter. ``degree of freedom`` (J,): index
    of its degree of freedom. ``limits`` (J,): largest travel ``|angle|`` from open; a follower stays at its limit while
    the leader goes on.
    """

    pivots: Floats
    rates: Floats
    dof: Ints
    limits: Floats
    outlines: tuple[PlanarOutline, ...]

    @cached_property
    def length(self) -> float:
        """Return the farthest that any outline can be from the first pivot [m]."""
        body = self.packed
        return float(np.max(body.reach[:, 0] + body.radius))

    @property
    def tolerance(self) -> float:
        """Return the gap [m] that counts as touching: 1e-9 m for a finger of 0.1 m, in proportion for others."""
        return 1e-8 * self.length

    @property
    def dofs(self) -> int:
        """Return the number of degrees of freedom, which is the number of stages."""
        return int(self.dof.max()) + 1

    def leader(self, dof: int) -> int:
        """Return the most proximal joint of a degree of freedom."""
        return int(np.flatnonzero(self.dof == dof)[0])

    def travel(self, dof: int) -> float:
        """Return the parameter at which the degree of freedom's leader reaches its limit."""
        leader = self.leader(dof)
        return float(self.limits[leader] / abs(self.rates[leader]))

    def angles(self, parameters: Floats) -> Floats:
        """Return the joint angles (J,) for degree of freedom parameters (G,), followers held at their limits."""
        free = self.rates * parameters[self.dof]
        return np.clip(free, -self.limits, self.limits)

    @cached_property
    def packed(self) -> "Body":
        """Return the flat arrays that the compiled functions read."""
        return _pack_finger(self)


@dataclass(frozen=True, eq=False)
class PlanarCurve:
    """The section of an object: closed ``loops`` (counter-clockwise, clockwise round holes), open ``lines``, ``disks``.

    ``loops`` and ``lines``: arrays (n, 2) of points. ``disks`` (k, 3): centre and radius, solid. ``two_sided``: loops
    have no inside (a mesh that is open or wound badly): either side of a segment stops a link, normals mean nothing.
    """

    loops: tuple[Floats, ...] = ()
    lines: tuple[Floats, ...] = ()
    disks: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    two_sided: bool = False

    @cached_property
    def segments(self) -> Floats:
        """Return the segments (m, 2, 2): start and end."""
        closed = [np.stack([loop, np.roll(loop, -1, axis=0)], axis=1) for loop in self.loops]
        opened = [np.stack([line[:-1], line[1:]], axis=1) for line in self.lines]
        return np.concatenate([*closed, *opened, np.zeros((0, 2, 2))])

    @cached_property
    def normals(self) -> Floats:
        """Return the outward unit normals (m, 2); a segment of no length has the normal of the one before it."""
        run = self.segments[:, 1] - self.segments[:, 0]
        length = np.linalg.norm(run, axis=1)
        normals = np.zeros_like(run)
        for i in range(len(run)):
            normals[i] = (run[i, 1], -run[i, 0]) / length[i] if length[i] > 0 else normals[i - 1]
        return normals

    @cached_property
    def packed(self) -> "Edges":
        """Return the flat arrays that the compiled functions read."""
        ends = self.segments
        run = ends[:, 1] - ends[:, 0]
        square = np.einsum("ij,ij->i", run, run)
        inverse = np.divide(1.0, square, out=np.zeros_like(square), where=square > 0)
        points = np.concatenate([*self.loops, *self.lines, np.zeros((0, 2))])
        table = np.column_stack([ends[:, 0], run, inverse]).astype(np.float64)
        return Edges(
            np.ascontiguousarray(table), np.ascontiguousarray(points), self.disks.astype(np.float64), not self.two_sided
        )

    def moved(self, shift: Floats) -> "PlanarCurve":
        """Return the curve translated by ``shift`` (2,)."""
        disks = self.disks + np.array([shift[0], shift[1], 0.0])
        return PlanarCurve(
            tuple(p + shift for p in self.loops), tuple(p + shift for p in self.lines), disks, self.two_sided
        )


class Edges(NamedTuple):
    """A curve, packed: segments as start, run, inverse squared length; all points; disks; whether loops are solid."""

    segments: Floats
    points: Floats
    disks: Floats
    solid: bool


class Body(NamedTuple):
    """A finger, packed: rows of outline ``o`` are ``start[o]:start[o+1]``; a bare vertex has one edge of no length."""

    pivots: Floats
    vertices: Floats
    vertex_start: Ints
    edges: Ints
    edge_start: Ints
    sides: Ints
    side_start: Ints
    radius: Floats
    joint: Ints
    reach: Floats


def _undirected(outline: PlanarOutline) -> list[tuple[int, int]]:
    """Return each side once whatever its direction, and each vertex without a side as an edge of no length."""
    pairs = {(min(a, b), max(a, b)) for a, b in outline.sides.tolist()}
    used = {i for pair in pairs for i in pair}
    return sorted(pairs | {(i, i) for i in range(len(outline.vertices)) if i not in used})


def _rows(parts: list[list[tuple[int, int]]], offsets: list[int]) -> tuple[Ints, Ints]:
    """Return all pairs, shifted to the joined vertex list, and where each part starts."""
    joined = [(a + offset, b + offset) for part, offset in zip(parts, offsets, strict=False) for a, b in part]
    return np.array(joined, dtype=np.int64).reshape(-1, 2), np.cumsum([0, *map(len, parts)])


def _pack_finger(finger: PlanarFinger) -> Body:
    outlines = finger.outlines
    offsets = [0]
    reach = np.zeros((len(outlines), len(finger.pivots)))
    steps = np.hypot(finger.pivots[:, 0], finger.pivots[:, 1])
    for o, outline in enumerate(outlines):
        offsets.append(offsets[-1] + len(outline.vertices))
        arm = float(np.hypot(outline.vertices[:, 0], outline.vertices[:, 1]).max())
        for j in range(outline.joint, -1, -1):
            reach[o, j] = arm
            arm += steps[j]
    edges, edge_start = _rows([_undirected(o) for o in outlines], offsets)
    sides, side_start = _rows([[(a, b) for a, b in o.sides.tolist()] for o in outlines], offsets)
    return Body(
        pivots=np.ascontiguousarray(finger.pivots, dtype=np.float64),
        vertices=np.concatenate([o.vertices for o in outlines], dtype=np.float64),
        vertex_start=np.array(offsets),
        edges=edges,
        edge_start=edge_start,
        sides=sides,
        side_start=side_start,
        radius=np.array([o.radius for o in outlines], dtype=np.float64),
        joint=np.array([o.joint for o in outlines]),
        reach=reach,
    )
