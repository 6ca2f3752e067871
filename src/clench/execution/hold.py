"""What a hold test asks, and what came of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from clench.base.errors import CommandError
from clench.grasp.mechanics.contacts import ContactModel, check_friction

#: The lightest object that the simulation carries [kg].
LIGHTEST = 1e-3


@dataclass(frozen=True)
class Hold:
    """Tell how a grasp is tested: the object is released, squeezed as planned, and pulled in six directions.

    The values unless told otherwise, but for the time step and the servos, are those of the six-direction test of
    DexGraspBench (https://github.com/JYChen18/DexGraspBench).

    Args:
        mass: of the object [kg]. friction: of all contacts with the object [-].
        torsion: torsional friction of these contacts [m]. contact_model: of the squeeze plan; only "soft" counts on it.
        squeeze: how much of the planned forces is applied, 0 for none [-].
        pull: force on the centre of mass per mass [N/kg]. duration: of each pull [s].
        max_distance: of the centre of mass from where it was held [m], and
        max_angle: of the object [rad]: from there on it is dropped.

    Raises:
        CommandError: a value that is not finite or out of range.
    """

    mass: float = 0.1
    friction: float = 0.6
    torsion: float = 0.02
    contact_model: ContactModel | str = ContactModel.POINT
    squeeze: float = 1.0
    pull: float = 10.0
    duration: float = 2.0
    max_distance: float = 0.05
    max_angle: float = float(np.deg2rad(15.0))

    def __post_init__(self) -> None:
        """Refuse what cannot be simulated."""
        if not (np.isfinite(self.mass) and self.mass >= LIGHTEST):
            raise CommandError(f"hold: mass: expected a finite number of at least {LIGHTEST:g} kg, got {self.mass!r}.")
        check_friction(self.friction, "hold: friction")
        if self.contact_model not in list(ContactModel):
            raise CommandError(
                f"hold: contact_model: expected one of {', '.join(ContactModel)}, got {self.contact_model!r}."
            )
        for key in ("torsion", "squeeze"):
            value = getattr(self, key)
            if not (np.isfinite(value) and value >= 0.0):
                raise CommandError(f"hold: {key}: expected a finite number of at least 0, got {value!r}.")
        for key in ("pull", "duration", "max_distance", "max_angle"):
            value = getattr(self, key)
            if not (np.isfinite(value) and value > 0.0):
                raise CommandError(f"hold: {key}: expected a finite number above 0, got {value!r}.")


@dataclass(frozen=True)
class ObjectMotion:
    """Hold how far the object is from where it was held: its centre of mass [m], and its rotation [rad]."""

    distance: float
    angle: float


@dataclass(frozen=True)
class Pulled:
    """Hold what one pull did.

    Args:
        held: the object stayed within the limits. motion: at the end of the pull, or when it was dropped.
        time: how long it was pulled [s].
    """

    held: bool
    motion: ObjectMotion
    time: float


@dataclass(frozen=True, eq=False)
class HoldReport:
    """Hold what came of a hold test.

    Args:
        held: the object was held in every direction. reason: one sentence.
        settings: of the test. plan: what the squeeze plan says of the mass in every direction of gravity.
        planned: whether that plan is feasible; else what there is of it is applied.
        torques: told to the joints beyond the touch [Nm], by name. angles: of the joints after the squeeze [rad].
        squeezed: motion by the squeeze, before the first pull.
        pulls: by direction in the world, "+x" to "-z"; motions count from where the object was held.
    """

    held: bool
    reason: str
    settings: Hold
    plan: str
    planned: bool
    torques: Mapping[str, float]
    angles: Mapping[str, float]
    squeezed: ObjectMotion
    pulls: Mapping[str, Pulled]

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form, `hold` in schema `clench.execution/1`."""
        return {
            "held": self.held,
            "reason": self.reason,
            "settings": asdict(self.settings),
            "plan": self.plan,
            "planned": self.planned,
            "torques": dict(self.torques),
            "angles": dict(self.angles),
            "squeezed": asdict(self.squeezed),
            "pulls": {direction: asdict(pulled) for direction, pulled in self.pulls.items()},
        }
