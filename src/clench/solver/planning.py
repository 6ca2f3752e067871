"""The plan of a hand at a posture, made once for as many objects and poses as are asked for."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from clench.base.errors import CommandError, HandError
from clench.base.keeping import kept_by_identity
from clench.base.pose import FloatArray
from clench.grasp.batching import is_covered
from clench.grasp.closing import HandPlan, make_hand_plan, only_items
from clench.grasp.exact import HandBodies, hand_bodies, pack_exact
from clench.grasp.motion import alternatives, asked_fingers
from clench.grasp.plan import FingerPlan, closing_joints, plan_finger
from clench.models.command import GraspCommand
from clench.models.hand.hand import Finger, Hand
from clench.models.shapes import CollisionSource

from .checked import CheckedCommand
from .problem import Problem

if TYPE_CHECKING:
    from clench.kernels.exact import ExactArrays

#: Plans that are kept, the latest made.
KEPT_PLANS: Final = 64


@dataclass(frozen=True, eq=False)
class Planned:
    """The plan of a hand for closing, and the inputs of its exact sweeps.

    Args:
        start: posture before closing, shape (J,) [rad]. source: geometry of the hand. plan, exact: of its fingers.
        idle: fingers asked for that no joint closes.
    """

    hand: Hand
    start: FloatArray
    source: CollisionSource
    plan: HandPlan
    exact: ExactArrays
    idle: tuple[Finger, ...]

    @cached_property
    def whole(self) -> bool:
        """Whether the full width of fingers is closed."""
        return any(self.plan.whole)

    @cached_property
    def covered(self) -> bool:
        """Whether the kernels of a batch close these fingers, see `is_covered`."""
        return is_covered(self.hand, self.plan)

    @cached_property
    def full_width(self) -> Planned | None:
        """The full width of every finger alone; None where a finger has several of them, or none."""
        items = np.flatnonzero(self.plan.whole)
        fingers = {self.plan.finger[entry] for entry in self.plan.items.entry[items]}
        return self._only(items) if len(items) == len(fingers) == len(self.plan.plans) else None

    @cached_property
    def plane_counts(self) -> list[int]:
        """How many sets of single planes each entry has."""
        single = self.plan.items.entry[~np.array(self.plan.whole)]
        return [int((single == entry).sum()) for entry in range(len(self.plan.plans))]

    @cached_property
    def planes(self) -> Planned:
        """The single planes of every finger alone."""
        return self._only(np.flatnonzero(~np.array(self.plan.whole)))

    def _only(self, items: NDArray[np.intp]) -> Planned:
        exact = self.exact._replace(wanted=np.ascontiguousarray(self.exact.wanted[items]))
        return replace(self, plan=only_items(self.plan, items.tolist()), exact=exact)


_plans: OrderedDict[tuple[object, ...], Planned] = OrderedDict()


def planned(problem: Problem) -> Planned:
    """Return the plan of a hand at a posture; the same posture is planned once.

    Raises:
        HandError: no finger asked for has a closing joint. CommandError: fingers that cannot close in this order.
    """
    return _planned(problem.checked)


@kept_by_identity(KEPT_PLANS)
def _planned(asked: CheckedCommand) -> Planned:
    """Return the plan of a command, whatever its poses are."""
    hand, command = asked.hand, asked.command
    key = (
        id(hand),
        asked.start.tobytes(),
        None if command.fingers is None else tuple(command.fingers),
        command.planes,
        command.rounds != 1,
        asked.together,
        tuple(sorted(command.speeds.items())),
        command.full_width,
        tuple(command.yaw_grid),
        tuple(command.open_variants),
        tuple(command.opposition_grid),
        asked.source,
    )
    kept = _plans.get(key)
    if kept is not None and kept.hand is hand:
        return kept
    plans, finger, posture, idle = [], [], [], []
    for f, own in enumerate(asked_fingers(hand, command)):
        if not closing_joints(hand, own):
            idle.append(own)
        else:
            for p, q in enumerate(alternatives(hand, own, asked.start, command)):
                plans.append(plan_finger(hand, own, q, command.planes, asked.source, command.speeds))
                finger.append(f)
                posture.append(p)
    if not plans:
        raise HandError(f"{hand.name}: none of the fingers asked for has a closing joint.")
    if not command.full_width:
        _check_planes(plans, command, asked.together)
    plan = make_hand_plan(plans, finger, posture, command.full_width, asked.together, command.rounds != 1)
    bodies = hand_bodies(hand, asked.source, asked.start)
    exact = pack_exact(hand, plan.plans, plan.whole, bodies)
    if asked.together:
        exact = exact._replace(checked=_with_resting(hand, plan.plans, bodies))
    made = _plans[key] = Planned(hand, asked.start, asked.source, plan, exact, tuple(idle))
    while len(_plans) > KEPT_PLANS:
        _plans.popitem(last=False)
    return made


def _check_planes(plans: Sequence[FingerPlan], command: GraspCommand, together: bool) -> None:
    """Refuse planes alone for a finger whose joints move at once, or again, about axes that are not parallel.

    Raises:
        CommandError: with the name of the finger.
    """
    for plan in plans:
        if not plan.lies_in_planes(together or command.rounds != 1):
            how = f"order {command.order}" if together else "rounds" if command.rounds != 1 else "coupled joints"
            raise CommandError(
                f"{how}: finger '{plan.finger.name}' closes about axes that are not parallel, so curl planes do not "
                "tell where it touches; its full width does: leave 'full_width' on."
            )


def _with_resting(hand: Hand, plans: Sequence[FingerPlan], bodies: HandBodies) -> np.ndarray:
    """Return which links may not overlap while all fingers close: those of fingers that rest are in the way."""
    closing = {plan.finger.name for plan in plans}
    resting = [link for f in hand.fingers if f.name not in closing for link in f.links]
    checked = bodies.within.copy()
    checked[:, resting] = bodies.across[:, resting]
    return checked
