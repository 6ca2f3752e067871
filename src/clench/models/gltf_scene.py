"""Reduce binary glTF files to their geometry: without pictures and outside references, as a scene of few parts."""

from __future__ import annotations

import struct
from typing import Any, Final

import msgspec

from clench.core.files.file_limits import JSON_BYTES, MESH_TRIANGLES, SCENE_PARTS

_MAGIC: Final = 0x46546C67
_JSON: Final = 0x4E4F534A
#: Keys of pictures; they are removed before parsing.
_LOOKS: Final = ("images", "textures", "samplers", "materials", "animations", "skins", "cameras", "extras")


def bare_glb(data: bytes) -> bytes:
    """Return a binary glTF file with its meshes and nodes alone.

    Raises:
        ValueError: no binary glTF, data in other files, or a scene of too many parts.
    """
    if len(data) < 20:
        raise ValueError("incorrect header on GLB file")
    magic, version, _, length, kind = struct.unpack("<5I", data[:20])
    if magic != _MAGIC or version != 2 or kind != _JSON or length > len(data) - 20:
        raise ValueError("incorrect header on GLB file")
    if length > JSON_BYTES:
        raise ValueError(f"its scene has {length} bytes; expected up to {JSON_BYTES}")
    try:
        tree = msgspec.json.decode(data[20 : 20 + length].rstrip(b" \0"), type=dict[str, Any])
        _check(tree)
        text = msgspec.json.encode({key: value for key, value in tree.items() if key not in _LOOKS})
    except RecursionError:
        raise ValueError("its scene is nested too deeply") from None
    except (KeyError, TypeError, AttributeError, IndexError, msgspec.MsgspecError) as error:
        raise ValueError(f"its scene is malformed: {error}") from None
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    return struct.pack("<5I", magic, version, 20 + len(text) + len(rest), len(text), kind) + text + rest


def _check(tree: dict[str, Any]) -> None:
    """Refuse far data and large scenes; take the materials from the meshes."""
    for buffer in tree.get("buffers", ()):
        if not str(buffer.get("uri", "data:")).startswith("data:"):
            raise ValueError("its data are in another file; expected all of them in this one")
    meshes, nodes = tree.get("meshes", []), tree.get("nodes", [])
    parts = len(nodes) + sum(len(mesh["primitives"]) for mesh in meshes)
    if parts > SCENE_PARTS:
        raise ValueError(f"its scene has {parts} nodes and parts of meshes; expected up to {SCENE_PARTS}")
    accessors = tree.get("accessors", [])
    for accessor in accessors:
        if "bufferView" not in accessor and "sparse" not in accessor:
            raise ValueError("an accessor has no data")
    sizes = []
    for mesh in meshes:
        for primitive in mesh["primitives"]:
            primitive.pop("material", None)
            if "extensions" in primitive:
                raise ValueError(f"it needs {', '.join(primitive['extensions'])}; expected plain triangles")
        counted = [p.get("indices", p["attributes"].get("POSITION")) for p in mesh["primitives"]]
        sizes.append(sum(int(accessors[k]["count"]) for k in counted if k is not None) // 3)
    triangles = sum(sizes[node["mesh"]] for node in nodes if "mesh" in node)
    if triangles > MESH_TRIANGLES:
        raise ValueError(f"its scene has {triangles} triangles; expected up to {MESH_TRIANGLES}")
