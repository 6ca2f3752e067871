"""Grasps as JSON in the shape of moveit_msgs/Grasp, message by message and field by field."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import msgspec

from clench.core.exceptions import CommandError, FileError
from clench.core.files.form_errors import form_sentence
from clench.core.files.json_files import non_finite_path, read_json, write_json
from clench.core.pose import Pose

from .grasp_posture import GraspPosture
from .outgoing import OutgoingGrasp

FRAME: Final = "world"


def write_moveit_grasp(path: str | Path, grasps: Sequence[OutgoingGrasp]) -> None:
    """Write ``{"grasps": [...]}``; the pose is the frame's in the world, distances of approach and retreat are 0.

    Raises:
        ClenchError: a number is not finite. FileError: the file cannot be written.
    """
    write_json(path, {"grasps": [_grasp(f"grasp_{i}", grasp) for i, grasp in enumerate(grasps)]}, "grasps")


def read_moveit_grasp(path: str | Path) -> list[GraspPosture]:
    """Read ``{"grasps": [...]}`` or one grasp; the object is taken to be at the origin of the pose's frame.

    Raises:
        FileError: missing, not JSON, or a malformed key, which the message names.
    """
    data = read_json(path)
    bad = non_finite_path(data)
    if bad is not None:
        raise FileError(path, f"{bad}: expected a finite number.")
    try:
        many = isinstance(data, dict) and "grasps" in data
        forms = msgspec.convert(data["grasps"], list[_Grasp]) if many else [msgspec.convert(data, _Grasp)]
    except msgspec.ValidationError as error:
        raise FileError(path, form_sentence(error, _Grasp)) from None
    return [_posture(form, str(path)) for form in forms]


class _Vector(msgspec.Struct):
    x: float
    y: float
    z: float


class _Quaternion(msgspec.Struct):
    x: float
    y: float
    z: float
    w: float


class _Pose(msgspec.Struct):
    position: _Vector
    orientation: _Quaternion


class _PoseStamped(msgspec.Struct):
    pose: _Pose


class _Point(msgspec.Struct):
    positions: list[float]


class _Trajectory(msgspec.Struct):
    joint_names: list[str] = []
    points: list[_Point] = []


class _Grasp(msgspec.Struct):
    grasp_pose: _PoseStamped
    id: str = ""
    grasp_posture: _Trajectory = msgspec.field(default_factory=_Trajectory)
    grasp_quality: float | None = None


def _posture(form: _Grasp, source: str) -> GraspPosture:
    p, q = form.grasp_pose.pose.position, form.grasp_pose.pose.orientation
    names, points = form.grasp_posture.joint_names, form.grasp_posture.points
    positions = points[-1].positions if points else []
    if len(positions) != len(names):
        raise FileError(source, f"grasp_posture: {len(names)} joints, but {len(positions)} positions.")
    try:
        pose = Pose([p.x, p.y, p.z], wxyz=[q.w, q.x, q.y, q.z], key="grasp_pose")
    except CommandError as error:
        raise FileError(source, str(error)) from None
    angles = dict(zip(names, positions, strict=True))
    return GraspPosture(form.id or "grasp", pose, joint_angles=angles, confidence=form.grasp_quality)


def _grasp(name: str, grasp: OutgoingGrasp) -> dict[str, Any]:
    (x, y, z), (qw, qx, qy, qz) = grasp.T_world_frame.position.tolist(), grasp.T_world_frame.wxyz.tolist()
    nowhere = {
        "direction": {"header": _header(), "vector": {"x": 0.0, "y": 0.0, "z": 0.0}},
        "desired_distance": 0.0,
        "min_distance": 0.0,
    }
    return {
        "id": name,
        "pre_grasp_posture": _trajectory(grasp.pregrasp),
        "grasp_posture": _trajectory(grasp.solution.joint_angles),
        "grasp_pose": {
            "header": _header(),
            "pose": {
                "position": {"x": x, "y": y, "z": z},
                "orientation": {"x": qx, "y": qy, "z": qz, "w": qw},
            },
        },
        "grasp_quality": grasp.confidence,
        "pre_grasp_approach": nowhere,
        "post_grasp_retreat": nowhere,
        "post_place_retreat": nowhere,
        "max_contact_force": 0.0,
        "allowed_touch_objects": [grasp.object_name],
    }


def _header() -> dict[str, Any]:
    return {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": FRAME}


def _trajectory(angles: Mapping[str, float]) -> dict[str, Any]:
    point = {
        "positions": [float(angle) for angle in angles.values()],
        "velocities": [],
        "accelerations": [],
        "effort": [],
        "time_from_start": {"sec": 0, "nanosec": 0},
    }
    return {"header": _header(), "joint_names": list(angles), "points": [point]}
