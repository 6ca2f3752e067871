"""DexGraspBench's npy files: one pickled dictionary of postures; read without running anything that a file says."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any, Final

import numpy as np

from clench.base.errors import CommandError, FileError
from clench.base.file_limits import PICKLE_BYTES
from clench.base.files import read_file
from clench.base.json_files import write_atomically
from clench.base.numbers import real_array
from clench.base.pose import FloatArray, Pose
from clench.solve.solution import GraspSolution

from .grasp_posture import GraspPosture, before_the_grasp, squeezed
from .inert_pickle import read_pickled_arrays

_POSTURES: Final = ("pregrasp_qpos", "grasp_qpos", "squeeze_qpos")


def write_dexgraspbench(path: str | Path, solution: GraspSolution) -> None:
    """Write a solution: the palm's pose (position, then wxyz) and the joints in the order of `joint_names`.

    Without a squeeze plan the squeeze posture is the grasp itself. `joint_names` and the palm as the root of the
    postures are ours; DexGraspBench reads by key and leaves other keys alone.

    Raises:
        FileError: the file cannot be written.
    """
    palm = _pose(solution.hand_pose)
    names = list(solution.joint_angles)
    postures = (before_the_grasp(solution), solution.joint_angles, squeezed(solution))
    document = {
        "obj_pose": _pose(solution.object_pose),
        "obj_scale": 1.0,
        "obj_path": solution.object_model,
        **{
            key: np.concatenate([palm, [angles[name] for name in names]])
            for key, angles in zip(_POSTURES, postures, strict=True)
        },
        "joint_names": names,
    }
    content = io.BytesIO()
    np.save(content, np.array(document, dtype=object), allow_pickle=True)
    write_atomically(path, content.getvalue())


def read_dexgraspbench(path: str | Path) -> list[GraspPosture]:
    """Read the grasp postures; of a stack of grasps, all.

    Raises:
        FileError: missing, not an npy file, a pickle that asks for more than arrays, or a malformed key.
    """
    document = read_pickled_arrays(read_file(path, PICKLE_BYTES), str(path))
    names = document.get("joint_names")
    rows = np.atleast_2d(_numbers(document, "grasp_qpos", str(path)))
    objects = np.atleast_2d(_numbers(document, "obj_pose", str(path), (1.0, 0.0, 0.0, 0.0)))
    if rows.ndim != 2 or rows.shape[1] < 7 or not len(rows):
        raise FileError(path, f"grasp_qpos: expected 7 numbers of the palm and the joints, got shape {rows.shape}.")
    if objects.shape not in ((1, 7), (len(rows), 7)):
        raise FileError(path, f"obj_pose: expected position and wxyz, got shape {objects.shape}.")
    objects = np.broadcast_to(objects, (len(rows), 7))
    return [_posture(k, row, place, names, str(path)) for k, (row, place) in enumerate(zip(rows, objects, strict=True))]


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
