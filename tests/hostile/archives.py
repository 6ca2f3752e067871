"""Batches (.npz) and models of printers (.3mf) that were made to do harm, by name: how each is read, and its writer."""

import io
import json
import os
import zipfile
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from .bombs import zip_bomb
from .data import DEEP, LISTS, header, npy, saved
from .meshes import file, link
from .models import Writer, urdf, with_file


@lru_cache(maxsize=1)
def good_batch() -> dict[str, Any]:
    """Return the arrays of a batch whose poses are grasps."""
    import tempfile

    import clench

    hand, ball = clench.Hand.load("patent15"), clench.GraspObject.load("ball")
    with tempfile.TemporaryDirectory() as folder:
        clench.solve_batch(hand, ball, clench.approach_poses(hand, ball, 2, 0)).save(Path(folder) / "b.npz")
        with np.load(Path(folder) / "b.npz") as arrays:
            return dict(arrays)


def entries(**changed: bytes | None) -> bytes:
    """Return a batch in which entries of the archive are other bytes, or missing where None."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in ({name: saved(array) for name, array in good_batch().items()} | changed).items():
            if data is not None:
                archive.writestr(f"{name}.npy", data)
    return out.getvalue()


def batch(**changed: Any) -> Writer:
    """Return a writer of a batch in which arrays are others."""
    return lambda folder: file("b.npz", entries(**{name: saved(np.array(a)) for name, a in changed.items()}))(folder)


def batch_of(make: Callable[[], bytes]) -> Writer:
    return lambda folder: file("b.npz", make())(folder)


def unpacking(name: str, size: int = 3 << 30) -> bytes:
    """Return a batch one of whose arrays unpacks to gigabytes."""
    head, form = io.BytesIO(), {"descr": "<f8", "fortran_order": False, "shape": (size // 56, 7)}
    np.lib.format.write_array_header_1_0(head, form)
    others = {f"{key}.npy": saved(array) for key, array in good_batch().items() if key != name}
    return zip_bomb(f"{name}.npy", size, head.getvalue(), others)


def claiming(name: str, size: int) -> bytes:
    """Return a batch that says of an entry that it is larger than it is."""
    data = bytearray(entries())
    place = data.rindex(f"{name}.npy".encode()) - 46  # its place in the list of names
    data[place + 24 : place + 28] = size.to_bytes(4, "little")
    return bytes(data)


def named_often(count: int) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for i in range(count):
            archive.writestr(str(i), b"")
    return out.getvalue()


def pipe(folder: Path) -> Path:
    os.mkfifo(folder / "b.npz")
    return folder / "b.npz"


def no_unicode() -> bytes:
    """Return text whose characters have numbers that no character has."""
    return saved(np.frombuffer(b"\xff" * 40, np.dtype("<U5")))


REFUSED: dict[str, tuple[str, Writer]] = {
    "npz that unpacks": ("export", batch_of(lambda: unpacking("hand_poses"))),
    "npz that claims": ("export", batch_of(lambda: claiming("hand_poses", 2**31))),
    "npz huge shape": (
        "export",
        batch_of(lambda: entries(hand_poses=npy(header(shape="(9999999999, 7)")))),
    ),
    "npz named often": ("export", batch_of(lambda: named_often(100_000))),
    "npz device": ("export", link("b.npz", "/dev/zero")),
    "npz pipe": ("export", pipe),
    "npz no archive": ("export", file("b.npz", saved(np.zeros(3)))),
    "npz cut": ("export", batch_of(lambda: entries()[:-30])),
    "npz objects": ("export", batch_of(lambda: entries(status=saved(np.array([{}, {}], dtype=object))))),
    "npz no text": ("export", batch_of(lambda: entries(joint_names=no_unicode()))),
    "npz command deep": ("export", batch(command=LISTS)),
    "npz command deep inside": ("export", batch(command=json.dumps({"next_steps": "DEEP"}).replace('"DEEP"', LISTS))),
    "npz command no object": ("export", batch(command="[1]")),
    "npz command no JSON": ("export", batch(command="{")),
    "npz command planes": ("export", batch(command='{"planes": 1000000000}')),
    "npz many commands": ("export", batch(command=["{}"] * DEEP)),
    "npz command of numbers": ("export", batch(command=1.0)),
    "npz poses text": ("export", batch(hand_poses=[["x"] * 7] * 2)),
    "npz poses nan": ("export", batch(hand_poses=np.full((2, 7), np.nan))),
    "npz poses short": ("export", batch(hand_poses=np.zeros((1, 7)))),
    "npz more grasps": ("export", batch(status=["grasp"] * 1000)),
    "npz angles": ("export", batch(joint_angles=np.full((2, 15), 1e308))),
    "npz names": ("export", batch(joint_names=["a"])),
    "npz preshape": ("export", batch(preshape_joints=["a", "b"])),
    "npz scales": ("export", batch(object_scale=[1.0, 2.0])),
    "npz scale nan": ("export", batch(object_scale=np.nan)),
    "npz source": ("export", batch(object_collision_source="x\x1b[31m")),
    "npz hand of a long name": ("export", batch(hand_model="a" * 5000 + ".xml")),
    "npz object of a long name": ("export", batch(object_model="a" * 5000 + ".stl")),
    "npz hand device": ("export", batch(hand_model="/dev/zero")),
    "npz object address": ("export", batch(object_model="http://127.0.0.1:9/a.stl")),
    "3mf that unpacks": ("thing", lambda folder: file("thing.3mf", zip_bomb("3D/3dmodel.model"))(folder)),
    "3mf as a stl": ("thing", file("thing.stl", zip_bomb("3D/3dmodel.model", 1 << 20))),
    "3mf of a link": (
        "hand",
        lambda folder: with_file(urdf("link.stl", "l.3mf"), "l.3mf", zip_bomb("3D/3dmodel.model"))(folder),
    ),
}
