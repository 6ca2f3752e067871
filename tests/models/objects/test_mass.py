"""Centre of mass, volume and length scale against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import clench
from clench.core.pose import Pose
from clench.models.mesh import TriangleMesh
from clench.models.objects.mass import mass_properties
from clench.models.tessellation import BOX_CORNERS, BOX_TRIANGLES


@pytest.mark.parametrize(
    ("text", "volume", "length"),
    [
        ("sphere:r=0.03", 4.0 / 3.0 * np.pi * 0.03**3, 0.03),
        ("box:x=0.1,y=0.05,z=0.03", 0.1 * 0.05 * 0.03, np.hypot(np.hypot(0.05, 0.025), 0.015)),
        ("cylinder:r=0.03,h=0.1", np.pi * 0.03**2 * 0.1, np.hypot(0.03, 0.05)),
        ("capsule:r=0.02,h=0.1", np.pi * 0.02**2 * 0.1 + 4.0 / 3.0 * np.pi * 0.02**3, 0.07),
        ("ellipsoid:a=0.03,b=0.02,c=0.05", 4.0 / 3.0 * np.pi * 0.03 * 0.02 * 0.05, 0.05),
    ],
)
def test_shapes(text: str, volume: float, length: float) -> None:
    found = mass_properties(clench.GraspObject.load(text))
    assert np.abs(found.center).max() < 1e-12
    assert found.volume == pytest.approx(volume, rel=1e-12)
    assert found.length == pytest.approx(length, rel=1e-9)


def test_parts_count_by_volume_and_obstacles_do_not_count() -> None:
    obj = clench.GraspObject.from_meshes(
        [
            (BOX_CORNERS * 0.01, BOX_TRIANGLES),
            (BOX_CORNERS * 0.02, BOX_TRIANGLES, Pose([0.09, 0.0, 0.0])),
            (BOX_CORNERS * 0.5, BOX_TRIANGLES, Pose([0.0, 3.0, 0.0]), "obstacle"),
        ]
    )
    found = mass_properties(obj)
    assert np.allclose(found.center, [0.08, 0.0, 0.0], atol=1e-12)
    assert found.volume == pytest.approx(9 * 0.02**3, rel=1e-12)
    assert found.length == pytest.approx(np.hypot(0.09, np.hypot(0.01, 0.01)), rel=1e-12)


def test_open_meshes_are_taken_as_their_hulls() -> None:
    open_box = TriangleMesh(BOX_CORNERS + 5.0, BOX_TRIANGLES[:-2])
    found = mass_properties(clench.GraspObject.from_meshes([(open_box.vertices, open_box.triangles)]))
    assert not found.exact
    assert np.allclose(found.center, 5.0, atol=1e-12)
    assert found.volume == pytest.approx(8.0, rel=1e-12)


@pytest.mark.parametrize("closed", [True, False])
def test_the_centre_of_a_tetrahedron_is_a_quarter_of_the_way_up(closed: bool) -> None:
    """One edge has a vertex in between, so that the mean of the vertices is not the centre."""
    corners = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.4], [0.1, 0.0, 0.0]])
    triangles = [[0, 2, 4], [4, 2, 1], [0, 4, 3], [4, 1, 3], [0, 3, 2], [1, 2, 3]]
    obj = clench.GraspObject.from_meshes([(corners + 2.0, triangles if closed else triangles[:-1])])
    found = mass_properties(obj)
    assert found.exact is closed
    assert found.center == pytest.approx(np.array([0.075, 0.05, 0.1]) + 2.0, abs=1e-12)
    assert found.volume == pytest.approx(0.3 * 0.2 * 0.4 / 6.0, rel=1e-12)
    assert found.length == pytest.approx(np.linalg.norm([0.075, 0.05, 0.3]), rel=1e-12)
