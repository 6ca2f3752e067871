"""What came of carrying out a solution: angles and contacts reached against those computed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from clench.base.json_files import write_json
from clench.base.pose import FloatArray

from .history import ExecutionHistory
from .hold import HoldReport

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
    """Compare one computed contact with what happened there.

    Args:
        finger, link: names.
        computed: the computed contact point in the world [m], shape (3,).
        position: the place where the link is nearest to the object [m], shape (3,).
        gap: distance between link and object [m], negative when they overlap.
        displacement: how far the link's own point of contact is from where it was computed [m].
        touches: the gap is within the report's contact tolerance.
    """

    finger: str
    link: str
    computed: FloatArray
    position: FloatArray
    gap: float
    displacement: float
    touches: bool


@dataclass(frozen=True)
class ExecutionReport:
    """Hold what was reached when a solution was carried out.

    Args:
        actuator: what carried it out. success: see `reason`. reason: one sentence.
        joints: every joint, by name. contacts: every computed contact that had not passed.
        touched_links: names of the links that touch at the end.
        first_touch: when each finger first touched [s], None when it did not.
        duration: how long the motion took [s].
        largest_angle_error: over all joints [rad].
        angle_tolerance: [rad], contact_tolerance: [m]: what counted as reached.
        notes: sentences about what the comparison does not show.
        history: what was told and measured on the way, None when it was not kept.
        hold: what came of a hold test, None without one.
        driven_by: what moved every joint of a simulated hand: an actuator of the model, "servo" or "coupled".
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

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form, schema `clench.execution/1`."""
        return {
            "schema": SCHEMA,
            "actuator": self.actuator,
            "success": self.success,
            "reason": self.reason,
            "joints": {
                name: {"computed": j.computed, "reached": j.reached, "error": j.error}
                for name, j in self.joints.items()
            },
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
        }

    def save(self, path: str | Path) -> None:
        """Write the JSON form, atomically.

        Raises:
            ClenchError: a number is not finite. FileError: the file cannot be written.
        """
        write_json(path, self.to_dict(), "report")
