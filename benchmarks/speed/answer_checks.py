"""Check answers before they are timed: finite, the same again, inside the limits, and touching the object."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from clench.core.files.json_files import non_finite_path
from clench.core.pose import FloatArray
from clench.core.tolerances import CONTACT_OVERLAP, PASSED_GAP
from clench.models.shapes import ShapeKind

if TYPE_CHECKING:
    from clench.models.objects.grasp_object import GraspObject
    from clench.solver.solution import GraspSolution

#: Distance of a contact point from the object's surface [m]: what an independent measure is held to.
SURFACE = 1e-9
LIMIT = 1e-9


@dataclass
class Checked:
    """Count what was checked; lengths in metres."""

    contacts: int = 0
    worst_gap: float = 0.0
    worst_overlap: float = 0.0
    surface_contacts: int = 0
    worst_surface: float = 0.0


def check_answer(solution: GraspSolution, again: GraspSolution, surface: Surface, checked: Checked) -> Iterator[str]:
    """Yield a sentence for everything that is wrong with an answer.

    Args:
        solution: the answer. again: the answer to the same question, asked once more.
        surface: of the object. checked: what was checked is added.
    """
    document = _without_times(solution)
    bad = non_finite_path(document)
    if bad is not None:
        yield f"{bad} is not a finite number."
        return
    if document != _without_times(again):
        yield "the same question gave another answer."
    for name, angle in solution.joint_angles.items():
        low, high = solution.joint_limits[name]
        if not low - LIMIT <= angle <= high + LIMIT:
            yield f"joint '{name}' is at {angle:.6g} rad, outside its limits {low:.6g} to {high:.6g} rad."
    candidates = [c for f in solution.fingers.values() for c in f.candidates]
    for contact in (t for c in candidates for t in c.contacts if not t.passed):
        checked.contacts += 1
        checked.worst_gap = max(checked.worst_gap, contact.gap)
        checked.worst_overlap = max(checked.worst_overlap, -contact.gap)
        # A later joint may have carried a link off a little; by more, and its contact must say that it passed.
        if not -CONTACT_OVERLAP <= contact.gap <= PASSED_GAP:
            yield f"{contact.link} is said to touch with a gap of {contact.gap:.3g} m."
    for contact in solution.contacts:
        distance = surface.distance(contact.position)
        if distance is None:
            continue
        checked.surface_contacts += 1
        checked.worst_surface = max(checked.worst_surface, distance)
        if distance > SURFACE:
            yield f"a contact of {contact.link} is {distance:.3g} m away from the object's surface."


class Surface:
    """Measure distances to an object's triangles by looking at every one of them, which no kernel does."""

    def __init__(self, obj: GraspObject) -> None:
        shapes = [shape for body in obj.bodies for shape in body.shapes]
        flat = all(shape.kind in (ShapeKind.MESH, ShapeKind.BOX) for shape in shapes)
        meshes = [shape.to_mesh() for shape in shapes] if flat else []
        self._T_object_world = np.linalg.inv(obj.pose.matrix)
        #: Corners of every triangle [m], shape (T, 3, 3); None when the object has round shapes.
        self.triangles: FloatArray | None = (
            np.concatenate([m.vertices[m.triangles] for m in meshes]) if meshes else None
        )

    def distance(self, position: FloatArray) -> float | None:
        """Return the distance of a point of the world from the surface [m]; None when the object is round."""
        if self.triangles is None:
            return None
        point = self._T_object_world[:3, :3] @ position + self._T_object_world[:3, 3]
        return float(triangle_distances(self.triangles, point).min())


def triangle_distances(triangles: FloatArray, point: FloatArray) -> FloatArray:
    """Return the distance of a point from every triangle [m], shape (T,).

    Args:
        triangles: corners [m], shape (T, 3, 3). point: shape (3,).
    """
    a, b, c = triangles.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0.0)
    height = ((point - a) * normal).sum(axis=1)
    foot = point - height[:, None] * normal
    over = length[:, 0] > 0.0
    nearest = np.full(len(triangles), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        edge = end - start
        over &= (np.cross(edge, foot - start) * normal).sum(axis=1) >= 0.0
        square = (edge * edge).sum(axis=1)
        along = np.divide(((point - start) * edge).sum(axis=1), square, out=np.zeros_like(square), where=square > 0.0)
        on_edge = start + np.clip(along, 0.0, 1.0)[:, None] * edge
        nearest = np.minimum(nearest, np.linalg.norm(on_edge - point, axis=1))
    return np.where(over, np.abs(height), nearest)


def _without_times(solution: GraspSolution) -> dict[str, Any]:
    return {key: value for key, value in solution.to_dict().items() if key != "timing"}
