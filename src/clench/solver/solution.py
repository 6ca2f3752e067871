"""The solution: contacts, angles, judgement and choice, as immutable values (schema `clench.solution/1`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clench.core.caching.deferring import DeferredMapping, LateFields
from clench.core.pose import FloatArray, Pose
from clench.core.showing import display
from clench.core.showing.display import Displayed
from clench.core.showing.short_repr import described, short_repr

if TYPE_CHECKING:
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject


class SolutionStatus(StrEnum):
    """Name the answers of a solve."""

    GRASP = "grasp"
    """every finger asked for touches, or a thumb and at least one finger that opposes it"""
    PARTIAL = "partial"
    """some fingers touch"""
    NO_CONTACT = "no_contact"
    """no finger touches"""
    BLOCKED = "blocked"
    """before anything moves, the palm, a fixed link or every requested finger overlaps the object or an obstacle"""


class FingerStatus(StrEnum):
    """Name how a finger ended."""

    TOUCH = "touch"
    """a link of the finger touches the object"""
    LIMIT = "limit"
    """the finger ends without a contact with the object: at its limits, at an obstacle or at another link"""
    BLOCKED = "blocked"
    """a link of the finger overlaps the object or an obstacle before it moves, or would on its plane alone"""
    NO_MOTION = "no_motion"
    """no closing joint can move"""
    MISSED = "missed"
    """in the order `fingertip`, another link touched before the tip"""


class ContactKind(StrEnum):
    """Name the touching features, link side first."""

    SIDE = "side"
    """side of the link on a vertex of the object (the tangent case of the patent)"""
    TIP = "tip"
    """rounded end of the link's outline on the object"""
    EDGE = "edge"
    """corner of the link's outline on the object, or an edge of its mesh on one of the object's"""
    FACE = "face"
    """face of the link's mesh on a corner of the object"""
    VERTEX = "vertex"
    """corner of the link's mesh on the object"""


@dataclass(frozen=True, eq=False)
class Contact:
    """A contact: where a link touches, with position and normal in the world frame.

    Args:
        finger, link: names. body: the touched body of the object.
        stops_joint: the joint whose motion this contact stopped, or None.
        plane: index of the curl plane, None between the planes; offset: place along the axis group's y axis [m].
        kind: see `ContactKind`. passed: a later motion opened it by more than 1 µm.
        position: [m], shape (3,). normal: unit, out of the object, shape (3,).
        gap: distance at the final posture, negative for an overlap [m].
        curve_angle: tangent angle of the object's curve in the plane [rad]. link_angle: angle of the link's touching
            side [rad]; None for tips and edges.
    """

    finger: str
    link: str
    body: str
    stops_joint: str | None
    plane: int | None
    offset: float | None
    kind: ContactKind
    passed: bool
    position: FloatArray
    normal: FloatArray
    gap: float
    curve_angle: float | None
    link_angle: float | None

    __repr__ = short_repr

    def _key(self) -> tuple[object, ...]:
        values = (getattr(self, f.name) for f in fields(self))
        return tuple(tuple(v.tolist()) if isinstance(v, np.ndarray) else v for v in values)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Contact) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())


@dataclass(frozen=True)
class Candidate:
    """One candidate of a finger: contacts and joint angles on one plane, or over the full width.

    Args:
        plane: index of the curl plane, None for the full width; offset: its place [m].
        order: closing order. posture: index of the posture alternative (0 = as commanded).
        joint_angles: of the finger's joints [rad], by name.
        status, reason: how it ended.
        feasible: whether it and its path penetrate nothing; None when not checked.
        penetration: largest depth over its final posture [m]; None when not checked.
        scores: criterion name to value. contacts: in stage order.
    """

    plane: int | None
    offset: float | None
    order: str
    posture: int
    joint_angles: Mapping[str, float]
    status: FingerStatus
    reason: str
    feasible: bool | None
    penetration: float | None
    scores: Mapping[str, float]
    contacts: tuple[Contact, ...]

    __repr__ = short_repr


@dataclass(frozen=True)
class FingerResult(LateFields):
    """A finger's answer: how it ended, its candidates, and the chosen one.

    Args:
        name: of the finger. status, reason: how it ended. chosen: index of the chosen candidate.
        cause: why it does not touch: ``"code"`` (see `clench.solver.causes.CauseCode`), ``"text"`` and numbers;
            None when it touches.
    """

    name: str
    status: FingerStatus
    reason: str
    chosen: int
    candidates: tuple[Candidate, ...]
    cause: Mapping[str, Any] | None = None

    def __repr__(self) -> str:
        return described(self, name=self.name, status=self.status, reason=self.reason, chosen=self.chosen)

    @classmethod
    def deferred(
        cls,
        name: str,
        best: Candidate,
        chosen: int,
        candidates: Callable[[], tuple[Candidate, ...]],
        cause: Mapping[str, Any] | None,
    ) -> FingerResult:
        """Return a finger that ends as its best candidate does; all candidates are made when they are first read."""
        values = {"name": name, "status": best.status, "reason": best.reason, "chosen": chosen, "cause": cause}
        return cls.with_late(lambda _: candidates(), **values, _made={chosen: best})

    @property
    def made(self) -> Mapping[int, Candidate]:
        """The candidates that have been made, by index: the chosen one, if there is one, and all once they are read."""
        some: Mapping[int, Candidate] | None = self.__dict__.get("_made")
        return dict(enumerate(self.candidates)) if some is None or "candidates" in self.__dict__ else some

    @property
    def best(self) -> Candidate | None:
        """The chosen candidate, or None; the others are not made for it."""
        return self.made.get(self.chosen)


@dataclass(frozen=True)
class GraspSolution(Displayed, LateFields):
    """The answer of `clench.solve`; `to_dict` gives the documented JSON form.

    Args:
        hand, object: names. hand_model, object_model: models to load for another execution (path or built-in name).
        object_scale: factor on the lengths of the object's model [-].
        obstacles: names of the obstacles that were around the object.
        status, reason: the answer; `reason` has at least ``"code"`` and ``"text"``.
        hand_pose: `T_world_palm`; object_pose: `T_world_object`.
        decomposition: ``{"posture": {...}, "closing": {...}}`` [rad].
        joint_angles: every joint of the hand [rad]. open_angles: the posture before closing [rad].
        certified, certificate: whether the certificate of docs/method.md section 5 holds. ``"text"`` states the
            guarantee or why there is none; ``"deviation"`` is that of shapes swept as polyhedra [m].
        choice: why these candidates: criteria, totals, runners-up, and sentences (docs/calibration.md).
        max_penetration: over the full width and all links [m], None when not computed.
        speeds: relative closing speeds in the orders in which all joints move at once, by joint that follows no other;
            1 if not named.
        rounds: how often the closing goes through the joints; 0: until nothing moves.
        next_steps: postures [rad] by joint name that the hand goes to after the grasp, as commanded.
        joint_limits: lower and upper limit [rad] of every joint, so that the solution can judge itself.
    """

    clench_version: str
    hand: str
    object: str
    hand_model: str
    object_model: str
    geometry_hash: str
    seed: int | None
    status: SolutionStatus
    reason: Mapping[str, Any]
    hand_pose: Pose
    object_pose: Pose
    decomposition: Mapping[str, Mapping[str, float]]
    joint_angles: Mapping[str, float]
    open_angles: Mapping[str, float]
    certified: bool
    collision_source: str
    object_collision_source: str
    max_penetration: float | None
    fingers: Mapping[str, FingerResult]
    contacts: tuple[Contact, ...]
    certificate: Mapping[str, Any] | None = field(default_factory=lambda: None)
    quality: Mapping[str, Any] | None = None
    squeeze: Mapping[str, Any] | None = None
    pregrasp: Mapping[str, float] | None = None
    choice: Mapping[str, Any] | None = None
    timing: Mapping[str, float] = field(default_factory=dict)
    joint_limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    speeds: Mapping[str, float] = field(default_factory=dict)
    rounds: int = 1
    next_steps: tuple[Mapping[str, float], ...] = ()
    object_scale: float = field(default_factory=lambda: 1.0)
    obstacles: tuple[str, ...] = field(default_factory=tuple)

    def __repr__(self) -> str:
        return described(
            self,
            hand=self.hand,
            object=self.object,
            status=self.status,
            certified=self.certified,
            fingers={name: finger.status.value for name, finger in self.fingers.items()},
            contacts=len(self.contacts),
            hand_pose=self.hand_pose,
        )

    @classmethod
    def deferred(cls, make: Callable[[], GraspSolution], **known: Any) -> GraspSolution:
        """Return a solution of which some fields are known; the others are made when one of them is first read.

        Args:
            make: returns the whole solution, always the same. known: see `with_late`.
        """
        late = {"choice": DeferredMapping(lambda: make().choice or {})}
        return cls.with_late(lambda name: getattr(make(), name), **{**late, **known})

    def show(self, hand: Hand | None = None, obj: GraspObject | None = None) -> Path | None:
        """Show the closing as a page: in a notebook as the output of the cell, elsewhere in the browser.

        Args:
            hand, obj: what was solved. They may be left out after a recent solve, and for models that load by name.

        Returns:
            the file that the browser opens; None in a notebook.

        Raises:
            CommandError: hand and object are not known.
        """
        return display.show(self, hand, obj)

    def violations(self) -> tuple[str, ...]:
        """Return a sentence for everything that makes the solution unfit to execute."""
        from .validity import violations

        return violations(self)

    def is_valid(self) -> bool:
        """Return whether there is no violation and the status is `grasp` or `partial`."""
        return self.status in (SolutionStatus.GRASP, SolutionStatus.PARTIAL) and not self.violations()

    def to_dict(self) -> dict[str, Any]:
        """Return the documented JSON form, schema `clench.solution/1`."""
        from .documents import solution_to_dict

        return solution_to_dict(self)

    @classmethod
    def from_dict(cls, data: Any, source: str = "solution") -> GraspSolution:
        """Read the documented JSON form; `source` names it in messages.

        Raises:
            FileError: unknown schema, missing or malformed keys.
        """
        from .documents import solution_from_dict

        return solution_from_dict(data, source)

    def save(self, path: str | Path) -> None:
        """Write the JSON form, atomically."""
        from .documents import save_solution

        save_solution(self, path)

    @classmethod
    def load(cls, path: str | Path) -> GraspSolution:
        """Read a file written by `save`.

        Raises:
            FileError: the file is missing, is not JSON, or is not a solution.
        """
        from .documents import load_solution

        return load_solution(path)


def solve_scores(solution: GraspSolution) -> dict[str, float]:
    """Return the scores of a solution: sums over the chosen candidates, and the scores of the whole hand."""
    chosen = [f.best.scores for f in solution.fingers.values() if f.best is not None]
    names = dict.fromkeys(name for scores in chosen for name in scores)
    sums = {n: float(sum(s[n] for s in chosen)) for n in names if all(n in s for s in chosen)}
    return {**sums, **(solution.choice or {}).get("final_hand_scores", {})}


def posture_reason(solution: GraspSolution) -> Mapping[str, Any] | None:
    """Return why clench chose the posture of a solution, or None if the command named the posture.

    It leaves the reasons for the candidates unread: for them, clench would close all candidates on planes.
    """
    choice = solution.choice
    unread = isinstance(choice, DeferredMapping) and not choice.is_made
    return None if choice is None or unread else choice.get("preshapes")
