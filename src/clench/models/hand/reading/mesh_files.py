"""Read mesh files of hand models as bytes that MuJoCo understands (OBJ, STL, MSH; others are converted)."""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Iterable
from pathlib import Path

from clench.core.exceptions import FileError
from clench.core.files.file_bytes import read_file
from clench.core.files.file_limits import ASSET_BYTES, MESH_BYTES
from clench.models.mesh_parsing import PARSED, MeshError, parse_mesh

from .png_checks import PNG, checked_png

_NATIVE = (".obj", ".stl", ".msh")
#: MuJoCo refuses larger STL files; OBJ has no such limit.
_STL_FACES = 200_000


class MeshStore:
    """Collect files under short keys, each file once.

    Args:
        model: the model file that names them, for messages.
    """

    def __init__(self, model: Path) -> None:
        self.model = model
        self.assets: dict[str, bytes] = {}
        self._keys: dict[Path, str] = {}
        self._size = 0

    def add(self, named: str, candidates: Iterable[Path], owner: str, *, is_mesh: bool = True) -> str:
        """Read the first candidate that exists and return its key.

        Args:
            named: the file as the model writes it. candidates: places to look.
            owner: the element that names it, for messages.
            is_mesh: convert formats that MuJoCo does not read.

        Raises:
            FileError: none exists, or it cannot be converted.
        """
        places = list(candidates)
        file = next((p for p in places if os.path.isfile(p)), None)
        if file is None:
            looked = ", ".join(str(p) for p in places[:3])
            kind = "mesh" if is_mesh else "file"
            raise FileError(self.model, f"{kind} '{named}' of {owner} is missing; looked for {looked}.")
        file = file.resolve()
        if file not in self._keys:
            data = read_file(file, MESH_BYTES)
            self._size += len(data)
            if self._size > ASSET_BYTES:
                raise FileError(self.model, f"its meshes and textures have more than {ASSET_BYTES >> 20} MB together.")
            suffix = file.suffix.lower()
            if data.startswith(PNG):
                data = self._picture(data, file, owner)
            if is_mesh:
                data, suffix = self._native(data, suffix, file, owner)
            stem = re.sub(r"[^A-Za-z0-9_.-]", "_", file.stem)
            key = f"{stem}{suffix}"
            if key in self.assets:
                key = f"{stem}_{len(self.assets)}{suffix}"
            self.assets[key] = data
            self._keys[file] = key
        return self._keys[file]

    def _native(self, data: bytes, suffix: str, file: Path, owner: str) -> tuple[bytes, str]:
        if not data:
            raise FileError(self.model, f"mesh '{file.name}' of {owner} is empty.")
        if suffix in _NATIVE and not (suffix == ".stl" and _unreadable_stl(data)):
            return data, suffix
        if suffix not in PARSED:
            expected = ", ".join(sorted({*PARSED, *_NATIVE}))
            raise FileError(self.model, f"mesh '{file.name}' of {owner}: expected one of {expected}.")
        try:
            return _converted(data, suffix)
        except (MeshError, FileError, ValueError) as error:
            raise FileError(self.model, f"mesh '{file.name}' of {owner} cannot be read ({error}).") from None

    def _picture(self, data: bytes, file: Path, owner: str) -> bytes:
        try:
            return checked_png(data)
        except ValueError as error:
            raise FileError(self.model, f"picture '{file.name}' of {owner}: {error}.") from None


def _unreadable_stl(data: bytes) -> bool:
    """Return whether MuJoCo would refuse an STL file: text form, or too many faces."""
    if len(data) < 84:
        return True
    faces = int(struct.unpack("<I", data[80:84])[0])
    return len(data) != 84 + 50 * faces or faces > _STL_FACES


def _converted(data: bytes, suffix: str) -> tuple[bytes, str]:
    """Convert a mesh file of the other kinds to STL or, when large, OBJ; scene transforms are applied.

    MuJoCo keeps vertices in single precision, as STL does, and merges coincident ones.
    """
    import io

    import numpy as np
    import trimesh

    mesh = parse_mesh(data, suffix)
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        raise ValueError("it holds no triangles")
    if len(mesh.faces) <= _STL_FACES:
        return bytes(trimesh.exchange.stl.export_stl(mesh)), ".stl"
    out = io.StringIO()
    np.savetxt(out, mesh.vertices, fmt="v %.17g %.17g %.17g")
    np.savetxt(out, mesh.faces + 1, fmt="f %d %d %d")
    return out.getvalue().encode(), ".obj"
