"""Parse mesh files with trimesh: the geometry alone, from the bytes of one file and from no other file or address."""

from __future__ import annotations

import io
import logging
import re
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from clench.core.files.file_limits import LINE_BYTES, MESH_TRIANGLES, SCENE_PARTS

from .face_indices import wrong_face
from .gltf_scene import bare_glb

#: Bytes of a binary STL file before its triangles, and of each triangle.
_STL_HEADER: Final = 84
_STL_TRIANGLE: Final = 50
#: Lines of a text STL file that begin a triangle, or have a corner.
_FACET: Final = re.compile(rb"^\s*facet\b", re.MULTILINE)
_VERTEX: Final = re.compile(rb"^\s*vertex\b", re.MULTILINE)
#: Lines of the header of a PLY file: it is text; it has so many elements.
_PLY_TEXT: Final = re.compile(rb"^format\s+ascii\b", re.MULTILINE)
_PLY_COUNT: Final = re.compile(rb"^element\s+\w+\s+(\d{1,12})\s*$", re.MULTILINE)
#: Lines that part an OBJ file; the parser's time grows with the square of their number.
_GROUP: Final = re.compile(rb"^(?:o|g|s|usemtl|mtllib)\b.*$", re.MULTILINE)
_GROUP_STARTS: Final = (b"\no ", b"\ng ", b"\ns ", b"\nusemtl", b"\nmtllib")


class MeshError(ValueError):
    """Say why bytes are no mesh."""


def parse_mesh(data: bytes, suffix: str) -> Any:
    """Return the `trimesh.Trimesh` that a mesh file holds; the meshes of a scene become one.

    Args:
        data: of the file. suffix: of its name, one of `PARSED`, in lower case.

    Raises:
        MeshError: any error of the parser, or a limit of docs/security.md, as part of a sentence.
    """
    import trimesh

    # The library reports unreadable parts on standard error, with names from the file.
    logging.getLogger("trimesh").addHandler(logging.NullHandler())
    options: dict[str, Any] = {"skip_materials": True} if suffix == ".obj" else {}
    try:
        stream = io.BytesIO(PARSED[suffix](data))
        loaded: Any = trimesh.load(stream, file_type=suffix[1:], process=False, **options)
        mesh = loaded.to_mesh() if isinstance(loaded, trimesh.Scene) else loaded
        count = len(getattr(mesh, "faces", ()))
    except MeshError:
        raise
    except Exception as error:  # a damaged file can fail in any way
        face = wrong_face(data, suffix)
        if face is not None:
            raise MeshError(face) from None
        reason = str(error).strip().splitlines()[0][:120] if str(error).strip() else type(error).__name__
        raise MeshError(reason) from None
    if count > MESH_TRIANGLES:
        raise MeshError(f"{count} triangles; expected up to {MESH_TRIANGLES}")
    return mesh


def _text(data: bytes) -> bytes:
    """Return text in UTF-8: the parser guesses other encodings with a library that need not be there."""
    try:
        data.decode()
    except UnicodeDecodeError:
        return data.decode("latin-1").encode()
    return data


def _stl(data: bytes) -> bytes:
    """Let only a complete file pass: the parser takes a damaged binary file for text, and finds nothing in it."""
    count = int.from_bytes(data[_STL_HEADER - 4 : _STL_HEADER], "little")
    expected = _STL_HEADER + _STL_TRIANGLE * count
    if len(data) >= _STL_HEADER and len(data) == expected:
        return data
    lowered = data.lower()
    if b"solid" in lowered and b"\0" not in data:
        if b"endsolid" in lowered:
            return _text(data)
        if not _has_whole_facets(lowered):
            raise MeshError("the text ends before 'endsolid', in the middle of a triangle")
        return _text(data) + b"\nendsolid\n"
    if len(data) < _STL_HEADER:
        raise MeshError(
            f"neither text with 'solid' nor a binary header of {_STL_HEADER} bytes, it has {len(data)} bytes"
        )
    raise MeshError(f"its header counts {count} triangles, which take {expected} bytes, but the file has {len(data)}")


def _has_whole_facets(text: bytes) -> bool:
    """Tell whether text of an STL file, in lower case, consists of complete triangles up to its last word."""
    words = text.split()
    begun, ended = len(_FACET.findall(text)), words.count(b"endfacet")
    return words[-1] == b"endfacet" and begun == ended and len(_VERTEX.findall(text)) == 3 * ended


def _ply(data: bytes) -> bytes:
    """Let only a complete header and all lines of a text pass, and return the header in ASCII.

    The parser reads no other letters, and only comments have them. It leaves missing lines out without a word.
    """
    head, end, rest = data.partition(b"end_header")
    if not end:
        raise MeshError("its header does not end: 'end_header' is missing")
    for name in (b"x", b"y", b"z"):
        if re.search(rb"^property\s+\w+\s+" + name + rb"\s*$", head, re.MULTILINE) is None:
            raise MeshError(f"its header has no property '{name.decode()}'")
    if _PLY_TEXT.search(head):
        counted, lines = sum(map(int, _PLY_COUNT.findall(head))), sum(1 for line in rest.splitlines() if line.strip())
        if lines < counted:
            raise MeshError(f"its header counts {counted} lines, but the file has {lines}")
    return head.decode("latin-1").encode("ascii", "replace") + end + rest


def _obj(data: bytes) -> bytes:
    ends = np.flatnonzero(np.frombuffer(data, np.uint8) == ord("\n"))
    if np.diff(ends, prepend=-1, append=len(data)).max() > LINE_BYTES:
        raise MeshError(f"a line has more than {LINE_BYTES} bytes")
    data = _text(data)
    return data if sum(map(data.count, _GROUP_STARTS)) <= SCENE_PARTS else _GROUP.sub(b"", data)


def _glb(data: bytes) -> bytes:
    try:
        return bare_glb(data)
    except ValueError as error:
        raise MeshError(str(error)) from None


def _dae(data: bytes) -> bytes:
    """Let only plain XML of a small scene pass: the parser unpacks archives, and expands entities without end."""
    from clench.core.files.xml_files import parse_xml

    root = parse_xml(data, "", "COLLADA")
    copies = sum(1 for element in root.iter() if str(element.tag).endswith("}instance_node"))
    if copies > _DAE_COPIES:
        raise MeshError(f"its scene has {copies} copies of nodes; expected up to {_DAE_COPIES}")
    return data


#: Copies of nodes may hold copies: so many make at most 256 of one.
_DAE_COPIES: Final = 16
#: Suffixes of the parsed files, and functions that prepare their bytes for the parser.
PARSED: Final[dict[str, Callable[[bytes], bytes]]] = {
    ".obj": _obj,
    ".stl": _stl,
    ".ply": _ply,
    ".off": _text,
    ".glb": _glb,
    ".dae": _dae,
}


def arrays_of(mesh: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices and triangles of a result of `parse_mesh`; no triangles if it has only points."""
    return np.asarray(mesh.vertices), np.asarray(getattr(mesh, "faces", ()))
