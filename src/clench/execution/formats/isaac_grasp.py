"""The isaac_grasp YAML format, version 1.0: the gripper's frame in the object's, and named joint angles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from clench.core.exceptions import CommandError, FileError
from clench.core.files.json_files import write_atomically
from clench.core.files.yaml_files import read_yaml
from clench.core.numbers import is_finite_number
from clench.core.pose import Pose

from .grasp_posture import GraspPosture
from .outgoing import OutgoingGrasp, all_of_one

FORMAT: Final = "isaac_grasp"
VERSION: Final = 1.0
#: Spellings in files, as a number or as text.
_VERSIONS: Final = ("1.0", "1")


def write_isaac_grasp(path: str | Path, grasps: Sequence[OutgoingGrasp]) -> None:
    """Write grasps of one hand and object; `gripper_frame` is the link whose pose is written.

    Raises:
        CommandError: grasps of several hands or objects. FileError: the file cannot be written.
    """
    import yaml

    all_of_one([grasp.solution for grasp in grasps], FORMAT)
    document = {
        "format": FORMAT,
        "format_version": VERSION,
        "object_frame": grasps[0].object_name,
        "gripper_frame": grasps[0].frame,
        "grasps": {f"grasp_{i}": _grasp(grasp) for i, grasp in enumerate(grasps)},
    }
    write_atomically(path, yaml.safe_dump(document, sort_keys=False, width=110).encode())


def read_isaac_grasp(path: str | Path) -> list[GraspPosture]:
    """Read grasps with the object at the origin of the world; joint angles may be missing.

    Raises:
        FileError: missing, not YAML, another format, or a malformed key, which the message names.
    """
    data = read_yaml(path)
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise FileError(path, f"format: expected '{FORMAT}'.")
    if str(data.get("format_version")) not in _VERSIONS:
        raise FileError(path, f"format_version: expected {VERSION}, got {data.get('format_version')!r}.")
    frame = data.get("gripper_frame")
    root = frame.rstrip("/").rpartition("/")[2] if isinstance(frame, str) else None  # a path in USD ends with the link
    grasps = data.get("grasps")
    if not isinstance(grasps, dict) or not grasps:
        raise FileError(path, "grasps: expected at least one, by name.")
    return [replace(_posture(str(name), grasp, str(path)), root=root) for name, grasp in grasps.items()]


def _grasp(grasp: OutgoingGrasp) -> dict[str, Any]:
    w, *xyz = grasp.T_object_frame.wxyz.tolist()
    return {
        "confidence": grasp.confidence,
        "position": grasp.T_object_frame.position.tolist(),
        "orientation": {"w": w, "xyz": xyz},
        "cspace_position": dict(grasp.solution.joint_angles),
        "pregrasp_cspace_position": dict(grasp.pregrasp),
    }


def _posture(name: str, grasp: Any, source: str) -> GraspPosture:
    key = f"grasps.{name}"
    if not isinstance(grasp, dict):
        raise FileError(source, f"{key}: expected a mapping, got {grasp!r}.")
    orientation = grasp.get("orientation")
    if not isinstance(orientation, dict) or "w" not in orientation or "xyz" not in orientation:
        raise FileError(source, f"{key}.orientation: expected 'w' and 'xyz'.")
    xyz = orientation["xyz"] if isinstance(orientation["xyz"], list) else []
    try:
        pose = Pose(grasp.get("position", ()), wxyz=[orientation["w"], *xyz], key=key)
    except CommandError as error:
        raise FileError(source, str(error)) from None
    confidence = grasp.get("confidence")
    if confidence is not None and not is_finite_number(confidence):
        raise FileError(source, f"{key}.confidence: expected a number, got {confidence!r}.")
    return GraspPosture(name, pose, joint_angles=_angles(grasp, key, source), confidence=confidence)


def _angles(grasp: Mapping[str, Any], key: str, source: str) -> dict[str, float]:
    angles = grasp.get("cspace_position") or {}
    if not isinstance(angles, dict):
        raise FileError(source, f"{key}.cspace_position: expected angles by joint, got {angles!r}.")
    for joint, angle in angles.items():
        if not is_finite_number(angle):
            raise FileError(source, f"{key}.cspace_position.{joint}: expected a finite number in rad, got {angle!r}.")
    return {str(joint): float(angle) for joint, angle in angles.items()}
