"""DexGraspBench's npy files: one pickled dictionary of postures; read without running anything that a file says."""

from __future__ import annotations

import io
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from clench.base.errors import CommandError, FileError
from clench.base.json_files import write_atomically
from clench.base.pose import FloatArray, Pose
from clench.solve.solution import GraspSolution

from .grasp_posture import BASE, GraspPosture
from .outgoing import OutgoingGrasp

#: What a file of arrays, numbers and names needs; nothing else is looked up, let alone called.
_ALLOWED: Final = {
    *((module, "_reconstruct") for module in ("numpy.core.multiarray", "numpy._core.multiarray")),
    *((module, "scalar") for module in ("numpy.core.multiarray", "numpy._core.multiarray")),
    *((module, "_frombuffer") for module in ("numpy.core.numeric", "numpy._core.numeric")),
    ("numpy", "ndarray"),
    ("numpy", "dtype"),
}
_POSTURES: Final = ("pregrasp_qpos", "grasp_qpos", "squeeze_qpos")


#: File that marks the folder of an object of DexGraspBench.
_MARK: Final = Path("info") / "simplified.json"


def write_dexgraspbench(path: str | Path, grasp: OutgoingGrasp) -> None:
    """Write a grasp: pose of the frame (position, then wxyz), then the joints that it carries, in the model's order.

    `joint_names` and `root` are ours; DexGraspBench reads by key and leaves other keys alone.

    Raises:
        FileError: the file cannot be written.
    """
    root = _pose(grasp.T_world_frame)
    postures = (grasp.pregrasp, grasp.solution.joint_angles, grasp.squeezed)
    document = {
        "obj_pose": _pose(grasp.solution.object_pose),
        "obj_scale": float(grasp.solution.object_scale),
        "obj_path": object_folder(grasp.solution),
        **{
            key: np.concatenate([root, [angles[name] for name in grasp.joints]])
            for key, angles in zip(_POSTURES, postures, strict=True)
        },
        "joint_names": list(grasp.joints),
        "root": grasp.frame,
    }
    content = io.BytesIO()
    np.save(content, np.array(document, dtype=object), allow_pickle=True)
    write_atomically(path, content.getvalue())


def object_folder(solution: GraspSolution) -> str:
    """Return the folder of the object's model: the nearest one with DexGraspBench's info, else the file's own.

    It is empty for an object that was not read from a file.
    """
    model = Path(solution.object_model)
    if not (model.is_file() or len(model.parts) > 1):
        return ""
    return str(next((folder for folder in model.parents if (folder / _MARK).is_file()), model.parent))


def read_dexgraspbench(path: str | Path) -> list[GraspPosture]:
    """Read the grasp postures; of a stack of grasps, all. Their root is "world" unless the file says otherwise.

    Raises:
        FileError: missing, not an npy file, a pickle that asks for more than arrays, or a malformed key.
    """
    try:
        content = Path(path).read_bytes()
    except FileNotFoundError:
        raise FileError(path, "no such file.") from None
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror or error}).") from None
    document = _unpickled(content, str(path))
    if not isinstance(document, dict):
        raise FileError(path, f"expected a dictionary, got {type(document).__name__}.")
    names, root = document.get("joint_names"), document.get("root", BASE)
    if not isinstance(root, str):
        raise FileError(path, f"root: expected the name of a link, got {root!r}.")
    rows = np.atleast_2d(_numbers(document, "grasp_qpos", str(path)))
    objects = np.atleast_2d(_numbers(document, "obj_pose", str(path), (1.0, 0.0, 0.0, 0.0)))
    if rows.ndim != 2 or rows.shape[1] < 7:
        raise FileError(path, f"grasp_qpos: expected 7 numbers of the palm and the joints, got shape {rows.shape}.")
    if objects.shape not in ((1, 7), (len(rows), 7)):
        raise FileError(path, f"obj_pose: expected position and wxyz, got shape {objects.shape}.")
    objects = np.broadcast_to(objects, (len(rows), 7))
    read = (_posture(k, *each, names, str(path)) for k, each in enumerate(zip(rows, objects, strict=True)))
    return [replace(grasp, root=root) for grasp in read]


def _posture(number: int, row: FloatArray, place: FloatArray, names: Any, source: str) -> GraspPosture:
    angles: Any = row[7:].tolist()
    if names is not None:
        if not isinstance(names, list) or len(names) != len(angles) or not all(isinstance(n, str) for n in names):
            raise FileError(source, f"joint_names: expected {len(angles)} names.")
        angles = dict(zip(names, angles, strict=True))
    try:
        hand = Pose(row[:3], wxyz=row[3:7], key=f"grasp_qpos[{number}]")
        return GraspPosture(f"grasp_{number}", hand, Pose(place[:3], wxyz=place[3:], key="obj_pose"), angles)
    except CommandError as error:
        raise FileError(source, str(error)) from None


def _numbers(document: dict[Any, Any], key: str, source: str, default_wxyz: tuple[float, ...] = ()) -> FloatArray:
    value = document.get(key, (0.0, 0.0, 0.0, *default_wxyz) if default_wxyz else None)
    try:
        numbers = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise FileError(source, f"{key}: expected numbers.") from None
    if value is None or not np.isfinite(numbers).all():
        raise FileError(source, f"{key}: {'missing' if value is None else 'expected finite numbers'}.")
    return numbers


def _unpickled(content: bytes, source: str) -> Any:
    stream = io.BytesIO(content)
    try:
        version = np.lib.format.read_magic(stream)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = read(stream)
    except (ValueError, OSError, EOFError) as error:
        raise FileError(source, f"not an npy file ({error}).") from None
    if shape != () or not dtype.hasobject:
        raise FileError(source, f"expected one pickled dictionary, got an array of shape {shape}.")
    try:
        loaded = _ArraysOnly(stream).load()
    except pickle.UnpicklingError as error:
        raise FileError(source, f"is refused: {error}.") from None
    except Exception as error:  # a damaged pickle can fail in any way
        raise FileError(source, f"the pickle is damaged ({type(error).__name__}: {error}).") from None
    return loaded.item() if isinstance(loaded, np.ndarray) and loaded.shape == () else loaded


class _ArraysOnly(pickle.Unpickler):
    """Refuse whatever is no array, number, text, list or dictionary."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in _ALLOWED:
            raise pickle.UnpicklingError(f"the pickle asks for '{module}.{name}', which no grasp needs")
        return super().find_class(module, name)


def _pose(pose: Pose) -> FloatArray:
    return np.concatenate([pose.position, pose.wxyz])
