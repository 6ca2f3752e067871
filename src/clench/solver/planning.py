"""The plan of a hand for a command, made once for as many objects and poses as are asked for."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from typing import Final

from clench.closing.finger_plan import FingerPlan, closing_joints, plan_finger
from clench.closing.hand_plan import HandPlan, make_hand_plan
from clench.closing.motion import alternatives, asked_fingers
from clench.core.exceptions import CommandError, HandError
from clench.models.command import GraspCommand

from .problem import Problem

#: Plans that are kept, the latest made. Each takes 40 to 150 kB, keeps its hand alive, and saves 8 ms.
KEPT_PLANS: Final = 64
_plans: OrderedDict[tuple[object, ...], HandPlan] = OrderedDict()


def plan_hand(problem: Problem) -> HandPlan:
    """Return the plan of a hand at a posture; the same posture is planned once.

    Raises:
        HandError: no finger asked for has a closing joint. CommandError: fingers that cannot close in this order.
    """
    hand, command = problem.hand, problem.command
    key = (
        id(hand),
        problem.start.tobytes(),
        None if command.fingers is None else tuple(command.fingers),
        command.planes,
        command.rounds,
        problem.together,
        tuple(sorted(command.speeds.items())),
        command.full_width,
        tuple(command.yaw_grid),
        tuple(command.open_variants),
        tuple(command.opposition_grid),
        problem.source,
    )
    kept = _plans.get(key)
    if kept is not None and kept.hand is hand:
        return kept
    made = _plans[key] = _plan(problem)
    while len(_plans) > KEPT_PLANS:
        _plans.popitem(last=False)
    return made


def _plan(problem: Problem) -> HandPlan:
    hand, command, start = problem.hand, problem.command, problem.start
    finger_postures: list[tuple[FingerPlan, int, int]] = []
    idle = []
    for f, own in enumerate(asked_fingers(hand, command)):
        if not closing_joints(hand, own):
            idle.append(own)
            continue
        for p, q in enumerate(alternatives(hand, own, start, command)):
            finger_postures.append(
                (plan_finger(hand, own, q, command.planes, problem.source, command.speeds), f - len(idle), p)
            )
    if not finger_postures:
        raise HandError(f"{hand.name}: none of the fingers asked for has a closing joint.")
    if not command.full_width:
        _check_planes([plan for plan, _, _ in finger_postures], command, problem.together)
    return make_hand_plan(
        hand,
        start,
        problem.source,
        finger_postures,
        idle=idle,
        full_width=command.full_width,
        together=problem.together,
        times=problem.rounds,
    )


def _check_planes(plans: Sequence[FingerPlan], command: GraspCommand, together: bool) -> None:
    """Refuse planes alone for a finger whose joints move simultaneously, or in several rounds, about axes that are not
    parallel.

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
