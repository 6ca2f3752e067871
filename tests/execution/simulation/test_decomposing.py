"""Convex pieces come from a process of its own, which may end without taking this one along."""

import numpy as np
import pytest

from clench.core.exceptions import ObjectError
from clench.execution.simulation import decomposing
from clench.execution.simulation.convex_pieces import SETTINGS
from clench.models.mesh import TriangleMesh

CORNERS = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
SIDES = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6]]
SIDES += [[0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]


def angle() -> TriangleMesh:
    """Two boxes that meet in an L."""
    other = CORNERS * [0.2, 1.0, 3.0] + [0.0, 0.0, 0.9]
    return TriangleMesh(np.vstack([CORNERS * [3.0, 1.0, 1.0], other]), [*SIDES, *(np.array(SIDES) + 8).tolist()])


def test_an_angle_is_two_boxes():
    pieces = decomposing.decompose(angle(), "angle", SETTINGS)
    assert len(pieces) >= 2
    points = np.vstack(pieces)
    np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], [[0, 0, 0], [3, 1, 3.9]], atol=0.1)


def test_a_process_that_ends_is_an_error_in_one_sentence():
    with pytest.raises(ObjectError, match="Body 'angle' cannot be decomposed into convex pieces: CoACD ended 2 times"):
        decomposing.decompose(angle(), "angle", {"no_such_setting": 1})


@pytest.mark.shared
def test_a_mesh_on_which_the_first_attempt_ends_gets_its_pieces(shared_data):
    from clench.models.objects.grasp_object import GraspObject

    (file,) = [f for f in (shared_data / "objects" / "cdb_waterbottle").rglob("*") if f.suffix in {".obj", ".stl"}][:1]
    mesh = GraspObject.load(file).bodies[0].shapes[0].to_mesh()
    assert len(decomposing.decompose(mesh, "bottle", SETTINGS)) >= 1
