"""Keep the request of a batch beside its arrays, so that its grasps can be solved again as whole solutions."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from clench.closing.collision.packed_object import hash_bodies, hash_hand
from clench.core.exceptions import CommandError, FileError
from clench.core.files.array_files import read_arrays
from clench.core.files.json_files import parse_json
from clench.core.pose import Pose
from clench.core.pose_arrays import pose_of_row
from clench.models.shapes import CollisionSource

if TYPE_CHECKING:
    from collections.abc import Iterator

    from clench.models.command import GraspCommand
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject
    from clench.solver.solution import GraspSolution

    from .grasp_batch import Question

#: Largest difference between the angles of a batch and those of a repeated solve [rad].
_SAME: Final = 1e-6
_KEYS: Final = (
    *("schema", "command", "hand_model", "object_model", "object_scale", "object_collision_source", "preshape_joints"),
    "geometry_hash",
    *("preshape_angles", "status", "hand_poses", "object_poses", "joint_names", "joint_angles"),
)
_NUMBERS: Final = ("object_scale", "preshape_angles", "hand_poses", "object_poses", "joint_angles")
_TEXTS: Final = frozenset(_KEYS) - frozenset(_NUMBERS)


def question_arrays(question: Question, chosen: np.ndarray[Any, Any]) -> dict[str, np.ndarray[Any, Any]]:
    """Return the request of a batch as arrays: the command as JSON, the models' names, the postures by pose.

    Args:
        question: the request. chosen: indices of the postures that clench chose, shape (N,).
    """
    from clench.models.command_file import command_to_dict

    hand, obj, preshapes = question.hand, question.obj, question.preshapes
    if question.options:
        opened = dict(zip(hand.joint_names, hand.open_angles().tolist(), strict=True))
        named = dict.fromkeys(name for option in question.options for name in option.angles)
        rows = {name: [option.angles.get(name, opened[name]) for option in question.options] for name in named}
        preshapes = {name: np.array(angles)[chosen] for name, angles in rows.items()} | preshapes
    return {
        "command": np.array(json.dumps(command_to_dict(question.command))),
        "hand_model": np.array(str(hand.path or hand.name)),
        "geometry_hash": np.array(geometry_hash(hand, obj, question.command)),
        "object_model": np.array(str(obj.path or obj.name)),
        "object_scale": np.array(obj.scale),
        "object_collision_source": np.array(str(obj.collision_source)),
        "preshape_joints": np.array(list(preshapes), dtype=np.str_),
        "preshape_angles": np.array(list(preshapes.values()), dtype=np.float64),
    }


def geometry_hash(hand: Hand, obj: GraspObject, command: GraspCommand) -> str:
    """Return the fingerprint of the geometry that a batch solves, as solutions have it."""
    source = CollisionSource(command.collision_source or hand.default_source)
    return f"{hash_hand(hand, source)}+{hash_bodies(obj.bodies, obj.collision_source)}"


class SavedBatch:
    """Read a file of `GraspBatch.save`, to solve its grasps again.

    It has `hand_model`, `object_model`, `object_scale` and `object_collision_source`, as solutions do.

    Args:
        path: the file.

    Raises:
        FileError: the file is missing, is no batch, has arrays that do not fit each other, or was saved without its
            command.
    """

    def __init__(self, path: str | Path) -> None:
        from .grasp_batch import SCHEMA

        self.path = Path(path)
        self._arrays = read_arrays(self.path, _KEYS)
        if str(self._arrays.get("schema")) != SCHEMA:
            raise FileError(path, f"schema: expected '{SCHEMA}', got '{self._arrays.get('schema')}'.")
        missing = next((key for key in _KEYS if key not in self._arrays), None)
        if missing is not None:
            raise FileError(path, f"{missing}: missing; the batch was saved without what it was asked. Solve it again.")
        self._check_shapes()
        self._document = parse_json(str(self._arrays["command"]).encode(), f"{path}: command")
        if not isinstance(self._document, dict):
            raise FileError(path, "command: expected a JSON object.")
        self.hand_model = str(self._arrays["hand_model"])
        self.object_model = str(self._arrays["object_model"])
        self.object_scale = float(self._arrays["object_scale"])
        self.object_collision_source = str(self._arrays["object_collision_source"])
        self.object_pose = self._object_pose()
        self.geometry_hash = str(self._arrays["geometry_hash"])

    @property
    def command(self) -> GraspCommand:
        """The command of the batch.

        Raises:
            CommandError: it is malformed.
        """
        from clench.models.command_file import command_from_dict

        return command_from_dict(self._document, f"{self.path}: command")

    @property
    def preshapes(self) -> dict[str, np.ndarray[Any, Any]]:
        """Angles of posture joints by name [rad], shape (N,) each."""
        return dict(zip(self._arrays["preshape_joints"].tolist(), self._arrays["preshape_angles"], strict=True))

    def _object_pose(self) -> Pose | None:
        """Return the pose of the object in the command, which its obstacles are placed for; None: its own."""
        given = self._document.get("object_pose")
        try:
            return None if given is None else Pose.from_dict(given, "command.object_pose")
        except CommandError as error:
            raise FileError(self.path, str(error)) from None

    def _check_shapes(self) -> None:
        """Check that the arrays fit each other, and that text is text."""
        poses, joints, fixed = (self._arrays[key].size for key in ("status", "joint_names", "preshape_joints"))
        shapes = {
            "status": (poses,),
            "joint_names": (joints,),
            "preshape_joints": (fixed,),
            "hand_poses": (poses, 7),
            "object_poses": (poses, 7),
            "joint_angles": (poses, joints),
        }
        # Without posture joints of their own, batches have an array without rows.
        shapes["preshape_angles"] = (fixed, poses) if fixed else (0,)
        for key, array in self._arrays.items():
            expected = shapes.get(key, ())
            if array.shape != expected:
                raise FileError(self.path, f"{key}: expected an array of shape {expected}, got {array.shape}.")
            if (array.dtype.kind == "U") != (key in _TEXTS):
                what = "text" if key in _TEXTS else "numbers"
                raise FileError(self.path, f"{key}: expected {what}, got {array.dtype.name}.")

    def solutions(self, hand: Hand, obj: GraspObject) -> Iterator[GraspSolution]:
        """Yield the poses that are grasps, solved again.

        Raises:
            FileError: it was not solved for this hand and object.
        """
        from clench.models.command_file import command_from_dict
        from clench.solver.solution import SolutionStatus
        from clench.solver.solve import solve

        arrays = self._arrays
        document = self._document
        for i in np.flatnonzero(arrays["status"] == SolutionStatus.GRASP.value):
            try:
                asked = document | {
                    "hand_pose": pose_of_row(arrays["hand_poses"][i]).to_dict(),
                    "object_pose": pose_of_row(arrays["object_poses"][i]).to_dict(),
                    "preshape": _preshape(document, {name: float(each[i]) for name, each in self.preshapes.items()}),
                }
                solution = solve(hand, obj, command_from_dict(asked, f"{self.path}: pose {i}"))
            except CommandError as error:
                raise FileError(self.path, f"pose {i} cannot be solved again: {error}") from None
            kept = dict(zip(arrays["joint_names"].tolist(), arrays["joint_angles"][i].tolist(), strict=True))
            if kept.keys() != solution.joint_angles.keys() or any(
                abs(kept[name] - angle) > _SAME for name, angle in solution.joint_angles.items()
            ):
                raise FileError(
                    self.path,
                    f"pose {i}: solved again for hand '{hand.name}' and object '{obj.name}', it has other angles; "
                    "give the hand and the object that the batch was solved for, with its table and obstacles.",
                )
            yield solution


def _preshape(document: dict[str, Any], angles: dict[str, float]) -> Any:
    given = document.get("preshape") or {}
    return given | angles if isinstance(given, dict) else given
