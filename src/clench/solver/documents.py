"""Write and read solutions as documents of schema `clench.solution/1`.

Keys are only ever added to the schema, so reading ignores keys it does not know and is strict about the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from clench.core.exceptions import FileError
from clench.core.files.json_files import encode_document, non_finite_path, read_json, write_json
from clench.core.pose import Pose
from clench.models.hand.reading.extremes import LARGEST_ANGLE
from clench.models.shapes import CollisionSource

from .document_values import check_said, convert, read_limits, read_numbers, read_pose
from .solution import (
    Candidate,
    Contact,
    ContactKind,
    FingerResult,
    FingerStatus,
    GraspSolution,
    SolutionStatus,
)

SCHEMA = "clench.solution/1"
#: Relative speeds are up to so many times larger or smaller than the usual 1 [-].
FASTEST = 1e6

_Vector = tuple[float, float, float]
_Map = dict[str, Any]  # its values are converted one by one, so that messages name the key


class _ContactForm(msgspec.Struct):
    finger: str
    link: str
    stops_joint: str | None
    plane: int | None
    offset: float | None
    kind: ContactKind
    passed: bool
    position: _Vector
    normal: _Vector
    gap: float
    curve_angle: float | None
    link_angle: float | None
    body: str = ""


class _CandidateForm(msgspec.Struct):
    plane: int | None
    offset: float | None
    order: str
    joint_angles: _Map
    feasible: bool | None
    penetration: float | None
    scores: _Map
    contacts: list[Any]
    posture: int = 0
    status: FingerStatus = FingerStatus.TOUCH
    reason: str = ""


class _FingerForm(msgspec.Struct):
    status: FingerStatus
    reason: str
    chosen: int
    candidates: list[Any]
    cause: dict[str, Any] | None = None


class _SqueezeForm(msgspec.Struct):
    feasible: bool = False
    text: str = ""
    offsets: _Map = {}
    torques: _Map = {}
    mass: float = 0.0
    mass_range: tuple[float, float] | None = None
    friction: list[float] | None = None
    contact_model: str = ""
    tensions: list[float] | None = None


class _SolutionForm(msgspec.Struct):
    clench_version: str
    hand: str
    object: str
    geometry_hash: str
    seed: int | None
    status: SolutionStatus
    reason: dict[str, Any]
    hand_pose: Any
    object_pose: Any
    decomposition: _Map
    joint_angles: _Map
    certified: bool
    collision_source: CollisionSource
    max_penetration: float | None
    fingers: _Map
    contacts: list[Any]
    quality: dict[str, Any] | None
    squeeze: dict[str, Any] | None
    pregrasp: _Map | None
    timing: _Map
    hand_model: str = ""
    object_model: str = ""
    open_angles: _Map = {}
    object_collision_source: CollisionSource = CollisionSource.RAW
    joint_limits: _Map = {}
    certificate: dict[str, Any] | None = None
    choice: dict[str, Any] | None = None
    speeds: _Map = {}
    rounds: int = 1
    next_steps: list[_Map] = []
    object_scale: float = 1.0
    obstacles: tuple[str, ...] = ()


def solution_to_dict(solution: GraspSolution) -> dict[str, Any]:
    """Return the documented JSON form; every number is a plain int or float."""
    s = solution
    return {
        "schema": SCHEMA,
        "clench_version": s.clench_version,
        "hand": s.hand,
        "object": s.object,
        "hand_model": s.hand_model,
        "object_model": s.object_model,
        "object_scale": float(s.object_scale),
        "obstacles": list(s.obstacles),
        "geometry_hash": s.geometry_hash,
        "seed": None if s.seed is None else int(s.seed),
        "status": s.status.value,
        "reason": _plain(s.reason),
        "hand_pose": s.hand_pose.to_dict(),
        "object_pose": s.object_pose.to_dict(),
        "decomposition": {part: _numbers(angles) for part, angles in s.decomposition.items()},
        "joint_angles": _numbers(s.joint_angles),
        "open_angles": _numbers(s.open_angles),
        "joint_limits": {name: [float(low), float(high)] for name, (low, high) in s.joint_limits.items()},
        "speeds": _numbers(s.speeds),
        "rounds": int(s.rounds),
        "next_steps": [_numbers(step) for step in s.next_steps],
        "certified": bool(s.certified),
        "collision_source": str(s.collision_source),
        "object_collision_source": str(s.object_collision_source),
        "max_penetration": _number(s.max_penetration),
        "fingers": {name: _finger_to_dict(finger) for name, finger in s.fingers.items()},
        "contacts": [_contact_to_dict(c) for c in s.contacts],
        "certificate": _plain(s.certificate),
        "quality": _plain(s.quality),
        "squeeze": _plain(s.squeeze),
        "pregrasp": None if s.pregrasp is None else _numbers(s.pregrasp),
        "choice": _plain(s.choice),
        "timing": _numbers(s.timing),
    }


def solution_from_dict(data: Any, source: str = "solution") -> GraspSolution:
    """Read the documented JSON form; `source` names it in messages.

    Raises:
        FileError: another schema, or missing, malformed, contradictory or non-finite values, with the key's path.
    """
    if not isinstance(data, dict):
        raise FileError(source, f"expected an object of schema '{SCHEMA}', got {type(data).__name__}.")
    if data.get("schema") != SCHEMA:
        of_plan = str(data.get("schema")).startswith("clench.plan/")
        advice = " Give the file of one of the plan's grasps, such as grasp-01.json." if of_plan else ""
        raise FileError(source, f"schema: expected '{SCHEMA}', got {data.get('schema')!r}.{advice}")
    bad = non_finite_path(data)
    if bad is not None:
        raise FileError(source, f"{bad}: expected a finite number.")
    form = convert(data, _SolutionForm, source, "")

    def angles(value: Mapping[str, Any], key: str) -> dict[str, float]:
        return read_numbers(value, key, source, -LARGEST_ANGLE, LARGEST_ANGLE)

    check_said(form.reason, ("code", "text"), source, "reason")
    check_said(form.certificate, ("text",), source, "certificate")
    if form.rounds < 0:
        raise FileError(source, f"rounds: expected at least 0, got {form.rounds}.")
    if form.squeeze is not None:  # is kept as it is, but what hands are told of it has to be of the right form
        squeeze = convert(form.squeeze, _SqueezeForm, source, "squeeze")
        angles(squeeze.offsets, "squeeze.offsets")
        angles(squeeze.torques, "squeeze.torques")
    return GraspSolution(
        clench_version=form.clench_version,
        hand=form.hand,
        object=form.object,
        hand_model=form.hand_model,
        object_model=form.object_model,
        object_scale=form.object_scale,
        obstacles=form.obstacles,
        geometry_hash=form.geometry_hash,
        seed=form.seed,
        status=form.status,
        reason=form.reason,
        hand_pose=read_pose(form.hand_pose, source, "hand_pose"),
        object_pose=read_pose(form.object_pose, source, "object_pose"),
        decomposition={
            part: angles(convert(v, _Map, source, f"decomposition.{part}"), f"decomposition.{part}")
            for part, v in form.decomposition.items()
        },
        joint_angles=angles(form.joint_angles, "joint_angles"),
        open_angles=angles(form.open_angles, "open_angles"),
        certified=form.certified,
        collision_source=form.collision_source.value,
        object_collision_source=form.object_collision_source.value,
        max_penetration=form.max_penetration,
        fingers={name: _read_finger(name, v, source) for name, v in form.fingers.items()},
        contacts=_read_contacts(form.contacts, source, "contacts"),
        certificate=form.certificate,
        quality=form.quality,
        squeeze=form.squeeze,
        pregrasp=None if form.pregrasp is None else angles(form.pregrasp, "pregrasp"),
        choice=form.choice,
        timing=read_numbers(form.timing, "timing", source),
        speeds=read_numbers(form.speeds, "speeds", source, 1.0 / FASTEST, FASTEST),
        rounds=form.rounds,
        next_steps=tuple(angles(step, f"next_steps[{i}]") for i, step in enumerate(form.next_steps)),
        joint_limits={name: read_limits(v, source, f"joint_limits.{name}") for name, v in form.joint_limits.items()},
    )


def solution_to_json(solution: GraspSolution) -> bytes:
    """Return the document as one line of UTF-8 JSON.

    Raises:
        ClenchError: a number is not finite; the message names its key.
    """
    return encode_document(solution_to_dict(solution), "solution")


def save_solution(solution: GraspSolution, path: str | Path) -> None:
    """Write the document, indented; the file is complete or not there.

    Raises:
        ClenchError: a number is not finite. FileError: the file cannot be written.
    """
    write_json(path, solution_to_dict(solution), "solution")


def load_solution(path: str | Path) -> GraspSolution:
    """Read a file written by `save_solution`.

    Raises:
        FileError: the file is missing, is not JSON, or is not a solution.
    """
    return solution_from_dict(read_json(path, "a solution, as `clench solve --out` writes it"), str(path))


def _contact_to_dict(c: Contact) -> dict[str, Any]:
    return {
        "finger": c.finger,
        "link": c.link,
        "body": c.body,
        "stops_joint": c.stops_joint,
        "plane": None if c.plane is None else int(c.plane),
        "offset": _number(c.offset),
        "kind": c.kind.value,
        "passed": bool(c.passed),
        "position": np.asarray(c.position, dtype=np.float64).tolist(),
        "normal": np.asarray(c.normal, dtype=np.float64).tolist(),
        "gap": float(c.gap),
        "curve_angle": _number(c.curve_angle),
        "link_angle": _number(c.link_angle),
    }


def _candidate_to_dict(c: Candidate) -> dict[str, Any]:
    return {
        "plane": None if c.plane is None else int(c.plane),
        "offset": _number(c.offset),
        "order": str(c.order),
        "posture": int(c.posture),
        "joint_angles": _numbers(c.joint_angles),
        "status": c.status.value,
        "reason": c.reason,
        "feasible": None if c.feasible is None else bool(c.feasible),
        "penetration": _number(c.penetration),
        "scores": _numbers(c.scores),
        "contacts": [_contact_to_dict(contact) for contact in c.contacts],
    }


def _finger_to_dict(f: FingerResult) -> dict[str, Any]:
    return {
        "status": f.status.value,
        "reason": f.reason,
        "cause": _plain(f.cause),
        "chosen": int(f.chosen),
        "candidates": [_candidate_to_dict(c) for c in f.candidates],
    }


def _number(value: float | None) -> float | None:
    return None if value is None else float(value)


def _numbers(values: Mapping[str, float]) -> dict[str, float]:
    return {name: float(v) for name, v in values.items()}


def _plain(value: Any) -> Any:
    """Return a free-form value (reason, quality) with arrays, tuples and NumPy numbers as JSON knows them."""
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Pose):
        return value.to_dict()
    return value


def _read_finger(name: str, data: Any, source: str) -> FingerResult:
    key = f"fingers.{name}"
    form = convert(data, _FingerForm, source, key)
    if form.candidates and not 0 <= form.chosen < len(form.candidates):
        last = len(form.candidates) - 1
        raise FileError(source, f"{key}.chosen: expected the index of a candidate, 0 to {last}, got {form.chosen}.")
    check_said(form.cause, ("code", "text"), source, f"{key}.cause")
    candidates = [_read_candidate(c, source, f"{key}.candidates[{i}]") for i, c in enumerate(form.candidates)]
    return FingerResult(name, form.status, form.reason, form.chosen, tuple(candidates), form.cause)


def _read_candidate(data: Any, source: str, key: str) -> Candidate:
    form = convert(data, _CandidateForm, source, key)

    def numbers(values: Mapping[str, Any], part: str) -> dict[str, float]:
        return read_numbers(values, f"{key}.{part}", source)

    return Candidate(
        plane=form.plane,
        offset=form.offset,
        order=form.order,
        posture=form.posture,
        joint_angles=numbers(form.joint_angles, "joint_angles"),
        status=form.status,
        reason=form.reason,
        feasible=form.feasible,
        penetration=form.penetration,
        scores=numbers(form.scores, "scores"),
        contacts=_read_contacts(form.contacts, source, f"{key}.contacts"),
    )


def _read_contacts(data: list[Any], source: str, key: str) -> tuple[Contact, ...]:
    forms = [convert(c, _ContactForm, source, f"{key}[{i}]") for i, c in enumerate(data)]
    return tuple(
        Contact(**{**msgspec.structs.asdict(f), "position": np.array(f.position), "normal": np.array(f.normal)})
        for f in forms
    )
