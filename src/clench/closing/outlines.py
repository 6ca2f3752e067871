"""Cut link shapes by curl planes: rounded outlines (docs/method.md section 2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from clench.core.pose import FloatArray
from clench.core.tolerances import OUTLINE_DEVIATION
from clench.models.mesh import TriangleMesh
from clench.models.objects.topology import edge_defects
from clench.models.shapes import Shape, ShapeKind
from clench.models.tessellation import tessellate

if TYPE_CHECKING:
    from clench.kernels.trees.bvh import MeshTree

#: Axes closer than this to the plane count as lying in it [rad].
ALIGNED = 1e-9
#: Corners nearer than this to the line between their neighbours are none [fraction of the largest coordinate].
_STRAIGHT = 1e-12
_ROUND = {ShapeKind.SPHERE: 0, ShapeKind.CAPSULE: 1, ShapeKind.CYLINDER: 2, ShapeKind.ELLIPSOID: 3}


@dataclass(frozen=True)
class RoundedOutline:
    """The section of a shape: all points within `radius` of a core.

    Args:
        vertices: of the core [m], in the axis group's (x, z), shape (N, 2).
        sides: rows (n_x, n_z, g, t_a, t_b), shape (M, 5): outward unit normal, offset, and the two ends along
            (-n_z, n_x) [m].
        radius: [m]. both: the sides' winding is not known, so both faces count.
        deviation: bound on the distance to the true section [m].
    """

    vertices: FloatArray
    sides: FloatArray
    radius: float = 0.0
    both: bool = False
    deviation: float = 0.0

    def about(self, pivot: FloatArray) -> RoundedOutline:
        """Return the outline with coordinates relative to a pivot, shape (2,)."""
        sides = self.sides.copy()
        sides[:, 2] -= sides[:, 0] * pivot[0] + sides[:, 1] * pivot[1]
        sides[:, 3:] -= (-sides[:, 1] * pivot[0] + sides[:, 0] * pivot[1])[:, None]
        return RoundedOutline(self.vertices - pivot, sides, self.radius, self.both, self.deviation)

    def turned(self, angle: float) -> RoundedOutline:
        """Return the outline turned about the origin, x towards z [rad]."""
        c, s = np.cos(angle), np.sin(angle)
        rotation = np.array([[c, -s], [s, c]])
        sides = self.sides.copy()
        sides[:, :2] = self.sides[:, :2] @ rotation.T
        return RoundedOutline(self.vertices @ rotation.T, sides, self.radius, self.both, self.deviation)

    def side_ends(self) -> FloatArray:
        """Return the end points of the core's sides, shape (M, 2, 2)."""
        n = self.sides[:, :2]
        foot = n * self.sides[:, 2:3]
        along = np.column_stack([-n[:, 1], n[:, 0]])
        return np.stack([foot + along * self.sides[:, 3:4], foot + along * self.sides[:, 4:5]], axis=1)


def cut_shape(shape: Shape, T_axis_group_link: FloatArray, offset: float) -> RoundedOutline | None:
    """Cut one shape by the plane `y_axis_group = offset`.

    Args:
        shape: in its link's frame. T_axis_group_link: shape (4, 4). offset: [m].

    Returns:
        the outline in coordinates of the axis group, or None where the plane misses the shape.
    """
    T = T_axis_group_link @ shape.pose.matrix
    if shape.kind is ShapeKind.MESH or shape.kind is ShapeKind.BOX:
        return _cut_mesh(shape, T, offset)
    return _cut_round(shape, T, offset)


def extent(shape: Shape, T_axis_group_link: FloatArray) -> tuple[float, float]:
    """Return the least and greatest y of a shape in the axis group's frame [m]."""
    T = T_axis_group_link @ shape.pose.matrix
    y = T[1, :3]
    a, b, c = shape.size
    match shape.kind:
        case ShapeKind.MESH:
            assert shape.mesh is not None
            heights = shape.mesh.vertices @ y
            return float(heights.min() + T[1, 3]), float(heights.max() + T[1, 3])
        case ShapeKind.SPHERE:
            half = a
        case ShapeKind.CAPSULE:
            half = a + b * abs(y[2])
        case ShapeKind.CYLINDER:
            half = a * float(np.hypot(y[0], y[1])) + b * abs(y[2])
        case ShapeKind.BOX:
            half = float(np.abs(y) @ np.array([a, b, c]))
        case ShapeKind.ELLIPSOID:
            half = float(np.linalg.norm(y * np.array([a, b, c])))
    return float(T[1, 3] - half), float(T[1, 3] + half)


def _cut_mesh(shape: Shape, T: FloatArray, offset: float) -> RoundedOutline | None:
    from clench.kernels.sections.section import cut_mesh

    tree, closed = shape.kept(("outline tree",), lambda: _tree(shape))
    segments, _ = cut_mesh(tree, T, offset)
    if not len(segments):
        return None
    segments = without_seams(segments)
    ends = segments[:, :4].reshape(-1, 2)
    return RoundedOutline(np.unique(ends, axis=0), _side_rows(segments), 0.0, not closed, 0.0)


def without_seams(segments: FloatArray) -> FloatArray:
    """Join segments that go straight on: where two triangles of one flat face meet there is no corner.

    Otherwise an outline would depend on how the faces are split, and the outline of a mirrored box would not be the
    mirrored outline.

    Args:
        segments: rows (a_x, a_z, b_x, b_z, n_x, n_z) [m], shape (S, 6); joined only where normals agree.
    """
    a, b, n = segments[:, 0:2], segments[:, 2:4], segments[:, 4:6]
    # Ends in the order of (-n_z, n_x), so that sides of one piece follow each other.
    ahead = ((b - a) * np.column_stack([-n[:, 1], n[:, 0]])).sum(axis=1, keepdims=True) >= 0.0
    start, end = np.where(ahead, a, b), np.where(ahead, b, a)
    real = (start != end).any(axis=1)
    if not real.any():
        return segments
    start, end, n = start[real], end[real], n[real]
    slack = _STRAIGHT * float(np.abs(segments[:, :4]).max())
    following = _followers(start, end, n, slack)
    kept = np.ones(len(n), dtype=bool)
    for head in np.setdiff1d(np.flatnonzero(following >= 0), following):
        i, seam, k = head, [], following[head]
        while k >= 0:
            seam.append(start[k])
            if _in_line(start[i], np.array(seam), end[k], slack).all():
                kept[k], end[i] = False, end[k]
                run = end[i] - start[i]
                n[i] = np.array([run[1], -run[0]]) / np.linalg.norm(run)
            else:
                i, seam = k, []
            k = following[k]
    return np.hstack([start, end, n])[kept]


def _followers(start: FloatArray, end: FloatArray, n: FloatArray, slack: float) -> np.ndarray:
    """Return, for every segment, the segment that continues from its end in nearly the same line, or -1."""
    points, index = np.unique(np.vstack([start, end]), axis=0, return_inverse=True)
    first, last = np.split(index.ravel(), 2)
    count = len(points)
    single = (np.bincount(first, minlength=count) == 1) & (np.bincount(last, minlength=count) == 1)
    after = np.full(count, -1)
    after[first] = np.arange(len(first))
    following = np.where(single[last], after[last], -1)
    i = np.flatnonzero(following >= 0)
    k = following[i]
    straight = _in_line(start[i], end[i], end[k], slack) & ((n[i] * n[k]).sum(axis=1) > 0.0)
    following[i[~straight]] = -1
    return following


def _in_line(a: FloatArray, points: FloatArray, b: FloatArray, slack: float) -> np.ndarray:
    """Say which points lie within `slack` of the line through a and b, shape (N,); all may be rows."""
    run = b - a
    away = points - a
    across = np.abs(run[..., 0] * away[:, 1] - run[..., 1] * away[:, 0])
    near: np.ndarray = across <= slack * np.linalg.norm(run, axis=-1)
    return near


def _tree(shape: Shape) -> tuple[MeshTree, bool]:
    """Return the tree of a mesh or a box in its own frame, and whether its faces wind outwards."""
    from clench.kernels.trees.bvh import build_tree

    mesh = shape.mesh
    if mesh is None:
        mesh = tessellate(Shape(ShapeKind.BOX, shape.size), OUTLINE_DEVIATION)
    return build_tree(mesh.vertices, mesh.triangles), _winds_outwards(mesh)


def _winds_outwards(mesh: TriangleMesh) -> bool:
    """Say whether every edge has exactly two opposite uses and the volume is positive."""
    points, index = np.unique(mesh.vertices, axis=0, return_inverse=True)
    faces = index.ravel()[mesh.triangles]
    a, b, c = (points[faces[:, k]] - points.mean(axis=0) for k in range(3))
    return edge_defects(faces).none and float((np.cross(a, b) * c).sum()) > 0.0


def _side_rows(segments: FloatArray) -> FloatArray:
    """Return sides from segments (a_x, a_z, b_x, b_z, n_x, n_z), without segments of length zero."""
    a, b, n = segments[:, 0:2], segments[:, 2:4], segments[:, 4:6]
    along = np.column_stack([-n[:, 1], n[:, 0]])
    ends = np.sort(np.column_stack([(a * along).sum(axis=1), (b * along).sum(axis=1)]), axis=1)
    rows = np.column_stack([n, (a * n).sum(axis=1), ends])
    return rows[ends[:, 1] > ends[:, 0]]


def _cut_round(shape: Shape, T: FloatArray, offset: float) -> RoundedOutline | None:
    a, b, _ = shape.size
    depth = offset - T[1, 3]
    if shape.kind is ShapeKind.CAPSULE and abs(T[1, 2]) <= ALIGNED:
        if abs(depth) >= a:
            return None
        core = np.array([T[[0, 2], 3] - b * T[[0, 2], 2], T[[0, 2], 3] + b * T[[0, 2], 2]])
        return RoundedOutline(core, _ring(core), float(np.sqrt(a * a - depth * depth)))
    segments, disks, ellipses = _round_section(shape, T, offset)
    if not (len(segments) or len(disks) or len(ellipses)):
        return None
    if len(disks) and not len(segments) and not len(ellipses):
        widest = disks[np.argmax(disks[:, 2])]
        if len(disks) == 1 or np.ptp(disks[:, :2], axis=0).max() <= ALIGNED:
            return RoundedOutline(widest[None, :2], np.empty((0, 5)), float(widest[2]))
    points = [segments[:, :4].reshape(-1, 2), *map(_circle_points, disks), *map(_ellipse_points, ellipses)]
    core = _hull(np.vstack(points))
    curved = len(disks) > 0 or len(ellipses) > 0
    return RoundedOutline(core, _ring(core), deviation=OUTLINE_DEVIATION if curved else 0.0)


def _round_section(shape: Shape, T: FloatArray, offset: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    from clench.kernels.closing.layout import RoundArrays
    from clench.kernels.runtime.by_reference import kept
    from clench.kernels.sections.plane_sections import cut_rounds, make_sections

    kind = np.array([_ROUND[shape.kind]], dtype=np.int64)
    rounds = RoundArrays(kind, np.array([shape.size]), np.ascontiguousarray(T[None, :3]))
    sections = make_sections(1, 0, 1)
    cut_rounds(kept(rounds), np.eye(4)[:3].copy(), offset, 0, kept(sections), np.empty((3, 4)))
    n, d, e = sections.counts[0]
    return sections.segments[0, :n], sections.disks[0, :d], sections.ellipses[0, :e]


def _circle_points(disk: FloatArray) -> FloatArray:
    t = _steps(disk[2])
    points: FloatArray = disk[:2] + disk[2] * np.column_stack([np.cos(t), np.sin(t)])
    return points


def _ellipse_points(e: FloatArray) -> FloatArray:
    t = _steps(e[4])
    along, across = e[4] * np.cos(t), e[5] * np.sin(t)
    keep = (along >= e[6]) & (along <= e[7])
    ends = [(x, s * e[5] * np.sqrt(max(1 - (x / e[4]) ** 2, 0.0))) for x in e[6:8] for s in (1, -1)]
    local = np.vstack([np.column_stack([along, across])[keep], ends])
    points: FloatArray = e[:2] + local @ np.array([[e[2], e[3]], [-e[3], e[2]]])
    return points


def _steps(radius: float) -> FloatArray:
    count = int(np.ceil(np.pi / np.sqrt(2.0 * min(OUTLINE_DEVIATION / radius, 0.5))))
    return np.linspace(0.0, 2.0 * np.pi, max(count, 8), endpoint=False)


def _hull(points: FloatArray) -> FloatArray:
    """Return the corners of the convex hull, counter-clockwise; the ends where points lie on a line."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return points[ConvexHull(points).vertices]
    except QhullError:  # which has no other reason here: the points are finite
        along = points[:, np.argmax(np.ptp(points, axis=0))]
        return np.unique(points[[np.argmin(along), np.argmax(along)]], axis=0)


def _ring(core: FloatArray) -> FloatArray:
    """Return the sides of a polygon given counter-clockwise (x towards z); two points give two opposite sides."""
    ends = np.roll(core, -1, axis=0)
    run = ends - core
    length = np.linalg.norm(run, axis=1)
    real = length > 0.0
    normals = np.column_stack([run[real, 1], -run[real, 0]]) / length[real, None]
    return _side_rows(np.column_stack([core[real], ends[real], normals]))
