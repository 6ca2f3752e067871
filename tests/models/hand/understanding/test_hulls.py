"""Every hull that replaces a concave mesh is named, with the largest distance between them; meshes are read whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clench.closing.collision.self_check import check_hand
from clench.models.hand.hand import Hand
from clench.models.hand.understanding.hulls import hull_distances, largest_distance
from clench.models.mesh import TriangleMesh
from clench.models.shapes import CollisionSource
from clench.models.tessellation import BOX_CORNERS, BOX_TRIANGLES, convex_hull
from models.hand.hand_models import finger, hand, written


def plates(gap: float) -> TriangleMesh:
    """Return two plates of 8 mm, 40 mm x 200 mm wide, with a gap between them, in one mesh."""
    places = [BOX_CORNERS * (0.004, 0.02, 0.1) + (x * (0.004 + 0.5 * gap), 0.0, 0.0) for x in (-1, 1)]
    return TriangleMesh(np.vstack(places), np.vstack([BOX_TRIANGLES, BOX_TRIANGLES + 8]))


def as_obj(mesh: TriangleMesh, parts: int = 1) -> str:
    """Return a mesh as an OBJ file, its triangles in so many objects."""
    text = "".join("v {:.9g} {:.9g} {:.9g}\n".format(*v) for v in mesh.vertices)
    for k, faces in enumerate(np.array_split(mesh.triangles + 1, parts)):
        text += f"o part{k}\ng group{k}\n" + "".join("f {} {} {}\n".format(*f) for f in faces)
    return text


def palm_of(folder: Path, mesh: TriangleMesh, parts: int = 1) -> Hand:
    (folder / "palm.obj").write_text(as_obj(mesh, parts))
    asset = '<asset><mesh name="palm" file="palm.obj"/></asset>'
    fingers = [finger("a", (0.0, 0.0, 0.11)), finger("b", (0.03, 0.0, 0.11))]
    return Hand.load(written(folder, hand(*fingers, palm='<geom type="mesh" mesh="palm"/>', extra=asset)))


@pytest.mark.parametrize("gap", [0.001, 0.01, 0.08])
def test_the_distance_is_that_of_the_middle_of_the_gap(gap: float) -> None:
    mesh = plates(gap)
    assert 0.95 * gap / 2 <= largest_distance(convex_hull(mesh), mesh) <= gap / 2 + 1e-12


def test_the_distance_is_that_of_many_points() -> None:
    rng = np.random.default_rng(3)
    corners = rng.normal(size=(40, 3, 3)) * 0.03
    mesh = TriangleMesh(corners.reshape(-1, 3), np.arange(120).reshape(-1, 3))
    hull = convex_hull(mesh)
    from clench.kernels.geometry.mesh_distance import closest_point
    from clench.kernels.trees.bvh import build_tree

    tree = build_tree(mesh.vertices, mesh.triangles)
    weights = rng.dirichlet(np.ones(3), size=(len(hull.triangles), 200))
    points = np.einsum("fkc,fcx->fkx", weights, hull.vertices[hull.triangles]).reshape(-1, 3)
    sampled = np.sqrt(max(closest_point(tree, p, np.inf)[0] for p in points))
    found = largest_distance(hull, mesh)
    assert sampled * 0.95 <= found <= sampled * 1.1


def test_a_convex_mesh_is_not_named(tmp_path) -> None:
    read = palm_of(tmp_path, TriangleMesh(BOX_CORNERS * (0.02, 0.02, 0.1), BOX_TRIANGLES))
    assert hull_distances(read) == {}
    assert not [f for f in check_hand(read) if f.code == "hull_off_mesh"]


@pytest.mark.parametrize(
    ("gap", "recommended", "severity"), [(0.0016, False, "note"), (0.019, True, "note"), (0.03, True, "warning")]
)
def test_hulls_are_named_and_meshes_recommended_above_a_millimetre(
    tmp_path, gap: float, recommended: bool, severity: str
) -> None:
    read = palm_of(tmp_path, plates(gap))
    (found,) = [f for f in check_hand(read) if f.code == "hull_off_mesh"]
    assert found.links == ("palm",)
    assert found.severity == severity
    assert found.numbers["palm_m"] == pytest.approx(gap / 2, rel=0.05)
    assert f"'palm' {found.numbers['palm_m'] * 1e3:.2g} mm" in found.text
    assert ('collision_source = "raw"' in found.advice) == recommended
    assert not [f for f in check_hand(read, "raw") if f.code == "hull_off_mesh"]
    assert read.default_source == "engine"


def test_all_objects_of_an_obj_file_are_read(tmp_path) -> None:
    whole = palm_of(tmp_path, plates(0.03))
    for parts in (2, 3):
        read = palm_of(tmp_path, plates(0.03), parts)
        for source in CollisionSource:
            one, other = (h.links[h.palm].shapes[source][0].mesh for h in (whole, read))
            assert one is not None
            assert other is not None
            assert len(other.triangles) == len(one.triangles), source
        assert hull_distances(read)["palm"] == pytest.approx(hull_distances(whole)["palm"])


@pytest.mark.shared
def test_hulls_of_the_shadow_hand(shared_data: Path) -> None:
    found = hull_distances(Hand.load(shared_data / "hands/shadow_hand_mjcf/right_hand.xml"))
    assert set(found) == {"rh_forearm", *(f"rh_{f}distal" for f in ("ff", "mf", "rf", "lf", "th"))}
    assert found["rh_ffdistal"] == pytest.approx(3.5e-3, abs=2e-4)
