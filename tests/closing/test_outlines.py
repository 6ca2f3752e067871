"""Sections of links are rounded outlines: inside the shape, no farther from its surface than the stated deviation."""

import numpy as np
import pytest

from clench.closing.outlines import RoundedOutline, cut_shape, extent, without_seams
from clench.core.pose import Pose
from clench.core.tolerances import OUTLINE_DEVIATION
from clench.models.mesh import TriangleMesh
from clench.models.shapes import Shape, ShapeKind

SIZE = (0.011, 0.02, 0.016)
KINDS = [ShapeKind.SPHERE, ShapeKind.CAPSULE, ShapeKind.CYLINDER, ShapeKind.BOX, ShapeKind.ELLIPSOID]


def signed(kind, p):
    """Return something negative inside, positive outside and, for points near the surface, about the distance."""
    a, b, c = SIZE
    match kind:
        case ShapeKind.SPHERE:
            return np.linalg.norm(p, axis=-1) - a
        case ShapeKind.CAPSULE:
            core = np.clip(p[..., 2], -b, b)
            return np.sqrt(p[..., 0] ** 2 + p[..., 1] ** 2 + (p[..., 2] - core) ** 2) - a
        case ShapeKind.CYLINDER:
            return np.maximum(np.hypot(p[..., 0], p[..., 1]) - a, np.abs(p[..., 2]) - b)
        case ShapeKind.BOX:
            return (np.abs(p) - [a, b, c]).max(axis=-1)
    return (np.linalg.norm(p / [a, b, c], axis=-1) - 1.0) * min(a, b, c)


def border(outline):
    """Return points of the rounded outline's border in the plane, shape (N, 2)."""
    turn = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    if not len(outline.sides):
        return outline.vertices[0] + outline.radius * ring
    rows = []
    for (p, q), side in zip(outline.side_ends(), outline.sides, strict=True):
        share = np.linspace(0, 1, 12)[:, None]
        rows.append(p + share * (q - p) + outline.radius * side[:2])
    if outline.radius > 0.0:
        for v in outline.vertices:
            points = v + outline.radius * ring
            away = np.array([np.linalg.norm(points - u, axis=1) for u in outline.vertices]).min(axis=0)
            rows.append(points[away >= outline.radius - 1e-15])
    return np.vstack(rows)


def placed(seed):
    rng = np.random.default_rng(seed)
    q = rng.normal(size=4)
    pose = Pose(rng.normal(size=3) * 0.01, wxyz=q / np.linalg.norm(q))
    return pose, Pose(rng.normal(size=3) * 0.01, wxyz=[0.8, 0.0, 0.6, 0.0])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(4))
def test_borders_lie_on_the_shape(kind, seed):
    T_axis_group_link, T_link_shape = placed(seed)
    shape = Shape(kind, SIZE, T_link_shape)
    T = T_axis_group_link.matrix
    low, high = extent(shape, T)
    seen = 0
    for offset in np.linspace(low, high, 9)[1:-1]:
        outline = cut_shape(shape, T, float(offset))
        assert outline is not None
        assert outline.deviation <= OUTLINE_DEVIATION
        points = border(outline)
        in_axis_group = np.column_stack([points[:, 0], np.full(len(points), offset), points[:, 1]])
        local = (T_axis_group_link @ T_link_shape).inverse().apply(in_axis_group)
        values = signed(kind, local)
        assert values.max() <= 1e-12
        # Inside by the deviation in the plane: never by more in space.
        assert values.min() >= -1.5 * outline.deviation - 1e-12
        seen += 1
    assert seen == 7


@pytest.mark.parametrize("kind", KINDS)
def test_no_section_beyond_the_extent(kind):
    T_axis_group_link, T_link_shape = placed(9)
    shape = Shape(kind, SIZE, T_link_shape)
    low, high = extent(shape, T_axis_group_link.matrix)
    mesh = shape.to_mesh(1e-6)
    heights = T_axis_group_link.apply(mesh.vertices)[:, 1]
    assert heights.min() == pytest.approx(low, abs=2e-6)
    assert heights.max() == pytest.approx(high, abs=2e-6)
    for outside in (low - 1e-9, high + 1e-9):
        assert cut_shape(shape, T_axis_group_link.matrix, float(outside)) is None


def test_a_capsule_in_the_plane_is_two_points_and_a_radius():
    half = np.sqrt(0.5)
    shape = Shape(ShapeKind.CAPSULE, (0.01, 0.02, 0), Pose([0.02, 0, 0], wxyz=[half, 0, half, 0]))
    outline = cut_shape(shape, np.eye(4), 0.006)
    np.testing.assert_allclose(sorted(outline.vertices[:, 0]), [0.0, 0.04], atol=1e-15)
    assert outline.radius == pytest.approx(0.008)
    assert outline.deviation == 0.0
    np.testing.assert_allclose(sorted(outline.sides[:, 1]), [-1.0, 1.0])


def test_a_section_of_no_width_is_its_two_ends():
    shape = Shape(ShapeKind.ELLIPSOID, (0.03, 1e-320, 0.01), Pose([0.02, 0, 0]))
    T = np.eye(4)
    T[0, 1], T[1, 0], T[1, 3] = -1.76e-22, -1.76e-22, -3.5e-24
    outline = cut_shape(shape, T, -8.78e-24)
    assert len(outline.vertices) == len(outline.sides) == 2
    np.testing.assert_allclose(np.ptp(outline.vertices, axis=0), [0.0, 0.0188], atol=1e-4)


def test_sides_of_a_mesh_look_out_and_meet_their_vertices():
    box = Shape(ShapeKind.BOX, (0.01, 0.02, 0.03)).to_mesh()
    outline = cut_shape(Shape(ShapeKind.MESH, mesh=box), np.eye(4), 0.003)
    assert not outline.both
    assert outline.radius == 0.0
    assert (outline.sides[:, 2] > 0.0).all()
    assert np.abs(outline.side_ends()).reshape(-1, 2).max(axis=0) == pytest.approx([0.01, 0.03])
    assert set(map(tuple, np.round(outline.vertices, 12))) >= {(x, z) for x in (-0.01, 0.01) for z in (-0.03, 0.03)}


@pytest.mark.parametrize("seed", range(6))
def test_outline_of_a_box_does_not_depend_on_how_its_faces_are_split(seed):
    """The diagonals of faces are no corners, so the outline of a mirrored box is the image of the box's."""
    T, _ = placed(seed)
    shape = Shape(ShapeKind.BOX, SIZE)
    low, high = extent(shape, T.matrix)
    box = shape.to_mesh()
    # Split the other way, in each pair of triangles: the box's mirror image, at the same place.
    other = Shape(ShapeKind.MESH, mesh=TriangleMesh(box.vertices * [1, -1, 1], box.triangles[:, ::-1]))
    for offset in np.linspace(low, high, 9)[1:-1]:
        outline, image = cut_shape(shape, T.matrix, offset), cut_shape(other, T.matrix, offset)
        assert len(outline.vertices) == len(outline.sides) <= 6
        np.testing.assert_allclose(image.vertices, outline.vertices, atol=1e-15)
        order, image_order = (np.argsort(np.arctan2(o.sides[:, 1], o.sides[:, 0])) for o in (outline, image))
        np.testing.assert_allclose(image.sides[image_order], outline.sides[order], atol=1e-12)


def test_only_straight_seams_within_one_side_are_joined():
    """A corner stays; so do two sides that meet in a point with a third, and ends of an open curve."""
    corner = [[0, 0, 1, 0, 0, -1], [2, 1, 1, 0, np.sqrt(0.5), -np.sqrt(0.5)]]
    np.testing.assert_array_equal(np.unique(without_seams(np.array(corner, dtype=float))[:, :4]), [0, 1, 2])
    assert len(without_seams(np.array(corner, dtype=float))) == 2
    seam = np.array([[3, 0, 1, 0, 0, -1], [0, 0, 1, 0, 0, -1], [3, 0, 4, 0, 0, -1]], dtype=float)
    np.testing.assert_allclose(without_seams(seam), [[0, 0, 4, 0, 0, -1]])
    branch = np.vstack([seam, [[1, 0, 1, 2, 1, 0], [1, 0, 1, 2, -1, 0]]])
    assert len(without_seams(branch)) == 4
    back_to_back = np.array([[0, 0, 1, 0, 0, -1], [1, 0, 2, 0, 0, 1]], dtype=float)
    assert len(without_seams(back_to_back)) == 2


def test_curves_of_fine_meshes_keep_their_points():
    turn = np.linspace(0, 2 * np.pi, 20000, endpoint=False)
    points = 0.01 * np.column_stack([np.cos(turn), np.sin(turn)])
    middle = turn + np.pi / 20000
    rows = np.column_stack([points, np.roll(points, -1, axis=0), np.cos(middle), np.sin(middle)])
    joined = without_seams(rows)
    assert np.hypot(*(joined[:, :2] + joined[:, 2:4]).T / 2).min() > 0.01 - 1e-9


@pytest.mark.parametrize("spoil", ["open", "flipped"])
def test_meshes_that_are_open_or_turned_count_from_both_sides(spoil):
    box = Shape(ShapeKind.BOX, (0.01, 0.02, 0.03)).to_mesh()
    triangles = box.triangles[1:] if spoil == "open" else np.vstack([box.triangles[:1, ::-1], box.triangles[1:]])
    outline = cut_shape(Shape(ShapeKind.MESH, mesh=TriangleMesh(box.vertices, triangles)), np.eye(4), 0.003)
    assert outline.both


def test_moving_and_turning_an_outline_moves_its_ends():
    shape = Shape(ShapeKind.BOX, (0.01, 0.02, 0.03))
    outline = cut_shape(shape, np.eye(4), 0.0)
    pivot, angle = np.array([0.3, -0.2]), 0.7
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.array([[c, -s], [s, c]])
    moved: RoundedOutline = outline.about(pivot).turned(angle)
    np.testing.assert_allclose(moved.vertices, (outline.vertices - pivot) @ rotation.T, atol=1e-15)
    np.testing.assert_allclose(moved.side_ends(), (outline.side_ends() - pivot) @ rotation.T, atol=1e-15)
