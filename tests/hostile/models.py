"""Hand models that were made to do harm, by name: each writes its files into a folder and returns the one to load."""

import os
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

from fuzz.originals import MJCF, URDF, link_stl

from .bombs import packed_zeros

Writer = Callable[[Path], Path]


def written(folder: Path, text: str | bytes, name: str = "hand.xml") -> Path:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    (folder / "link.stl").write_bytes(link_stl())
    return path


def mjcf(old: str = "", new: str = "", head: str = "") -> Writer:
    """Return a writer of the good MJCF hand with one piece replaced, and one added at its beginning."""
    assert old in MJCF
    text = (MJCF.replace(old, new) if old else MJCF).replace("<compiler", f"{head}<compiler", 1)
    return lambda folder: written(folder, text)


def urdf(old: str, new: str) -> Writer:
    assert old in URDF
    return lambda folder: written(folder, URDF.replace(old, new), "hand.urdf")


def with_file(writer: Writer, name: str, data: bytes) -> Writer:
    def write(folder: Path) -> Path:
        (folder / name).write_bytes(data)
        return writer(folder)

    return write


def png(width: int, height: int, body: bytes = b"") -> bytes:
    """Return a PNG picture of any size in a few bytes."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = body or zlib.compress(bytes(1 << 20), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def include_bomb(folder: Path) -> Path:
    for i in range(20):
        inside = f'<include file="{i + 1}.xml"/>' * 2 if i < 19 else "<size/>"
        (folder / f"{i}.xml").write_text(f"<mujoco>{inside}</mujoco>")
    return folder / "0.xml"


def includes_itself(folder: Path) -> Path:
    return written(folder, '<mujoco><include file="hand.xml"/></mujoco>')


def includes_often(folder: Path) -> Path:
    (folder / "part.xml").write_text("<mujocoinclude>" + "<key/>" * 20_000 + "</mujocoinclude>")
    return written(folder, "<mujoco>" + '<keyframe><include file="part.xml"/></keyframe>' * 2000 + "</mujoco>")


def includes_a_device(folder: Path) -> Path:
    (folder / "endless.xml").symlink_to("/dev/zero")
    return written(folder, '<mujoco><include file="endless.xml"/></mujoco>')


def linked_to_a_device(folder: Path) -> Path:
    path = mjcf()(folder)
    (folder / "link.stl").unlink()
    (folder / "link.stl").symlink_to("/dev/zero")
    return path


def linked_mesh(target: str, named: str = "link.stl") -> Writer:
    """Return a writer of a URDF whose mesh is a symbolic link."""

    def write(folder: Path) -> Path:
        path = urdf("link.stl", named)(folder)
        (folder / "link.stl").unlink()
        (folder / "link.stl").symlink_to(target)
        return path

    return write


def mesh_from_a_pipe(folder: Path) -> Path:
    path = urdf("link.stl", "package://hand/link.stl")(folder)
    (folder / "link.stl").unlink()
    os.mkfifo(folder / "link.stl")
    return path


def endless_file(name: str, size: int = 1 << 40) -> Writer:
    """Return a writer of a file that takes no room on the disk and says that it has a terabyte."""

    def write(folder: Path) -> Path:
        path = folder / name
        with path.open("wb") as file:
            file.truncate(size)
        return path

    return write


def endless_mesh(folder: Path) -> Path:
    path = mjcf()(folder)
    with (folder / "link.stl").open("wb") as file:
        file.truncate(1 << 40)
    return path


def many_large_meshes(folder: Path) -> Path:
    faces = 150_000
    for i in range(120):
        with (folder / f"{i}.stl").open("wb") as mesh:
            mesh.write(bytes(80) + struct.pack("<I", faces))
            mesh.truncate(84 + 50 * faces)
    return written(
        folder, MJCF.replace("</asset>", "".join(f'<mesh file="{i}.stl"/>' for i in range(120)) + "</asset>")
    )


LAUGHS = "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10 if i else "ha"}">' for i in range(10))


def collada_copies() -> bytes:
    """Return a scene whose nodes hold two copies of the next node each."""
    copies = [f"<instance_node url='#n{i + 1}'/>" * 2 for i in range(40)]
    nodes = "".join(f'<node id="n{i}">{copy}</node>' for i, copy in enumerate(copies))
    text = f'<library_nodes>{nodes}<node id="n40"/></library_nodes>'
    return f'<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">{text}</COLLADA>'.encode()


def laughs(folder: Path) -> Path:
    return written(folder, f'<!DOCTYPE mujoco [{LAUGHS}]><mujoco model="&a9;"/>')


def outside_entity(folder: Path) -> Path:
    return written(folder, '<!DOCTYPE mujoco [<!ENTITY x SYSTEM "file:///etc/passwd">]><mujoco model="p">&x;</mujoco>')


def quadratic(folder: Path) -> Path:
    return written(folder, f'<!DOCTYPE mujoco [<!ENTITY a "{"a" * 100_000}">]><mujoco model="{"&a;" * 20_000}"/>')


def nested(tag: str, depth: int, suffix: str = ".xml") -> Writer:
    root = "mujoco" if suffix == ".xml" else "robot"
    text = f'<{root} name="x">' + f"<{tag}>" * depth + f"</{tag}>" * depth + f"</{root}>"
    return lambda folder: written(folder, text, f"hand{suffix}")


def nested_bodies(depth: int) -> Writer:
    body = '<body><joint axis="0 1 0"/><geom size="0.01"/>' * depth + "</body>" * depth
    return lambda folder: written(folder, f"<mujoco><worldbody>{body}</worldbody></mujoco>")


def long_chain(folder: Path) -> Path:
    count = 20_000
    links = "".join(f'<link name="l{i}"/>' for i in range(count))
    joints = "".join(
        f'<joint name="j{i}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/><axis xyz="0 0 1"/>'
        '<limit lower="0" upper="1" effort="1" velocity="1"/></joint>'
        for i in range(count - 1)
    )
    return written(folder, f'<robot name="long">{links}{joints}</robot>', "hand.urdf")


def picture_that_unpacks(folder: Path) -> Path:
    """Write a small picture whose packed data are a gigabyte."""
    size = 1 << 30
    checksum = struct.pack(">I", size % 65_521 << 16 | 1)  # Adler-32 of so many zeros
    (folder / "t.png").write_bytes(png(64, 64, packed_zeros(size, zlib.MAX_WBITS)[:-4] + checksum))
    return mjcf(head=TEXTURE)(folder)


def mimic_circle(folder: Path) -> Path:
    limit = '<limit lower="-0.2" upper="1.5" effort="1" velocity="3"/></joint>'
    text = URDF.replace(limit, limit.replace("</joint>", '<mimic joint="index_b"/></joint>'))
    text = text.replace('<mimic joint="index_a"', '<mimic joint="thumb_a"')
    return written(folder, text, "hand.urdf")


TEXTURE = '<asset><texture name="t" type="2d" file="t.png"/><material name="m" texture="t"/></asset>'
BODY = '<body name="palm" pos="0 0 0">'
GEOM = '<geom type="ellipsoid" size="0.03 0.01 0.01" pos="0.02 0 0"/>'
PLUGIN = '<extension><plugin plugin="{}"><instance name="i"/></plugin></extension>'

REFUSED: dict[str, Writer] = {
    "include bomb": include_bomb,
    "includes itself": includes_itself,
    "includes often": includes_often,
    "includes a device": includes_a_device,
    "includes /etc/passwd": mjcf(head='<include file="/etc/passwd"/>'),
    "includes an address": mjcf(head='<include file="http://127.0.0.1:9/x.xml"/>'),
    "linked to a device": linked_to_a_device,
    "endless urdf": endless_file("hand.urdf"),
    "endless mjcf": endless_file("hand.xml"),
    "endless mesh": endless_mesh,
    "many large meshes": many_large_meshes,
    "billion laughs": laughs,
    "entity from a file": outside_entity,
    "quadratic entities": quadratic,
    "deep mjcf": nested("default", 200_000),
    "deep urdf": nested("link", 200_000, ".urdf"),
    "deepest": nested("a", 1_100_000),
    "wide": lambda folder: written(folder, "<mujoco>" + "<a/>" * 2_000_000 + "</mujoco>"),
    "deep bodies": nested_bodies(3000),
    "deeper bodies": nested_bodies(100_000),
    "long chain": long_chain,
    "mimic circle": mimic_circle,
    "replicate": mjcf(BODY, f'<replicate count="100000000"><geom size="0.01"/></replicate>{BODY}'),
    "replicate in replicate": mjcf(
        BODY,
        '<replicate count="100">' * 6 + '<geom size="0.01"/>' + "</replicate>" * 6 + BODY,
    ),
    "replicate no number": mjcf(BODY, f'<replicate count="1e8"><geom size="0.01"/></replicate>{BODY}'),
    "composite": mjcf(
        BODY,
        '<composite type="cable" count="100000000 1 1" size="1"><geom size="0.01"/></composite>' + BODY,
    ),
    "flexcomp": mjcf(
        BODY,
        '<flexcomp name="f" type="grid" count="2000 2000 2000" spacing=".1 .1 .1" dim="3"/>' + BODY,
    ),
    "texture 60000": with_file(mjcf(head=TEXTURE), "t.png", png(60_000, 60_000)),
    "texture 2^31": with_file(mjcf(head=TEXTURE), "t.png", png(2**31 - 1, 2**31 - 1)),
    "texture that unpacks": picture_that_unpacks,
    "texture of a cube": with_file(
        mjcf(head='<asset><texture name="t" type="cube" fileright="t.png"/></asset>'), "t.png", png(60_000, 60_000)
    ),
    "texture of numbers": with_file(
        mjcf(head=TEXTURE.replace("t.png", "t.bin")), "t.bin", struct.pack("<ii", 60_000, 60_000)
    ),
    "texture built in": mjcf(
        head='<asset><texture name="t" type="2d" builtin="flat" width="60000" height="60000"/></asset>'
    ),
    "height field": mjcf(head='<asset><hfield name="h" nrow="60000" ncol="60000" size="1 1 1 1"/></asset>'),
    "height field file": with_file(
        mjcf(head='<asset><hfield name="h" file="h.bin" size="1 1 1 1"/></asset>'),
        "h.bin",
        struct.pack("<ii", 60_000, 60_000),
    ),
    "height field png": with_file(
        mjcf(head='<asset><hfield name="h" file="h.png" size="1 1 1 1"/></asset>'), "h.png", png(60_000, 60_000)
    ),
    "skin": with_file(
        mjcf(head='<asset><skin name="s" file="s.skn"/></asset>'), "s.skn", struct.pack("<iiii", *[2**31 - 1] * 4)
    ),
    "msh": with_file(
        mjcf("link.stl", "l.msh"), "l.msh", struct.pack("<iiii", 2**31 - 1, 2**31 - 1, 2**31 - 1, 2**31 - 1)
    ),
    "msh of negative counts": with_file(mjcf("link.stl", "l.msh"), "l.msh", struct.pack("<iiii", -1, -1, -1, -1)),
    "obj with far indices": with_file(
        mjcf("link.stl", "l.obj"), "l.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 2147483647\nf -9 -8 1\n"
    ),
    "obj with a library": with_file(
        mjcf("link.stl", "l.obj"),
        "l.obj",
        b"mtllib /etc/passwd\nmtllib http://127.0.0.1:9/a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
        b"f 1 2 9\nf 1 2 4\nf 2 3 4\nf 1 3 4\n",
    ),
    "obj of nan": with_file(
        mjcf("link.stl", "l.obj"),
        "l.obj",
        b"v nan 0 0\nv 1 0 0\nv 0 inf 0\nv 0 0 1e300\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 1 3 4\n",
    ),
    "stl promising": with_file(
        mjcf("link.stl", "l.stl"), "l.stl", bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(16)
    ),
    "stl of nan": with_file(
        mjcf("link.stl", "l.stl"), "l.stl", bytes(80) + struct.pack("<I", 4) + b"\0\0\xc0\x7f" * 50
    ),
    "memory": mjcf(head='<size memory="100000G"/>'),
    "sizes": mjcf(head='<size nuserdata="2000000000" nkey="2000000000"/>'),
    "user sensor": mjcf(head='<sensor><user name="u" dim="2000000000"/></sensor>'),
    "plugin file": mjcf(head=PLUGIN.format("/tmp/evil.so")),
    "model asset": mjcf(head='<asset><model name="m" file="/etc/passwd"/></asset>'),
    "attach itself": mjcf(
        BODY,
        f'<body><attach model="m" body="palm" prefix="x"/></body>{BODY}',
        head='<asset><model name="m" file="hand.xml"/></asset>',
    ),
    "mass nan": mjcf(GEOM, GEOM.replace("/>", ' mass="nan"/>')),
    "mass inf": mjcf(GEOM, GEOM.replace("/>", ' mass="inf"/>')),
    "mass huge": mjcf(GEOM, GEOM.replace("/>", ' mass="1e300"/>')),
    "mass negative": mjcf(GEOM, GEOM.replace("/>", ' mass="-1"/>')),
    "density huge": mjcf(GEOM, GEOM.replace("/>", ' density="1e300"/>')),
    "friction nan": mjcf(GEOM, GEOM.replace("/>", ' friction="nan nan nan"/>')),
    "armature inf": mjcf('damping="0.1"', 'damping="0.1" armature="inf"'),
    "damping nan": mjcf('damping="0.1"', 'damping="nan"'),
    "stiffness huge": mjcf('damping="0.1"', 'stiffness="1e300"'),
    "gain nan": mjcf('kp="3" ctrl', 'kp="nan" ctrl'),
    "force range inf": mjcf('forcerange="-1 1"', 'forcerange="-inf nan"'),
    "timestep nan": mjcf(head='<option timestep="nan" gravity="nan 0 0"/>'),
    "range huge": mjcf('range="0 1.4"', 'range="-1e300 1e300"'),
    "position huge": mjcf('pos="0.04 0 0"', 'pos="1e300 0 0"'),
    "urdf mass nan": urdf('mass value="0.02"', 'mass value="nan"'),
    "urdf mass inf": urdf('mass value="0.02"', 'mass value="inf"'),
    "urdf mass huge": urdf('mass value="0.02"', 'mass value="1e300"'),
    "urdf mass negative": urdf('mass value="0.02"', 'mass value="-5"'),
    "urdf inertia": urdf('ixx="1e-5"', 'ixx="nan"'),
    "urdf inertia huge": urdf('ixx="1e-5"', 'ixx="1e300"'),
    "urdf effort nan": urdf('effort="1"', 'effort="nan"'),
    "urdf velocity nan": urdf('velocity="3"', 'velocity="nan"'),
    "urdf limit inf": urdf('upper="1.5"', 'upper="inf"'),
    "urdf limit huge": urdf('upper="1.5"', 'upper="1e300"'),
    "urdf damping": urdf('<limit lower="-0.2"', '<dynamics damping="nan" friction="inf"/><limit lower="-0.2"'),
    "urdf far mesh": urdf("link.stl", "http://127.0.0.1:9/link.stl"),
    "urdf package of the system": urdf("link.stl", "package://etc/passwd"),
    "urdf package of a device": urdf("link.stl", "package://hand/../../../../../../../../dev/zero"),
    "urdf package of a linked device": linked_mesh("/dev/zero", "package://hand/link.stl"),
    "urdf package of a pipe": mesh_from_a_pipe,
    "urdf package climbing": urdf("link.stl", "package://../../../../../../../../etc/passwd"),
    "urdf package of nothing": urdf("link.stl", "package://"),
    "urdf package of long names": urdf("link.stl", "package://" + "a/" * 100_000 + "b.stl"),
    "urdf linked device": linked_mesh("/dev/zero"),
    "urdf linked to itself": linked_mesh("link.stl"),
    "urdf linked to a text": linked_mesh("/etc/passwd"),
    "urdf linked to a folder": linked_mesh("/"),
    "urdf file of a device": urdf("link.stl", "file:///dev/zero"),
    "urdf long name": urdf("link.stl", "a" * 5000 + ".stl"),
    "mjcf long name": mjcf("link.stl", "a" * 5000 + ".stl"),
    "includes a long name": mjcf(head=f'<include file="{"a" * 5000}.xml"/>'),
    "urdf gltf elsewhere": with_file(
        urdf("link.stl", "l.gltf"),
        "l.gltf",
        b'{"asset": {"version": "2.0"}, "buffers": [{"uri": "/etc/passwd", "byteLength": 64}]}',
    ),
    "urdf 3mf": with_file(urdf("link.stl", "l.3mf"), "l.3mf", b"PK\x03\x04" + bytes(60)),
    "urdf archive": with_file(urdf("link.stl", "l.dae"), "l.dae", b"PK\x03\x04" + bytes(60)),
    "urdf laughing mesh": with_file(
        urdf("link.stl", "l.dae"), "l.dae", f"<!DOCTYPE x [{LAUGHS}]><COLLADA>&a9;</COLLADA>".encode()
    ),
    "urdf mesh of copies": with_file(urdf("link.stl", "l.dae"), "l.dae", collada_copies()),
    "urdf pickle": with_file(urdf("link.stl", "l.pkl"), "l.pkl", b"cos\nsystem\n(S'true'\ntR."),
}

#: What is loaded: it does no harm.
HARMLESS: dict[str, Writer] = {
    "plugin sdf": mjcf(head=PLUGIN.format("mujoco.sdf.torus")),
    "timestep": mjcf(head='<option timestep="1e-300"/>'),
    "urdf effort huge": urdf('effort="1"', 'effort="1e300"'),
    "urdf velocity tiny": urdf('velocity="3"', 'velocity="1e-300"'),
}
