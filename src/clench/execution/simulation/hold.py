"""The options of a hold test, and its results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from clench.core.defaults import FRICTION, MASS
from clench.core.exceptions import CommandError
from clench.core.numbers import is_finite_number
from clench.core.showing.short_repr import described, short_repr
from clench.mechanics.grasp.contacts import ContactModel, friction_range
from clench.mechanics.grasp.loads import mass_range

#: The lightest object that the simulation carries [kg].
LIGHTEST = 1e-3


class HoldTest(StrEnum):
    """Name the hold tests."""

    PULLS = "pulls"
    """no gravity; the object is pulled along six directions, each time anew"""
    LIFT = "lift"
    """the object stands on a table under gravity, and the palm moves up"""


@dataclass(frozen=True)
class Hold:
    """Tell how a grasp is tested: the hand closes on a free object, squeezes as planned, and pulls or lifts it.

    The default pull, thresholds, duration, friction and mass are those of the six-direction test of DexGraspBench
    (https://github.com/JYChen18/DexGraspBench). Other settings differ (docs/hold.md).

    Args:
        mass: of the object [kg]. friction: of all contacts with the object [-].
        torsion: torsional friction of these contacts [m]. contact_model: of the squeeze plan; only "soft" counts on it.
        squeeze: how much of the planned forces is applied, 0 for none [-].
        pull: force on the centre of mass per mass [N/kg]. duration: of each pull [s].
        max_distance, max_angle: the object counts as dropped if its centre of mass has moved this far [m], or if it has
            turned this far [rad], from its place before the hand closed.
        test: see `HoldTest`. height: of the lift [m].
        planned_mass, planned_friction: for planning the squeeze, numbers or ranges (least, largest) [kg], [-]; None:
            the mass and the friction of the test.

    Raises:
        CommandError: a value that is not finite or out of range.
    """

    mass: float = MASS
    friction: float = FRICTION
    torsion: float = 0.02
    contact_model: ContactModel | str = ContactModel.POINT
    squeeze: float = 1.0
    pull: float = 10.0
    duration: float = 2.0
    max_distance: float = 0.05
    max_angle: float = float(np.deg2rad(15.0))
    test: HoldTest | str = HoldTest.PULLS
    height: float = 0.1
    planned_mass: float | tuple[float, float] | None = None
    planned_friction: float | tuple[float, float] | None = None

    __repr__ = short_repr

    def __post_init__(self) -> None:
        """Refuse values that cannot be simulated."""
        if not (is_finite_number(self.mass) and self.mass >= LIGHTEST):
            raise CommandError(f"hold: mass: expected a finite number of at least {LIGHTEST:g} kg, got {self.mass!r}.")
        if not (is_finite_number(self.friction) and self.friction > 0.0):
            raise CommandError(
                f"hold: friction: expected a finite number above 0, got {self.friction!r}; nothing holds without it."
            )
        mass_range(self.planned_for[0], "hold: planned_mass")
        friction_range(self.planned_for[1], "hold: planned_friction")
        if self.contact_model not in list(ContactModel):
            raise CommandError(
                f"hold: contact_model: expected one of {', '.join(ContactModel)}, got {self.contact_model!r}."
            )
        if self.test not in list(HoldTest):
            raise CommandError(f"hold: test: expected one of {', '.join(HoldTest)}, got {self.test!r}.")
        for key in ("torsion", "squeeze"):
            value = getattr(self, key)
            if not (is_finite_number(value) and value >= 0.0):
                raise CommandError(f"hold: {key}: expected a finite number of at least 0, got {value!r}.")
        for key in ("pull", "duration", "max_distance", "max_angle", "height"):
            value = getattr(self, key)
            if not (is_finite_number(value) and value > 0.0):
                raise CommandError(f"hold: {key}: expected a finite number above 0, got {value!r}.")

    @property
    def planned_for(self) -> tuple[float | tuple[float, float], float | tuple[float, float]]:
        """The mass [kg] and the friction [-] that the squeeze is planned for, numbers or ranges."""
        mass = self.mass if self.planned_mass is None else self.planned_mass
        return mass, self.friction if self.planned_friction is None else self.planned_friction


@dataclass(frozen=True)
class ObjectMotion:
    """The motion of an object: displacement of its centre of mass [m], and its rotation [rad]."""

    distance: float
    angle: float

    __repr__ = short_repr

    def within(self, distance: float, angle: float) -> bool:
        """Tell whether it moved less than a distance [m] and turned less than an angle [rad]."""
        return self.distance < distance and self.angle < angle


@dataclass(frozen=True)
class Pulled:
    """The outcome of one pull, or of the lift.

    Args:
        held: the object stayed within the limits. motion: at the end, or when it was dropped.
        farthest: the largest distance and the largest angle on the way.
        time: how long it was pulled, or lifted and held up [s].
    """

    held: bool
    motion: ObjectMotion
    farthest: ObjectMotion
    time: float

    __repr__ = short_repr


@dataclass(frozen=True)
class FingerForce:
    """Compare how hard a finger presses with the plan: sums of normal forces [N]."""

    planned: float
    measured: float


@dataclass(frozen=True, eq=False)
class HoldReport:
    """The result of a hold test: whether the hand kept the object, and how far it moved.

    Args:
        held: the object was held in every direction. reason: one sentence.
        settings: of the test. plan: statement of the squeeze plan about the mass.
        planned: whether that plan is feasible; if not, the forces that it found are applied.
        torques: that the servos are to exert at the touch [Nm], by joint. angles: of the joints after the squeeze
            [rad].
        first_touch: when each finger first touched the free object [s], None when it did not; from the pregrasp on.
        closed: motion from the pregrasp to the touch. squeezed: motion from there by the squeeze.
        forces: of every finger, squeezed, before the first pull.
        pulls: by direction in the world, "+x" to "-z", or "lift"; motions count from before the hand closed.
        as_given: if the grasp was solved again on the convex pieces of the simulation, the result of the original
            grasp. All else is then of the grasp on the pieces.

    If nothing was tested, there are no motions, forces and pulls, and the reason says why: the hand would be in the
    table, or the simulation did not stay finite.
    """

    held: bool
    reason: str
    settings: Hold
    plan: str
    planned: bool
    torques: Mapping[str, float]
    angles: Mapping[str, float] = field(default_factory=dict)
    first_touch: Mapping[str, float | None] = field(default_factory=dict)
    closed: ObjectMotion | None = None
    squeezed: ObjectMotion | None = None
    forces: Mapping[str, FingerForce] = field(default_factory=dict)
    pulls: Mapping[str, Pulled] = field(default_factory=dict)
    as_given: HoldReport | None = None

    def __repr__(self) -> str:
        return described(self, held=self.held, reason=self.reason, settings=self.settings)

    @property
    def touch_spread(self) -> float | None:
        """Time between the first and the last finger's first touch [s]; None if fewer than two fingers touched."""
        times = [time for time in self.first_touch.values() if time is not None]
        return max(times) - min(times) if len(times) > 1 else None

    def held_within(self, distance: float, angle: float) -> bool:
        """Tell whether the object never moved as far as a distance [m] or turned as far as an angle [rad]."""
        return self.held and all(pulled.farthest.within(distance, angle) for pulled in self.pulls.values())

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
            "first_touch": dict(self.first_touch),
            "touch_spread": self.touch_spread,
            "closed": None if self.closed is None else asdict(self.closed),
            "squeezed": None if self.squeezed is None else asdict(self.squeezed),
            "forces": {finger: asdict(force) for finger, force in self.forces.items()},
            "pulls": {direction: asdict(pulled) for direction, pulled in self.pulls.items()},
            "as_given": None if self.as_given is None else self.as_given.to_dict(),
        }
