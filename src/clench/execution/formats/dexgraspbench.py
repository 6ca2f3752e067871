"""DexGraspBench's npy files: one pickled dictionary of postures; read without running anything that a file says."""

from __future__ import annotations

import io
import os
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from clench.core.exceptions import CommandError, FileError
from clench.core.files.file_bytes import read_file
from clench.core.files.file_limits import PICKLE_BYTES
from clench.core.files.json_files import write_atomically
from clench.core.numbers import real_array
from clench.core.pose import FloatArray, Pose
from clench.solver.solution import GraspSolution

from .grasp_posture import BASE, GraspPosture
from .inert_pickle import read_pickled_arrays
from .outgoing import OutgoingGrasp

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
    if not (os.path.isfile(model) or len(model.parts) > 1):
        return ""
    return str(next((folder for folder in model.parents if os.path.isfile(folder / _MARK)), model.parent))


def read_dexgraspbench(path: str | Path) -> list[GraspPosture]:
    """Read the grasp postures; of a stack of grasps, all. Their root is "world" unless the file says otherwise.

    Raises:
        FileError: missing, not an npy file, a pickle that asks for more than arrays, or a malformed key.
    """
    document = read_pickled_arrays(read_file(path, PICKLE_BYTES), str(path))
    names, root = document.get("joint_names"), document.get("root", BASE)
    if not isinstance(root, str):
        raise FileError(path, f"root: expected the name of a link, got {root!r}.")
    rows = np.atleast_2d(_numbers(document, "grasp_qpos", str(path)))
    objects = np.atleast_2d(_numbers(document, "obj_pose", str(path), (1.0, 0.0, 0.0, 0.0)))
    if rows.ndim != 2 or rows.shape[1] < 7 or not len(rows):
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
    if value is None:
        raise FileError(source, f"{key}: missing.")
    numbers = real_array(value)
    if numbers is None or not np.isfinite(numbers).all():
        raise FileError(source, f"{key}: expected {'finite ' if numbers is not None else ''}numbers.")
    return numbers


def _pose(pose: Pose) -> FloatArray:
    return np.concatenate([pose.position, pose.wxyz])
