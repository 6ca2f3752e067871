"""Shapes of links for the three collision sources, and the pairs that may overlap."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clench.models.hand.hand import Hand
from clench.models.hand.hand_report import describe_hand
from clench.models.mesh import TriangleMesh
from clench.models.shapes import CollisionSource, ShapeKind
from models.hand.hand_models import finger, hand, three_fingers, urdf_hand, written

ENGINE, RAW, VISUAL = CollisionSource.ENGINE, CollisionSource.RAW, CollisionSource.VISUAL


def notched() -> TriangleMesh:
    """Return a watertight L-shaped prism, away from the origin: not convex, centre of mass not at 0."""
    outline = np.array([[0, 0], [3, 0], [3, 1], [1, 1], [1, 3], [0, 3]]) * 0.01 + 0.02
    low = np.column_stack([outline, np.zeros(6)])
    vertices = np.vstack([low, low + np.array([0, 0, 0.03])])
    cap = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]
    sides = [t for i in range(6) for j in [(i + 1) % 6] for t in ([i, j, j + 6], [i, j + 6, i + 6])]
    faces = [[a, c, b] for a, b, c in cap] + [[a + 6, b + 6, c + 6] for a, b, c in cap] + sides
    return TriangleMesh(vertices, faces)


def exported(folder: Path, suffix: str) -> str:
    import trimesh

    mesh = notched()
    made = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    assert made.is_watertight
    assert made.volume > 0
    made.export(folder / f"tip.{suffix}")
    return f"tip.{suffix}"


def volume(mesh: TriangleMesh) -> float:
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


@pytest.mark.parametrize("suffix", ["obj", "stl", "ply", "glb", "off"])
def test_meshes_of_any_format_lie_where_the_file_says(tmp_path, suffix: str) -> None:
    geometry = f'<mesh filename="package://any/where/{exported(tmp_path, suffix)}" scale="1 2 1"/>'
    loaded = Hand.load(written(tmp_path, urdf_hand(geometry=geometry).replace("any/where", "any"), "two.urdf"))
    (raw,), (engine,) = (loaded.links[loaded.link_index("b_2")].shapes[s] for s in (RAW, ENGINE))
    assert raw.kind is engine.kind is ShapeKind.MESH
    assert raw.mesh is not None
    assert engine.mesh is not None
    placed = raw.mesh.transformed(raw.pose)
    expected = notched().vertices * [1, 2, 1]
    distances = np.linalg.norm(placed.vertices[:, None] - expected, axis=2)
    assert len(placed.vertices) == 12
    assert distances.min(axis=0).max() < 1e-8
    assert volume(placed) == pytest.approx(2 * 5e-4 * 0.03, rel=1e-6)
    hull = engine.mesh.transformed(engine.pose)
    assert volume(hull) == pytest.approx(2 * (9e-4 - 2e-4) * 0.03, rel=1e-6)


def test_ascii_stl_is_read(tmp_path) -> None:
    import trimesh

    mesh = notched()
    text = trimesh.exchange.stl.export_stl_ascii(trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False))
    (tmp_path / "tip.stl").write_text(text)
    loaded = Hand.load(written(tmp_path, urdf_hand(geometry='<mesh filename="tip.stl"/>'), "two.urdf"))
    (raw,) = loaded.links[loaded.link_index("b_2")].shapes[RAW]
    assert raw.mesh is not None
    assert len(raw.mesh.triangles) == 20


def test_hull_triangles_face_outwards_and_hold_every_vertex(tmp_path) -> None:
    geometry = f'<mesh filename="{exported(tmp_path, "stl")}"/>'
    loaded = Hand.load(written(tmp_path, urdf_hand(geometry=geometry), "two.urdf"))
    shapes = loaded.links[loaded.link_index("b_2")].shapes
    hull, raw = shapes[ENGINE][0].mesh, shapes[RAW][0].mesh
    assert hull is not None
    assert raw is not None
    a, b, c = (hull.vertices[hull.triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    heights = np.einsum("fk,fvk->fv", normals, raw.vertices[None] - a[:, None])
    assert heights.max() < 1e-7


def test_sizes_of_primitives(tmp_path) -> None:
    geoms = (
        '<geom type="sphere" size="0.01"/><geom type="capsule" size="0.01" fromto="0 0 0 0 0 0.04"/>'
        '<geom type="cylinder" size="0.01 0.02"/><geom type="box" size="0.01 0.02 0.03"/>'
        '<geom type="ellipsoid" size="0.01 0.02 0.03"/>'
    )
    loaded = Hand.load(written(tmp_path, hand(finger("a"), finger("b", (0.03, 0, 0.05)), palm=geoms)))
    shapes = loaded.links[loaded.palm].shapes[ENGINE]
    assert [(s.kind, s.size) for s in shapes] == [
        ("sphere", (0.01, 0.0, 0.0)),
        ("capsule", (0.01, 0.02, 0.0)),
        ("cylinder", (0.01, 0.02, 0.0)),
        ("box", (0.01, 0.02, 0.03)),
        ("ellipsoid", (0.01, 0.02, 0.03)),
    ]
    np.testing.assert_allclose(shapes[1].pose.position, [0, 0, 0.02], atol=1e-15)


def test_sources_differ_where_the_model_draws_and_collides_apart(tmp_path) -> None:
    palm = '<geom size="0.03"/><geom type="box" size="0.02 0.02 0.02" contype="0" conaffinity="0"/>'
    loaded = Hand.load(written(tmp_path, hand(finger("a"), finger("b", (0.03, 0, 0.05)), palm=palm)))
    shapes = loaded.links[loaded.palm].shapes
    assert [[s.kind for s in shapes[source]] for source in (ENGINE, RAW, VISUAL)] == [["sphere"], ["sphere"], ["box"]]
    index = loaded.links[loaded.link_index("a_link0")].shapes
    assert [s.kind for s in index[VISUAL]] == ["capsule"]


def test_links_without_collision_use_what_is_drawn_and_say_so(tmp_path) -> None:
    import mujoco

    drawn = finger("a").replace("<geom", '<geom contype="0" conaffinity="0"')
    loaded = Hand.load(written(tmp_path, hand(drawn, finger("b", (0.03, 0, 0.05)))))
    assert [s.kind for s in loaded.links[loaded.link_index("a_link1")].shapes[ENGINE]] == ["capsule"]
    (warning,) = [w for w in loaded.warnings if "without collision geometry" in w]
    assert "'a_link0', 'a_link1'" in warning
    model = mujoco.MjSpec.from_string(loaded.spec_xml).compile()
    assert model.geom_contype[model.body("a_link1").geomadr[0]] == 1


def test_unused_geometry_on_a_fixed_link_stays_unused(tmp_path) -> None:
    cover = '<geom size="0.03"/><body name="cover"><geom size="0.04" contype="0" conaffinity="0"/></body>'
    loaded = Hand.load(written(tmp_path, hand(finger("a"), finger("b", (0.03, 0, 0.05)), palm=cover)))
    assert loaded.links[loaded.link_index("cover")].shapes[ENGINE] == ()
    assert not any("without collision" in w for w in loaded.warnings)


def test_planes_are_left_out(tmp_path) -> None:
    palm = '<geom size="0.03"/><geom name="pad" type="plane" size="1 1 0.1"/>'
    loaded = Hand.load(written(tmp_path, hand(finger("a"), finger("b", (0.03, 0, 0.05)), palm=palm)))
    assert len(loaded.links[loaded.palm].shapes[ENGINE]) == 1
    assert any("plane" in w for w in loaded.warnings)


def pairs(loaded: Hand) -> set[frozenset[str]]:
    return {frozenset((loaded.links[a].name, loaded.links[b].name)) for a, b in loaded.allowed_pairs}


def test_allowed_pairs(tmp_path) -> None:
    near = finger("middle", (0.025, 0.0, 0.05), axes=["1 0 0"] * 2)
    masked = finger("thumb", (0.0, -0.06, 0.03), axes=["-1 0 0"] * 2).replace(
        "<geom", '<geom contype="2" conaffinity="2"'
    )
    extra = '<contact><exclude body1="index_link1" body2="palm"/></contact>'
    loaded = Hand.load(written(tmp_path, hand(finger("index", (0.02, 0, 0.05)), near, masked, extra=extra)))
    found = pairs(loaded)
    assert frozenset(("palm", "index_link0")) in found
    assert frozenset(("index_link1", "palm")) in found
    assert frozenset(("index_link1", "middle_link1")) not in found
    assert frozenset(("thumb_link1", "index_link1")) in found
    assert frozenset(("palm", "middle_link1")) not in found
    assert list(loaded.allowed_pairs) == sorted(set(loaded.allowed_pairs))
    assert all(a < b for a, b in loaded.allowed_pairs)


def test_distant_links_are_not_allowed_to_overlap(tmp_path) -> None:
    found = pairs(Hand.load(written(tmp_path, three_fingers())))
    assert found == {
        frozenset(p)
        for f in ("index", "middle", "thumb")
        for p in (("palm", f"{f}_link0"), (f"{f}_link0", f"{f}_link1"))
    }


def test_report_holds_reasons_for_every_joint(tmp_path) -> None:
    import json

    loaded = Hand.load(written(tmp_path, urdf_hand(), "two.urdf"))
    report = describe_hand(loaded)
    assert json.loads(json.dumps(report.to_dict()))["palm"] == "palm"
    assert report.degrees_of_freedom == 3
    rows = {row[1]: row for row in report.joint_rows()}
    assert set(rows) == set(loaded.joint_names)
    assert all("role: " in row[6] and "open: " in row[6] for row in rows.values())
    assert rows["b2"][2:6] == ("closing", "+", "0.0", "-11.5 .. 85.9")
    assert report.coupling_rows() == [("a2", "0.8 x a1 +0.1 rad", "joint equality of 'a2'")]
    assert dict(report.summary_rows())["degrees of freedom"] == "3 (4 joints)"
