"""Mesh files parsed from their bytes alone: the geometry is that of the whole file, without its looks."""

import io
import struct
import sys

import numpy as np
import pytest

from clench.core.files.file_limits import SCENE_PARTS
from clench.models.gltf_scene import bare_glb
from clench.models.mesh_parsing import MeshError, arrays_of, parse_mesh


def textured_scene():
    """Return two balls at their places, one with a picture on it."""
    import trimesh
    from PIL import Image

    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.02)
    picture = Image.fromarray(np.zeros((8, 8, 3), dtype=np.uint8))
    painted = ball.copy()
    painted.visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(ball.vertices), 2)), image=picture)
    scene = trimesh.Scene()
    scene.add_geometry(painted, transform=trimesh.transformations.translation_matrix([0.1, 0.0, 0.0]))
    scene.add_geometry(ball, transform=trimesh.transformations.rotation_matrix(0.3, [1.0, 2.0, 3.0]))
    return scene


def test_a_scene_keeps_its_geometry_and_loses_its_looks():
    import trimesh

    data = textured_scene().export(file_type="glb")
    assert b'"images"' in data
    assert b'"images"' not in bare_glb(data)
    assert b'"material"' not in bare_glb(data)
    expected = trimesh.load(io.BytesIO(data), file_type="glb", process=False).to_mesh()
    vertices, triangles = arrays_of(parse_mesh(data, ".glb"))
    np.testing.assert_array_equal(vertices, expected.vertices)
    np.testing.assert_array_equal(triangles, expected.faces)


def test_a_scene_that_says_that_it_is_longer():
    data = textured_scene().export(file_type="glb")
    longer = data[:12] + struct.pack("<I", len(data)) + data[16:]
    with pytest.raises(MeshError, match="incorrect header"):
        parse_mesh(longer, ".glb")


@pytest.mark.parametrize("groups", [1, SCENE_PARTS + 1])
def test_groups_of_an_obj_file_do_not_change_its_surface(groups):
    corners = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\n"
    faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    text = corners + "".join(f"o part{i}\nusemtl m{i}\n" for i in range(groups)) + faces
    mesh = parse_mesh(text.encode(), ".obj")
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(0.1**3 / 6.0)


TEXT_STL = (
    b"solid part\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    b"endsolid part\n"
)
UNENDED_STL = TEXT_STL.removesuffix(b"endsolid part\n")
TEXT_PLY = (
    b"ply\nformat ascii 1.0\ncomment Ma\xdfe\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
)
BINARY_PLY = (
    TEXT_PLY[: TEXT_PLY.index(b"0 0 0")].replace(b"ascii", b"binary_little_endian")
    + struct.pack("<9f", *[0, 0, 0, 1, 0, 0, 0, 1, 0])
    + struct.pack("<B3i", 3, 0, 1, 2)
)
BINARY_STL = bytes(80) + struct.pack("<I", 1) + struct.pack("<12fH", *[0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0], 0)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (TEXT_STL[:60], "the text ends before 'endsolid', in the middle of a triangle"),
        (UNENDED_STL.replace(b"endfacet", b""), "in the middle of a triangle"),
        (UNENDED_STL.replace(b"vertex 0 1 0\n", b""), "in the middle of a triangle"),
        (UNENDED_STL + b"facet normal 0 0 1\nendfacet", "in the middle of a triangle"),
        (UNENDED_STL + UNENDED_STL[:30], "in the middle of a triangle"),
        (BINARY_STL[:100], "its header counts 1 triangles, which take 134 bytes, but the file has 100"),
        (b"solid" + BINARY_STL[5:100], "its header counts 1 triangles, which take 134 bytes, but the file has 100"),
        (BINARY_STL[:40], "neither text with 'solid' nor a binary header of 84 bytes, it has 40 bytes"),
        (b"h\xe9llo", "neither text with 'solid' nor a binary header of 84 bytes, it has 5 bytes"),
    ],
)
def test_what_is_wrong_with_a_damaged_stl_file(data, words, monkeypatch):
    monkeypatch.setitem(sys.modules, "charset_normalizer", None)
    with pytest.raises(MeshError, match=words):
        parse_mesh(data, ".stl")


@pytest.mark.parametrize(
    ("data", "suffix"),
    [
        (TEXT_STL, ".stl"),
        (UNENDED_STL, ".stl"),
        (UNENDED_STL.replace(b"part", b"facet St\xfcck").rstrip(), ".stl"),
        (TEXT_PLY, ".ply"),
        (BINARY_PLY, ".ply"),
        (TEXT_STL.replace(b"part", b"St\xfcck"), ".stl"),
        (BINARY_STL, ".stl"),
        (b"\xfc" * 80 + BINARY_STL[80:], ".stl"),
        (b"# St\xfcck\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", ".obj"),
        (b"OFF\n# St\xfcck\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", ".off"),
    ],
)
def test_text_in_another_encoding_is_read_without_a_library_that_guesses(data, suffix, monkeypatch):
    monkeypatch.setitem(sys.modules, "charset_normalizer", None)
    vertices, triangles = arrays_of(parse_mesh(data, suffix))
    np.testing.assert_array_equal(vertices[triangles[0]], [[0, 0, 0], [1, 0, 0], [0, 1, 0]])


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (TEXT_PLY[:60], "its header does not end: 'end_header' is missing"),
        (TEXT_PLY.replace(b"float y", b"float \xdf"), "its header has no property 'y'"),
        (TEXT_PLY.removesuffix(b"3 0 1 2\n"), "its header counts 4 lines, but the file has 3"),
        (BINARY_PLY[:-3], "unexpected length"),
    ],
)
def test_what_is_wrong_with_a_damaged_ply_file(data: bytes, words: str) -> None:
    with pytest.raises(MeshError, match=words):
        parse_mesh(data, ".ply")


def test_a_face_without_its_vertex_is_named():
    with pytest.raises(MeshError, match="face 1, line 4: names vertex 9, but there are 3 vertices"):
        parse_mesh(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", ".obj")
