"""Mesh files that were made to do harm, by name: each writes its files into a folder and returns the one to load."""

import base64
import json
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .bombs import zip_bomb
from .models import Writer, endless_file, png

GLB_JSON, GLB_BIN = 0x4E4F534A, 0x004E4942
OBJ = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def file(name: str, data: str | bytes, *others: tuple[str, bytes]) -> Writer:
    def write(folder: Path) -> Path:
        for other, content in others:
            (folder / other).write_bytes(content)
        path = folder / name
        path.write_bytes(data.encode() if isinstance(data, str) else data)
        return path

    return write


def link(name: str, target: str) -> Writer:
    def write(folder: Path) -> Path:
        (folder / name).symlink_to(target)
        return folder / name

    return write


def glb(change: Callable[[dict[str, Any]], None] = lambda tree: None) -> bytes:
    """Return a binary glTF file of a tetrahedron, with its tree changed."""
    points = struct.pack("<12f", *[0.0, 0, 0, 0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1])
    faces = struct.pack("<12I", *[0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3])
    tree: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": 4}]}],
        "buffers": [{"byteLength": 96}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 48},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
            {"bufferView": 1, "componentType": 5125, "count": 12, "type": "SCALAR"},
        ],
    }
    change(tree)
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), GLB_JSON) + text + struct.pack("<II", 96, GLB_BIN) + points + faces
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def changed_glb(change: Callable[[dict[str, Any]], None]) -> Writer:
    return file("thing.glb", glb(change))


def far_buffer(uri: str) -> Writer:
    def change(tree: dict[str, Any]) -> None:
        tree["buffers"].append({"byteLength": 64, "uri": uri})
        tree["bufferViews"][0] = {"buffer": 1, "byteOffset": 0, "byteLength": 48}

    return file("thing.glb", glb(change), ("beside.bin", bytes(64)))


def picture(uri: str | None, data: bytes = b"") -> Writer:
    uri = uri or f"data:image/png;base64,{base64.b64encode(data).decode()}"

    def change(tree: dict[str, Any]) -> None:
        tree["images"] = [{"uri": uri}]
        tree["textures"] = [{"source": 0}]
        tree["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
        tree["meshes"][0]["primitives"][0]["material"] = 0

    return changed_glb(change)


def many_accessors(count: int) -> Writer:
    def change(tree: dict[str, Any]) -> None:
        tree["accessors"][0]["count"] = count
        tree["accessors"][1]["count"] = count

    return changed_glb(change)


def no_view(tree: dict[str, Any]) -> None:
    """Leave out the data of an accessor: then it is all zeros, as many as it says."""
    for accessor in tree["accessors"]:
        del accessor["bufferView"]
        accessor["count"] = 3_000_000_000


def circle(tree: dict[str, Any]) -> None:
    tree["nodes"] = [{"mesh": 0, "children": [1]}, {"mesh": 0, "children": [0]}]


def doubling(tree: dict[str, Any]) -> None:
    tree["nodes"] = [*({"children": [i + 1, i + 1]} for i in range(40)), {"mesh": 0}]


def doubling_pairs(tree: dict[str, Any]) -> None:
    nodes: list[dict[str, Any]] = [{"children": [1, 2]}]
    for i in range(24):
        nodes += [{"children": [2 * i + 3, 2 * i + 4]}, {"children": [2 * i + 3, 2 * i + 4]}]
    tree["nodes"] = [*nodes, {"mesh": 0}, {"mesh": 0}]


def instances(tree: dict[str, Any]) -> None:
    tree["nodes"] = [{"children": list(range(1, 200_001))}, *({"mesh": 0} for _ in range(200_000))]


def chain(tree: dict[str, Any]) -> None:
    tree["nodes"] = [*({"children": [i + 1]} for i in range(50_000)), {"mesh": 0}]


def long_chain(tree: dict[str, Any]) -> None:
    tree["nodes"] = [*({"children": [i + 1]} for i in range(1900)), {"mesh": 0}]


def primitives(tree: dict[str, Any]) -> None:
    tree["meshes"][0]["primitives"] *= 30_000


def deep_extras(folder: Path) -> Path:
    data = glb(lambda tree: tree.update(extras="DEEP"))
    text = data[20 : 20 + struct.unpack("<I", data[12:16])[0]].replace(b'"DEEP"', b"[" * 100_000 + b"]" * 100_000)
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), GLB_JSON) + text
    path = folder / "thing.glb"
    path.write_bytes(struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body)
    return path


def draco(tree: dict[str, Any]) -> None:
    tree["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    tree["meshes"][0]["primitives"][0]["extensions"] = {
        "KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}
    }


def ply(header: str, body: bytes = bytes(64)) -> Writer:
    return file("thing.ply", header.encode() + b"end_header\n" + body)


BINARY = "ply\nformat binary_little_endian 1.0\n"
VERTEX = "property float x\nproperty float y\nproperty float z\n"
LIST = "property list uchar int vertex_indices\n"
STL = struct.pack("<I", 2**32 - 1)

REFUSED: dict[str, Writer] = {
    "stl promising": file("thing.stl", bytes(80) + STL + bytes(16)),
    "stl promising text": file("thing.stl", b"solid x" + bytes(73) + STL + bytes(16)),
    "stl endless": endless_file("thing.stl"),
    "obj endless": endless_file("thing.obj"),
    "glb endless": endless_file("thing.glb"),
    "stl device": link("thing.stl", "/dev/zero"),
    "stl of nan": file("thing.stl", bytes(80) + struct.pack("<I", 4) + b"\0\0\xc0\x7f" * 50),
    "stl of inf": file("thing.stl", bytes(80) + struct.pack("<I", 4) + b"\0\0\x80\x7f" * 50),
    "obj of 1e300": file("thing.obj", OBJ.replace("0.1", "1e300")),
    "obj of 1e400": file("thing.obj", OBJ.replace("0.1", "1e400")),
    "obj of nan": file("thing.obj", OBJ.replace("0.1", "nan")),
    "obj of denormals": file("thing.obj", OBJ.replace("0.1", "5e-324")),
    "obj far index": file("thing.obj", OBJ + "f 1 2 2147483648\n"),
    "obj farther index": file("thing.obj", OBJ + f"f 1 2 {10**40}\n"),
    "obj index below": file("thing.obj", OBJ + "f 1 2 -9223372036854775808\n"),
    "obj no index": file("thing.obj", OBJ + "f 0 0 0\nf // // //\n"),
    "obj wide face": file("thing.obj", OBJ + "f" + " 1 2 3" * 300_000 + "\n"),
    "obj long line": file("thing.obj", OBJ + "v " + "1" * 20_000_000 + "\n"),
    "off counts": file("thing.off", "OFF\n4000000000 4000000000 0\n0 0 0\n"),
    "off negative": file("thing.off", "OFF\n-1 -1 0\n0 0 0\n"),
    "ply vertices": ply(BINARY + "element vertex 4000000000\n" + VERTEX + "element face 1\n" + LIST),
    "ply vertices 2^63": ply(BINARY + f"element vertex {2**63}\n" + VERTEX + "element face 1\n" + LIST),
    "ply negative": ply(BINARY + "element vertex -5\n" + VERTEX + "element face -1\n" + LIST),
    "ply faces": ply(BINARY + "element vertex 4\n" + VERTEX + "element face 4000000000\n" + LIST),
    "ply list": ply(
        BINARY + "element vertex 1\n" + VERTEX + "element face 2\n" + LIST.replace("uchar", "uint"),
        bytes(12) + b"\xff" * 60,
    ),
    "ply empty elements": ply(BINARY + "element vertex 4000000000\nelement face 1\n" + LIST),
    "ply ascii counts": ply(
        "ply\nformat ascii 1.0\nelement vertex 4000000000\n" + VERTEX + "element face 4000000000\n" + LIST, b"0 0 0\n"
    ),
    "ply properties": ply(
        BINARY + "element vertex 1\n" + "".join(f"property double p{i}\n" for i in range(200_000)) + "element face 1\n"
    ),
    "glb circle": changed_glb(circle),
    "glb instances": changed_glb(instances),
    "glb chain": changed_glb(chain),
    "glb primitives": changed_glb(primitives),
    "glb accessors": many_accessors(4_000_000_000),
    "glb negative accessors": many_accessors(-1),
    "glb no view": changed_glb(no_view),
    "glb deep": deep_extras,
    "glb draco": changed_glb(draco),
    "glb far buffer": far_buffer("../../../../../../etc/passwd"),
    "glb absolute buffer": far_buffer("/etc/passwd"),
    "glb address": far_buffer("http://127.0.0.1:9/a.bin"),
    "glb buffer beside": far_buffer("beside.bin"),
    "glb file address": far_buffer("file:///etc/passwd"),
    "glb bad data": far_buffer("data:application/octet-stream;base64,!!!!"),
    "glb lengths": file("thing.glb", struct.pack("<IIIII", 0x46546C67, 2, 2**32 - 1, 2**32 - 1, GLB_JSON) + b"{}"),
    "gltf elsewhere": file(
        "thing.gltf", '{"asset": {"version": "2.0"}, "buffers": [{"uri": "../../../etc/passwd", "byteLength": 64}]}'
    ),
    "glb zipped": file("thing.glb", zip_bomb("a.stl", 1 << 20)),
}

#: What has a harmless part that clench reads: it is loaded, and nothing else is touched.
HARMLESS: dict[str, Writer] = {
    "obj many objects": file("thing.obj", "".join(f"o o{i}\nusemtl m{i}\n{OBJ[-36:]}" for i in range(60_000)) + OBJ),
    "obj continued": file("thing.obj", OBJ + "\\\n" * 2_000_000),
    "off wide face": file("thing.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n"),
    "ply texture": file(
        "thing.ply",
        f"ply\nformat ascii 1.0\ncomment TextureFile big.png\nelement vertex 3\n{VERTEX}element face 1\n{LIST}"
        "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
        ("big.png", png(60_000, 60_000)),
    ),
    "glb doubling": changed_glb(doubling),
    "glb doubling pairs": changed_glb(doubling_pairs),
    "glb long chain": changed_glb(long_chain),
    "obj library": file("thing.obj", "mtllib /etc/passwd\nmtllib ../../x.mtl\nmtllib http://127.0.0.1:9/x\n" + OBJ),
    "obj texture": file(
        "thing.obj",
        "mtllib a.mtl\nusemtl m\n" + OBJ,
        ("a.mtl", b"newmtl m\nmap_Kd big.png\n"),
        ("big.png", png(60_000, 60_000)),
    ),
    "glb picture": picture(None, png(60_000, 60_000)),
    "glb picture bomb": picture(None, png(30_000, 30_000, zlib.compress(bytes(1 << 28), 9))),
    "glb picture elsewhere": picture("/etc/passwd"),
    "glb picture far": picture("http://127.0.0.1:9/a.png"),
}
