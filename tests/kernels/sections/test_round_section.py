"""Sections of round primitives against fine meshes of the same shapes, cut by the mesh kernel."""

import numpy as np
import pytest

from clench.core.pose import Pose
from clench.kernels.closing.layout import RoundArrays
from clench.kernels.sections import conics, plane_sections
from clench.kernels.sections.section import cut_mesh
from clench.models.shapes import Shape, ShapeKind
from kernels.kernel_entries import entry

region_gap, cut_rounds = entry(conics.region_gap), entry(plane_sections.cut_rounds)
make_sections = plane_sections.make_sections

NUMBER = {ShapeKind.SPHERE: 0, ShapeKind.CAPSULE: 1, ShapeKind.CYLINDER: 2, ShapeKind.ELLIPSOID: 3}
SIZE = (0.02, 0.035, 0.028)
HALF = np.sqrt(0.5)
POSES = {
    "axis normal to the plane": Pose([0.01, 0.002, -0.01], wxyz=[HALF, HALF, 0, 0]),
    "axis in the plane": Pose([0.01, 0.002, -0.01], wxyz=[0.8, 0.0, 0.6, 0.0]),
    "oblique": Pose([0.01, 0.002, -0.01], wxyz=[0.8, 0.36, 0.48, 0.0]),
    "steep": Pose([0.01, 0.002, -0.01], wxyz=[0.75, 0.66, 0.03, 0.0] / np.linalg.norm([0.75, 0.66, 0.03])),
    "nearly in the plane": Pose([0.01, 0.002, -0.01], wxyz=[1.0, 5e-8, 0.0, 0.0]),
}


def cut(kind, pose, offset):
    rounds = RoundArrays(np.array([NUMBER[kind]]), np.array([SIZE]), pose.matrix[None, :3].copy())
    sections = make_sections(1, 0, 1)
    cut_rounds(rounds, np.eye(4)[:3].copy(), offset, 0, sections, np.empty((3, 4)))
    segments, disks, ellipses = sections.counts[0]
    return sections.segments[0, :segments], sections.disks[0, :disks], sections.ellipses[0, :ellipses]


def distance_outside(parts, points):
    """Return how far points are outside all disks, ellipses and, of capsules, the band between straight edges."""
    segments, disks, ellipses = parts
    best = np.full(len(points), np.inf)
    for x, z, radius in disks:
        best = np.minimum(best, np.hypot(points[:, 0] - x, points[:, 1] - z) - radius)
    for e in ellipses:
        best = np.minimum(best, [region_gap(e, x, z)[0] for x, z in points])
    for ax, az, bx, bz, _, _ in segments:
        run = np.array([bx - ax, bz - az])
        t = np.clip(((points - [ax, az]) @ run) / (run @ run), 0, 1)
        best = np.minimum(best, np.linalg.norm(points - [ax, az] - t[:, None] * run, axis=1))
    return best


@pytest.mark.parametrize("pose", POSES.values(), ids=POSES)
@pytest.mark.parametrize("kind", NUMBER)
def test_sections_are_those_of_a_fine_mesh(kind, pose):
    mesh = Shape(kind, SIZE, pose).to_mesh(2e-6)
    heights = mesh.vertices[:, 1]
    for offset in np.linspace(heights.min(), heights.max(), 9)[1:-1]:
        parts = cut(kind, pose, float(offset))
        segments, _ = cut_mesh(mesh, np.eye(4), float(offset))
        points = segments[:, :4].reshape(-1, 2)
        away = distance_outside(parts, points)
        # On a slanting cut a deviation of 2e-6 m in space is larger in the plane.
        assert away.max() <= 2e-4
        assert np.quantile(np.abs(away), 0.5) <= 2e-5
        exact = np.vstack([extremes(parts)])
        assert np.abs(exact.min(axis=0) - points.min(axis=0)).max() <= 2e-4
        assert np.abs(exact.max(axis=0) - points.max(axis=0)).max() <= 2e-4


def extremes(parts):
    segments, disks, ellipses = parts
    rows = [segments[:, :4].reshape(-1, 2)]
    for x, z, radius in disks:
        rows.append(np.array([[x - radius, z - radius], [x + radius, z + radius]]))
    for e in ellipses:
        t = np.linspace(0, 2 * np.pi, 20001)
        local = np.column_stack([e[4] * np.cos(t), e[5] * np.sin(t)])
        local = local[(local[:, 0] >= e[6]) & (local[:, 0] <= e[7])]
        rows.append(e[:2] + local @ np.array([[e[2], e[3]], [-e[3], e[2]]]))
    return np.vstack(rows)


@pytest.mark.parametrize("kind", NUMBER)
def test_planes_beyond_the_shape_give_nothing(kind):
    for pose in POSES.values():
        heights = Shape(kind, SIZE, pose).to_mesh(1e-6).vertices[:, 1]
        for offset in (heights.min() - 1e-5, heights.max() + 1e-5):
            assert all(len(part) == 0 for part in cut(kind, pose, float(offset)))


@pytest.mark.parametrize("pose", POSES.values(), ids=POSES)
def test_edges_of_caps_look_out_and_close_the_curve(pose):
    segments, disks, ellipses = cut(ShapeKind.CYLINDER, pose, 0.004)
    middle = extremes((segments, disks, ellipses)).mean(axis=0)
    for ax, az, bx, bz, nx, nz in segments:
        assert np.hypot(nx, nz) == pytest.approx(1.0)
        assert abs((bx - ax) * nx + (bz - az) * nz) <= 1e-12
        assert (ax - middle[0]) * nx + (az - middle[1]) * nz > 0.0
    for ax, az, bx, bz, _, _ in segments if len(ellipses) else ():
        for x, z in ((ax, az), (bx, bz)):
            assert abs(region_gap(ellipses[0], x, z)[0]) <= 1e-9


def test_semi_axes_of_an_oblique_cylinder():
    tilt = 0.7
    pose = Pose(wxyz=[np.cos(np.pi / 4 - tilt / 2), np.sin(np.pi / 4 - tilt / 2), 0, 0])
    _, _, (e,) = cut(ShapeKind.CYLINDER, pose, 0.001)
    assert (e[4], e[5]) == pytest.approx((SIZE[0] / np.cos(tilt), SIZE[0]))


def test_a_ball_shaped_ellipsoid_is_cut_in_a_circle():
    rounds = RoundArrays(np.array([3]), np.array([[0.02, 0.02, 0.02]]), POSES["oblique"].matrix[None, :3].copy())
    sections = make_sections(1, 0, 1)
    cut_rounds(rounds, np.eye(4)[:3].copy(), 0.012, 0, sections, np.empty((3, 4)))
    assert sections.counts[0].tolist() == [0, 1, 0]
    assert sections.disks[0, 0] == pytest.approx([0.01, -0.01, np.sqrt(0.02**2 - 0.01**2)])
