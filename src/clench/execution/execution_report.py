"""Report an execution: angles and contacts reached, against the computed ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from clench.core.files.json_files import write_json
from clench.core.pose import FloatArray
from clench.core.showing.short_repr import described, short_repr
from clench.execution.simulation.hold import HoldReport, ObjectMotion, Pulled
from clench.solver.solution import GraspSolution

from .history import CommandsSent, ExecutionHistory

SCHEMA = "clench.execution/1"


@dataclass(frozen=True)
class JointReached:
    """Compare one joint's angle with the computed one [rad]."""

    computed: float
    reached: float

    @property
    def error(self) -> float:
        """Reached minus computed [rad]."""
        return self.reached - self.computed


@dataclass(frozen=True, eq=False)
class ContactReached:
    """The comparison of one computed contact with the executed one.

    Args:
        finger, link: names.
        computed: the computed contact point in the world [m], shape (3,).
        position: the place where the link is nearest to the object [m], shape (3,).
        gap: distance between link and object [m], negative when they overlap.
        displacement: distance of the link's own contact point from its computed place [m].
        touches: the gap is within the report's contact tolerance.
    """

    finger: str
    link: str
    computed: FloatArray
    position: FloatArray
    gap: float
    displacement: float
    touches: bool

    __repr__ = short_repr


@dataclass(frozen=True)
class NextStepReached:
    """The outcome of one next step: joints that arrived, contacts, and whether the object is held.

    Args:
        joints: every joint that the step moves, with its target. reached: all are there, up to the report's angle
            tolerance. reason: in words.
        touching: fingers that touch the object after it, None where that is not known.
        held: whether the object is still held after it, None where that was not tested.
        motion: of the object in this step alone, None if it could not move or was not observed.
        pulls: with which it was tested, by direction, or "gravity"; motions count from after the step.
    """

    joints: Mapping[str, JointReached]
    reached: bool
    reason: str
    touching: tuple[str, ...] | None = None
    held: bool | None = None
    motion: ObjectMotion | None = None
    pulls: Mapping[str, Pulled] = field(default_factory=dict)

    __repr__ = short_repr

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form, one of `next_steps` in schema `clench.execution/1`."""
        return {
            "joints": _joints(self.joints),
            "reached": self.reached,
            "reason": self.reason,
            "touching": None if self.touching is None else list(self.touching),
            "held": self.held,
            "motion": None if self.motion is None else asdict(self.motion),
            "pulls": {direction: asdict(pulled) for direction, pulled in self.pulls.items()},
        }


def step_sentence(step: int, joints: Mapping[str, JointReached], tolerance: float) -> tuple[bool, str]:
    """Return whether a next step was reached, and say so.

    Args:
        step: its index. joints: joints of the step. tolerance: largest difference that counts as reached [rad].
    """
    if not joints:
        return True, f"Next step {step + 1} moves nothing: it names no joint, or followers only."
    worst = max(joints, key=lambda name: abs(joints[name].error))
    error = abs(joints[worst].error)
    if error <= tolerance:  # written so that NaN fails
        return True, f"Next step {step + 1} was reached: every joint of it is within {error:.2g} rad."
    return False, (
        f"Next step {step + 1} was not reached: joint '{worst}' is {error:.3g} rad from its angle; tolerance "
        f"{tolerance:g} rad."
    )


def judge_steps(success: bool, reason: str, steps: Sequence[NextStepReached]) -> tuple[bool, str]:
    """Return success and reason of an execution after its next steps: all of them have to be reached."""
    failed = [step for step in steps if not step.reached]
    if failed:
        return False, f"{reason} {failed[0].reason}"
    return success, f"{reason} {''.join(step.reason + ' ' for step in steps)}".rstrip()


def notes_on_steps(solution: GraspSolution, steps: Sequence[NextStepReached]) -> tuple[str, ...]:
    """Return a sentence about next steps that were not carried out, if there are any."""
    left = len(solution.next_steps) - len(steps)
    if not left:
        return ()
    which = f"The last {left} of {len(solution.next_steps)} next steps" if steps else "The next steps"
    return (f"{which} were not carried out: what comes before was not reached, or did not hold.",)


@dataclass(frozen=True)
class ExecutionReport:
    """The result of an execution: angles and contacts that were reached, against those computed.

    Args:
        actuator: name of the executor. success: see `reason`. reason: one sentence.
        joints: every joint, by name. contacts: every computed contact that had not passed.
        touched_links: names of the links that touch at the end.
        first_touch: when each finger first touched [s], None when it did not.
        duration: how long the motion took [s].
        largest_angle_error: over all joints [rad].
        angle_tolerance: [rad]. contact_tolerance: [m].
        notes: limits of the comparison, as sentences.
        history: targets and measurements on the way, None if not kept.
        hold: result of a hold test, None without one.
        driven_by: drive of every joint of a simulated hand: an actuator of the model, "servo" or "coupled".
        next_steps: results of the solution's next steps, up to the first step that was not reached.
        sent: number of commands to a controller, and the last one; None if the actuator is not a controller.
    """

    actuator: str
    success: bool
    reason: str
    joints: Mapping[str, JointReached] = field(default_factory=dict)
    contacts: tuple[ContactReached, ...] = ()
    touched_links: tuple[str, ...] = ()
    first_touch: Mapping[str, float | None] = field(default_factory=dict)
    duration: float = 0.0
    largest_angle_error: float | None = None
    angle_tolerance: float | None = None
    contact_tolerance: float | None = None
    notes: tuple[str, ...] = ()
    history: ExecutionHistory | None = None
    hold: HoldReport | None = None
    driven_by: Mapping[str, str] = field(default_factory=dict)
    next_steps: tuple[NextStepReached, ...] = ()
    sent: CommandsSent | None = None

    def __repr__(self) -> str:
        return described(
            self,
            actuator=self.actuator,
            success=self.success,
            reason=self.reason,
            duration=self.duration,
            largest_angle_error=self.largest_angle_error,
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form, schema `clench.execution/1`."""
        return {
            "schema": SCHEMA,
            "actuator": self.actuator,
            "success": self.success,
            "reason": self.reason,
            "joints": _joints(self.joints),
            "contacts": [
                {
                    "finger": c.finger,
                    "link": c.link,
                    "computed": c.computed.tolist(),
                    "position": c.position.tolist(),
                    "gap": c.gap,
                    "displacement": c.displacement,
                    "touches": c.touches,
                }
                for c in self.contacts
            ],
            "touched_links": list(self.touched_links),
            "first_touch": dict(self.first_touch),
            "duration": self.duration,
            "largest_angle_error": self.largest_angle_error,
            "angle_tolerance": self.angle_tolerance,
            "contact_tolerance": self.contact_tolerance,
            "notes": list(self.notes),
            "history": None if self.history is None else self.history.to_dict(),
            "hold": None if self.hold is None else self.hold.to_dict(),
            "driven_by": dict(self.driven_by),
            "next_steps": [step.to_dict() for step in self.next_steps],
            "sent": None if self.sent is None else self.sent.to_dict(),
        }

    def save(self, path: str | Path) -> None:
        """Write the JSON form, atomically.

        Raises:
            ClenchError: a number is not finite. FileError: the file cannot be written.
        """
        write_json(path, self.to_dict(), "report")


def _joints(joints: Mapping[str, JointReached]) -> dict[str, dict[str, float]]:
    return {name: {"computed": j.computed, "reached": j.reached, "error": j.error} for name, j in joints.items()}
