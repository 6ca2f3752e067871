"""Objects from files, shapes and arrays: what is read, what is said, what is refused."""

from pathlib import Path

import numpy as np
import pytest

from clench.core.exceptions import FileError, ObjectError, UnknownNameError
from clench.core.pose import Pose
from clench.models.objects import mesh_file
from clench.models.objects.grasp_object import BodyRole, GraspObject, MeshPart
from clench.models.objects.mesh_file import read_mesh
from clench.models.objects.obstacles import obstacle, table
from clench.models.shapes import CollisionSource, Shape, ShapeKind
from clench.models.tessellation import BOX_TRIANGLES, tessellate

SHARED = Path(__file__).parents[3].parent / "shared/data/objects"


def box(half=0.05):
    return tessellate(Shape(ShapeKind.BOX, (half, half, half)), 1e-3)


def written(path, *meshes):
    import trimesh

    parts = [trimesh.Trimesh(m.vertices, m.triangles, process=False) for m in meshes]
    if len(parts) == 1:
        parts[0].export(path)
    else:
        scene = trimesh.Scene()
        for i, part in enumerate(parts):
            scene.add_geometry(part, transform=Pose([0.2 * i, 0.0, 0.0]).matrix)
        scene.export(path)
    return path


@pytest.mark.parametrize("suffix", [".obj", ".stl", ".ply", ".off", ".glb", ".STL"])
def test_every_format_gives_the_same_closed_box(tmp_path, suffix):
    path = written(tmp_path / f"box{suffix.lower()}", box())
    path = path.rename(tmp_path / f"box{suffix}")
    loaded = GraspObject.load(path)
    (body,) = loaded.bodies
    mesh = body.shapes[0].mesh
    assert (loaded.name, loaded.path, body.name) == ("box", path, "box")
    assert body.closed
    assert loaded.warnings == ()
    assert len(mesh.vertices) == 8
    assert len(mesh.triangles) == 12
    np.testing.assert_allclose(sorted(map(tuple, mesh.vertices)), sorted(map(tuple, box().vertices)), atol=1e-8)


def test_a_scene_becomes_one_mesh_with_its_poses(tmp_path):
    path = written(tmp_path / "two.glb", box(), box())
    mesh = GraspObject.load(str(path)).bodies[0].shapes[0].mesh
    assert len(mesh.triangles) == 24
    np.testing.assert_allclose([mesh.vertices[:, 0].min(), mesh.vertices[:, 0].max()], [-0.05, 0.25], atol=1e-7)


def test_scale_pose_and_source(tmp_path):
    path = written(tmp_path / "box.stl", box(50.0))
    assert "if its lengths are in millimetres, load it with a scale of 0.001" in GraspObject.load(path).warnings[0]
    pose = Pose([1.0, 0.0, 0.0])
    loaded = GraspObject.load(path, scale=0.001, pose=pose, collision_source="visual")
    assert loaded.warnings == ()
    assert loaded.pose == pose
    assert loaded.collision_source is CollisionSource.VISUAL
    np.testing.assert_allclose(np.ptp(loaded.bodies[0].shapes[0].mesh.vertices, axis=0), 0.1)
    assert "is only" in GraspObject.load(path, scale=1e-6).warnings[0]


def test_the_engine_sees_the_hull_of_a_file(tmp_path):
    path = written(tmp_path / "two.stl", box())
    open_box = tmp_path / "open.off"
    kept = BOX_TRIANGLES[2:]
    lines = ["OFF", f"8 {len(kept)} 0", *(" ".join(map(str, v)) for v in box().vertices)]
    open_box.write_text("\n".join([*lines, *(f"3 {a} {b} {c}" for a, b, c in kept)]))
    raw = GraspObject.load(open_box)
    assert not raw.bodies[0].closed
    assert "not watertight, 4 edges with a triangle on one side only" in raw.warnings[0]
    engine = GraspObject.load(open_box, collision_source="engine")
    assert engine.bodies[0].closed
    assert len(engine.bodies[0].shapes[0].mesh.triangles) == 12
    assert GraspObject.load(path, collision_source="engine").bodies[0].closed


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("none.stl", None, "no such file"),
        ("text.stl", "this is not a mesh\n", "STL"),
        ("text.obj", "this is not a mesh\n", "OBJ"),
        ("text.ply", "this is not a mesh\n", "PLY"),
        ("text.off", "this is not a mesh\n", "OFF"),
        ("text.glb", "this is not a mesh\n", "GLB"),
        ("empty.obj", "", "the file is empty"),
        ("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "triangles"),
        ("part.step", "x", "cannot read '.step'; expected one of .obj, .stl, .ply, .off, .glb"),
        ("noending", "x", "cannot read 'noending'"),
    ],
)
def test_files_that_are_no_meshes(tmp_path, name, content, words):
    path = tmp_path / name
    if content is not None:
        path.write_text(content)
    with pytest.raises(FileError) as caught:
        GraspObject.load(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_folder_is_no_mesh(tmp_path):
    with pytest.raises(FileError, match="it is a folder, expected a file"):
        GraspObject.load(tmp_path)


def test_nan_in_a_file(tmp_path):
    path = tmp_path / "nan.off"
    path.write_text("OFF\n4 4 0\n0 0 0\n1 0 0\n0 nan 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n")
    with pytest.raises(ObjectError, match=r"nan.off: 1 of 4 vertices are NaN or infinite"):
        GraspObject.load(path)


def test_a_misspelt_built_in_name():
    with pytest.raises(UnknownNameError, match=r"Did you mean 'mug'.*Objects: mug, bottle, screwdriver, ball"):
        GraspObject.load("mugg")


@pytest.mark.parametrize("scale", [0, -1.0, float("nan"), float("inf"), "big", True])
def test_scale_must_be_a_number_above_zero(scale):
    with pytest.raises(ObjectError, match="scale: expected a finite number above 0"):
        GraspObject.load("mug", scale=scale)


def test_unknown_collision_source():
    with pytest.raises(UnknownNameError, match="engine, raw, visual"):
        GraspObject.load("mug", collision_source="convex")


@pytest.mark.parametrize(
    ("text", "kind", "size"),
    [
        ("sphere:r=0.03", ShapeKind.SPHERE, (0.03, 0.0, 0.0)),
        ("cylinder:r=0.03,h=0.1", ShapeKind.CYLINDER, (0.03, 0.05, 0.0)),
        ("capsule: h = 0.1 , r=2e-2", ShapeKind.CAPSULE, (0.02, 0.05, 0.0)),
        ("Box:x=0.1,y=0.05,z=0.03", ShapeKind.BOX, (0.05, 0.025, 0.015)),
        ("ellipsoid:a=0.03,b=0.02,c=0.05", ShapeKind.ELLIPSOID, (0.03, 0.02, 0.05)),
    ],
)
def test_shapes_as_text(text, kind, size):
    loaded = GraspObject.load(text, scale=2.0)
    shape = loaded.bodies[0].shapes[0]
    assert shape.kind is kind
    np.testing.assert_allclose(shape.size, np.multiply(size, 2.0))
    assert loaded.bodies[0].closed
    assert loaded.warnings == ()
    assert GraspObject.from_shape(text).bodies[0].shapes[0].size == pytest.approx(size)


@pytest.mark.parametrize(
    ("text", "error", "words"),
    [
        ("cylinder:r=0.03", ObjectError, "'h' is missing; write it like cylinder:r=0.03,h=0.1"),
        ("cylinder:r=0.03,h=0.1,w=1", ObjectError, "unknown key 'w'; expected r, h"),
        ("sphere:r=-1", ObjectError, "r: expected a finite length above 0 m, got -1"),
        ("sphere:r=nan", ObjectError, "r: expected a finite length above 0 m, got nan"),
        ("sphere:r=wide", ObjectError, "r: expected a length in metres, got 'wide'"),
        ("sphere:r=1,r=2", ObjectError, "'r' is given twice"),
        ("sphere:0.03", ObjectError, "expected key=number, got '0.03'"),
        ("sphere:", ObjectError, "'r' is missing"),
        ("spere:r=0.03", UnknownNameError, "Did you mean 'sphere'"),
    ],
)
def test_malformed_shapes(text, error, words):
    with pytest.raises(error) as caught:
        GraspObject.load(text)
    assert words in str(caught.value)


def test_large_shapes_are_noticed_too():
    assert "scale of 0.001" in GraspObject.load("sphere:r=30").warnings[0]


@pytest.mark.parametrize(
    "shape",
    [
        Shape(ShapeKind.SPHERE, (0.0, 0.0, 0.0)),
        Shape(ShapeKind.BOX, (0.1, 0.1, float("nan"))),
        Shape(ShapeKind.MESH),
    ],
)
def test_shapes_of_no_size(shape):
    with pytest.raises(ObjectError):
        GraspObject.from_shape(shape)


def test_several_meshes_with_poses_and_roles():
    mesh = box()
    shelf = Pose([0.0, 0.0, -0.2])
    made = GraspObject.from_meshes(
        [
            (mesh.vertices, mesh.triangles),
            MeshPart(mesh.vertices.tolist(), mesh.triangles.tolist(), shelf, "obstacle", "shelf"),
        ],
        name="pair",
    )
    first, second = made.bodies
    assert (first.name, first.role, second.name, second.role) == (
        "pair[0]",
        BodyRole.GRASPABLE,
        "shelf",
        BodyRole.OBSTACLE,
    )
    assert second.shapes[0].pose == shelf
    assert second.shapes[0].to_mesh().vertices[:, 2].max() == pytest.approx(-0.15)
    assert all(body.closed for body in made.bodies)


@pytest.mark.parametrize("size", [1e-9, 1.0, 1.6e6, 1e150])
def test_vertices_of_a_mesh_of_any_size_are_merged(tmp_path, size):
    mesh = box()
    soup = mesh.vertices[mesh.triangles].reshape(-1, 3) * size
    lines = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in soup]
    lines += [f"f {k} {k + 1} {k + 2}" for k in range(1, len(soup), 3)]
    (tmp_path / "soup.obj").write_text("\n".join(lines))
    vertices, triangles = read_mesh(tmp_path / "soup.obj")
    assert len(vertices) == 8
    assert vertices[triangles].reshape(-1, 3) == pytest.approx(soup, rel=1e-15)


def test_a_vertex_far_away_from_all_others_is_no_hindrance(tmp_path):
    """Beside a coordinate of 1e6 the others round to a few whole numbers; what is at one place is merged."""
    corners = [(0.0, 0.0, 0.0), (0.02, 0.0, 0.0), (0.0, 0.02, 0.0), (0.0, 0.0, 1e6)]
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
    lines = [f"v {x:.17g} {y:.17g} {z:.17g}" for face in faces for x, y, z in (corners[k] for k in face)]
    lines += [f"f {k} {k + 1} {k + 2}" for k in range(1, 12, 3)]
    (tmp_path / "far.obj").write_text("\n".join(lines))
    vertices, triangles = read_mesh(tmp_path / "far.obj")
    assert len(vertices) == 4
    assert np.abs(vertices[triangles] - np.array(corners)[np.array(faces)]).max() <= 1e-8 * 1e6


def test_vertices_of_a_soup_are_merged():
    mesh = box()
    soup = mesh.vertices[mesh.triangles].reshape(-1, 3)
    (body,) = GraspObject.from_meshes([(soup, np.arange(36).reshape(-1, 3))]).bodies
    assert body.closed
    assert len(body.shapes[0].mesh.vertices) == 8


@pytest.mark.parametrize("factors", [mesh_file._FACTORS, np.zeros(3, dtype=np.uint64)], ids=["usual", "equal keys"])
def test_places_are_told_apart_whatever_their_keys(monkeypatch, factors):
    monkeypatch.setattr(mesh_file, "_FACTORS", factors)
    rows = np.random.default_rng(0).integers(-2, 3, size=(200, 3))
    first, kind = mesh_file._distinct_rows(rows)
    assert first.tolist() == [n for n in range(200) if rows[n].tolist() not in rows[:n].tolist()]
    np.testing.assert_array_equal(rows[first][kind], rows)


@pytest.mark.parametrize(
    ("parts", "error", "words"),
    [
        ([], ObjectError, "at least one part"),
        ([(box().vertices,)], ObjectError, "part 0: expected (vertices, triangles, pose, role, name)"),
        ([(np.zeros((0, 3)), np.zeros((0, 3)))], ObjectError, "object[0]: the mesh is empty, it has no vertices"),
        ([(box().vertices, [])], ObjectError, "object[0]: the mesh is empty, it has no triangles"),
        ([(box().vertices * np.nan, BOX_TRIANGLES)], ObjectError, "8 of 8 vertices are NaN or infinite"),
        ([(box().vertices, [[0, 1, 8]])], ObjectError, "triangle 0 names vertex 8, but there are 8 vertices"),
        ([(box().vertices, [[0, 1, -1]])], ObjectError, "triangle 0 names vertex -1"),
        ([(box().vertices, [[0, 1]])], ObjectError, "expected triangles of shape (T, 3)"),
        ([(box().vertices, [[0, 1, 2.5]])], ObjectError, "expected whole numbers"),
        ([("abc", [[0, 1, 2]])], ObjectError, "expected arrays of numbers"),
        ([(*(box().vertices, BOX_TRIANGLES), None, "toy")], UnknownNameError, "graspable, obstacle"),
        ([(*(box().vertices, BOX_TRIANGLES), None, "obstacle")], ObjectError, "at least one graspable body"),
    ],
)
def test_malformed_parts(parts, error, words):
    with pytest.raises(error) as caught:
        GraspObject.from_meshes(parts)
    assert words in str(caught.value)


def test_a_table_is_an_obstacle_under_the_object():
    scene = GraspObject.load("mug").with_body(table(height=-0.01))
    top = scene.bodies[1]
    assert top.role is BodyRole.OBSTACLE
    assert top.shapes[0].to_mesh().vertices[:, 2].max() == pytest.approx(-0.01)
    with pytest.raises(ObjectError, match="lengths above 0 m"):
        table(size=(1.0, 0.0))


def test_clutter_from_other_objects_and_shapes():
    pose = Pose([0.2, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])
    scene = GraspObject.load("mug").with_object(GraspObject.load("bottle"), pose, "obstacle")
    mine, other = scene.bodies
    assert (mine.role, other.role) == (BodyRole.GRASPABLE, BodyRole.OBSTACLE)
    original = GraspObject.load("bottle").bodies[0]
    np.testing.assert_allclose(
        other.shapes[0].to_mesh().vertices, pose.apply(original.shapes[0].mesh.vertices), atol=1e-15
    )
    np.testing.assert_allclose(other.pieces[2].vertices, pose.apply(original.pieces[2].vertices), atol=1e-15)
    placed = obstacle("sphere:r=0.05", pose, name="ball").shapes[0]
    assert placed.pose == pose
    with pytest.raises(UnknownNameError, match="Role 'friend'"):
        scene.with_object(GraspObject.load("ball"), role="friend")


@pytest.mark.shared
@pytest.mark.skipif(not SHARED.exists(), reason="needs ../shared/data/objects")
def test_scanned_objects_are_seen_to_be_closed():
    scans = sorted(SHARED.glob("ycb_*/textured.obj"))
    assert len(scans) >= 10
    for path in scans:
        loaded = GraspObject.load(path)
        assert loaded.bodies[0].closed, loaded.warnings
        assert not any("millimetres" in warning for warning in loaded.warnings)


@pytest.mark.parametrize(
    ("file", "name"),
    [
        ("bolt.stl", "bolt"),
        ("ycb_mug/textured.obj", "ycb_mug"),
        ("ycb_mug/Mesh.stl", "ycb_mug"),
        ("002_can/google_16k/nontextured.stl", "002_can"),
        ("cup/meshes/visual.stl", "cup_visual"),
        ("cup/meshes/collision.stl", "cup_collision"),
        ("cup/handle.stl", "handle"),
    ],
)
def test_an_object_is_called_after_its_file_or_the_folder_that_says_more(tmp_path, file, name):
    path = tmp_path / file
    path.parent.mkdir(parents=True, exist_ok=True)
    trimesh = pytest.importorskip("trimesh")
    mesh = GraspObject.load("box:x=0.05,y=0.05,z=0.05").bodies[0].shapes[0].to_mesh()
    trimesh.Trimesh(mesh.vertices, mesh.triangles).export(path)
    obj = GraspObject.load(path)
    assert (obj.name, obj.bodies[0].name) == (name, name)
