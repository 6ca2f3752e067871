"""The criteria of the whole hand: loads that the contacts resist, and the effort they need (docs/method.md section 6).

The contacts are the contacts of the chosen candidates that still touch, as points with friction. Forces are per newton
of load: they need no mass and ignore torque limits. Forces of a task are in newtons and respect the limits.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import ClassVar, Final

import numpy as np

from clench.closing.candidates import FingerCandidate, combined_posture
from clench.core.pose import FloatArray
from clench.mechanics.epsilon.alternative_wrenches import AlternativeWrenches
from clench.mechanics.epsilon.epsilon_quality import EDGES
from clench.mechanics.epsilon.wrench_space import epsilon_l1
from clench.mechanics.forces.actuation import Effort, least_effort
from clench.mechanics.grasp.contacts import ContactSet, make_contacts, pair_friction
from clench.mechanics.grasp.held import HeldObject, held_by_contacts, held_by_hand
from clench.mechanics.grasp.loads import GRAVITY, gravity_any_direction, six_pulls, task_wrench, weight
from clench.models.objects.mass import mass_properties

from .criterion_types import ScoringContext

#: Key of the directions in which judged candidates were weakest.
_WEAKEST: Final = "weakest"
#: Mass whose weight is 1 N [kg].
_NEWTON: Final = 1.0 / GRAVITY


class EpsilonQuality:
    """The Ferrari-Canny epsilon (normal forces sum to 1 N): the worst pull or twist that is resisted."""

    name: ClassVar[str] = "epsilon"
    unit: ClassVar[str] = "N/N"
    source: ClassVar[str] = "Ferrari and Canny, ICRA 1992"
    scale: ClassVar[float] = 0.1
    larger_is_better: ClassVar[bool] = True

    def score_hand(self, chosen: Sequence[FingerCandidate], context: ScoringContext) -> float | None:
        """Return epsilon [N per N of normal force], 0 without force closure."""
        if context.obj is None:
            return None
        wrenches = np.vstack([np.empty((0, 6)), *(_wrenches(c, context) for c in chosen)])
        ball = epsilon_l1(wrenches)
        if ball.weakest is not None:
            context.kept.setdefault(_WEAKEST, []).append(ball.weakest)
        return ball.radius

    def prepare(self, candidates: Sequence[FingerCandidate], context: ScoringContext) -> None:
        """Compute the wrenches of all candidates in one call, which takes a tenth of the time of single calls."""
        if context.obj is not None:
            _keep_wrenches(candidates, context)

    def bound(
        self, groups: Sequence[Sequence[FingerCandidate]], places: tuple[int, ...], context: ScoringContext
    ) -> FloatArray | None:
        """Return how far every combination reaches along a direction in which one is weak [N per N]."""
        if context.obj is None:
            return None
        key = ("alternatives", *(id(c) for group in groups for c in group))
        if key not in context.kept:
            wrenches = [[_wrenches(c, context) for c in group] for group in groups]
            context.kept[key] = AlternativeWrenches(wrenches)
        alternatives: AlternativeWrenches = context.kept[key]
        return alternatives.bound(places, context.kept.pop(_WEAKEST, ()))


class ActuationForce:
    """Smallest worst joint torque that holds the object against gravity, per newton of its weight."""

    name: ClassVar[str] = "actuation_force"
    unit: ClassVar[str] = "Nm/N"
    source: ClassVar[str] = "Bicchi and Kumar, ICRA 2000"
    scale: ClassVar[float] = 0.02
    ideal: ClassVar[float] = 0.0
    larger_is_better: ClassVar[bool] = False

    def score_hand(self, chosen: Sequence[FingerCandidate], context: ScoringContext) -> float | None:
        """Return the torque [Nm per N]; None when the contacts cannot hold the object."""
        return _worst_torque(chosen, context, weight(_NEWTON, context.gravity))


class ActuationForceAnyWay:
    """Smallest worst joint torque that holds the object for every direction of gravity, per newton of its weight."""

    name: ClassVar[str] = "actuation_force_any_way"
    unit: ClassVar[str] = "Nm/N"
    source: ClassVar[str] = "Bicchi and Kumar, ICRA 2000"
    scale: ClassVar[float] = 0.05
    ideal: ClassVar[float] = 0.0
    larger_is_better: ClassVar[bool] = False

    def score_hand(self, chosen: Sequence[FingerCandidate], context: ScoringContext) -> float | None:
        """Return the torque over 12 loads whose hull holds 1 N in every direction [Nm per N]; None as above."""
        return _worst_torque(chosen, context, gravity_any_direction(_NEWTON))


class ActuationForceSixPulls:
    """Smallest worst joint torque that holds pulls along ±x, ±y, ±z of the palm, per newton of the pull."""

    name: ClassVar[str] = "actuation_force_six_pulls"
    unit: ClassVar[str] = "Nm/N"
    source: ClassVar[str] = "Bicchi and Kumar, ICRA 2000"
    scale: ClassVar[float] = 0.05
    ideal: ClassVar[float] = 0.0
    larger_is_better: ClassVar[bool] = False

    def score_hand(self, chosen: Sequence[FingerCandidate], context: ScoringContext) -> float | None:
        """Return the torque over six pulls of 1 N at the centre of mass, each alone [Nm per N]; None as above."""
        return _worst_torque(chosen, context, six_pulls(1.0))


class ActuationForceTask:
    """Smallest worst joint torque that holds the command's task wrenches, inside the joints' torque limits."""

    name: ClassVar[str] = "actuation_force_task"
    unit: ClassVar[str] = "Nm"
    source: ClassVar[str] = "Bicchi and Kumar, ICRA 2000"
    scale: ClassVar[float] = 0.1
    ideal: ClassVar[float] = 0.0
    larger_is_better: ClassVar[bool] = False

    def score_hand(self, chosen: Sequence[FingerCandidate], context: ScoringContext) -> float | None:
        """Return the torque [Nm]; None without task wrenches, or if a wrench cannot be held inside all limits."""
        held = _held(chosen, context) if len(context.task) else None
        return None if held is None else _worst(held, [task_wrench(w[:3], w[3:], held.length)[0] for w in context.task])


class TendonTension:
    """Smallest worst tendon tension that holds 1 N of the object's weight; tendons are kept taut."""

    name: ClassVar[str] = "tendon_tension"
    unit: ClassVar[str] = "N"
    source: ClassVar[str] = "Abdallah et al., Humanoids 2010"
    scale: ClassVar[float] = 5.0
    ideal: ClassVar[float] = 0.0
    larger_is_better: ClassVar[bool] = False

    def score_hand(self, chosen: Sequence[FingerCandidate], context: ScoringContext) -> float | None:
        """Return the tension [N]; None without tendons, or when they or the contacts cannot hold the object."""
        held = _held(chosen, context)
        if held is None or held.drive is None:
            return None
        plan = least_effort(held, weight(_NEWTON, context.gravity)[0], Effort.TENSION)
        return None if plan is None else plan.worst_tension


def _worst_torque(chosen: Sequence[FingerCandidate], context: ScoringContext, loads: FloatArray) -> float | None:
    """Return the smallest worst torque over loads, without regard to torque limits; None when one cannot be held."""
    held = _held(chosen, context)
    return None if held is None else _worst(held.without_limits(), loads)


def _worst(held: HeldObject, loads: Iterable[FloatArray]) -> float | None:
    """Return the smallest worst torque over loads [Nm]; None when one of them cannot be held."""
    worst = 0.0
    for load in loads:
        plan = least_effort(held, load)
        if plan is None:
            return None
        worst = max(worst, plan.worst_torque)
    return worst


def _held(chosen: Sequence[FingerCandidate], context: ScoringContext) -> HeldObject | None:
    """Return the object as the candidates hold it; None when the context has none, or nothing touches."""
    if context.obj is None or not any(c.holding for c in chosen):
        return None
    contacts = _contacts(chosen, context)
    return held_by_hand(context.hand, combined_posture(context.hand, context.start, chosen), contacts, *_mass(context))


def _wrenches(candidate: FingerCandidate, context: ScoringContext) -> FloatArray:
    """Return the wrenches of the edges of a candidate's friction cones, shape (N, 6); found once per candidate."""
    key = ("wrenches", id(candidate))
    if key not in context.kept:
        _keep_wrenches([candidate], context)
    found: FloatArray = context.kept[key][1]
    return found


def _keep_wrenches(candidates: Sequence[FingerCandidate], context: ScoringContext) -> None:
    """Compute the wrenches of several candidates in one call, and keep them."""
    # Each candidate is kept too: a freed one would give its identity to another one.
    for c in candidates:
        context.kept["wrenches", id(c)] = (c, np.empty((0, 6)))
    holding = [c for c in candidates if c.holding]
    if not holding:
        return
    whole = held_by_contacts(_contacts(holding, context), *_mass(context)).edge_wrenches(EDGES)
    for c, own in zip(holding, np.split(whole, np.cumsum([len(c.holding) for c in holding])[:-1]), strict=True):
        context.kept["wrenches", id(c)] = (c, own.reshape(-1, 6))


def _contacts(chosen: Sequence[FingerCandidate], context: ScoringContext) -> ContactSet:
    """Return the contacts of candidates in the palm frame."""
    assert context.obj is not None
    touches = [t for c in chosen for t in c.holding]
    return make_contacts(
        np.array([t.position for t in touches]),
        -np.array([t.normal for t in touches]),
        [pair_friction(context.hand, t.link, context.obj.bodies[t.body]) for t in touches],
        links=[t.link for t in touches],
    )


def _mass(context: ScoringContext) -> tuple[FloatArray, float]:
    """Return the centre of mass in the palm frame [m] and the length scale [m]."""
    assert context.obj is not None
    assert context.T_palm_object is not None
    mass = mass_properties(context.obj)
    return context.T_palm_object[:3, :3] @ mass.center + context.T_palm_object[:3, 3], mass.length
