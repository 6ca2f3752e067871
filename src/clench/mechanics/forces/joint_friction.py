"""Dry friction in the joints: which part of the torques it takes, and forces large enough that it takes little."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from clench.core.defaults import LOSS_RESERVE
from clench.core.pose import FloatArray
from clench.mechanics.grasp.held import HeldObject

from .actuation import ALLOWED, HoldingForces

#: Fingers whose torques sum to less than this part of the strongest finger's sum are left aside [-].
_MINOR: Final = 0.2
#: Number of bisections towards the hardest allowed squeeze.
_HALVINGS: Final = 20
#: Number of times that a squeeze is halved if the tendons cannot exert it.
_TENDON_HALVINGS: Final = 4


def loss_of_torques(held: HeldObject, plan: HoldingForces) -> float:
    """Return the largest share of a finger's torques that joint friction takes [-].

    Friction r of the joints takes the part `sum(r |tau|) / sum(tau^2)` of the power of a motion along the torques.
    Fingers that hardly press are left aside.
    """
    losses, torques = held.dofs.losses, np.abs(plan.torques)
    if losses is None or not losses.any():
        return 0.0
    fingers = _fingers(held)
    sums = [float(torques[finger].sum()) for finger in fingers]
    parts = [
        float(losses[finger] @ torques[finger] / (torques[finger] @ torques[finger]))
        for finger, total in zip(fingers, sums, strict=True)
        if total > _MINOR * max(sums)
    ]
    return max(parts, default=0.0)


def pressed_harder(
    held: HeldObject, plan: HoldingForces, internal: FloatArray, cases: FloatArray, most_force: float
) -> HoldingForces:
    """Return a plan that presses harder where friction in the joints would take too much of its torques.

    Internal forces are added, which balance each other, so the load stays balanced. They are added until the torques
    are `LOSS_RESERVE` times the friction, or until a cone, a limit or the largest total force stops them.

    Args:
        held: the grasp. plan: the plan. internal: the part of its forces that balance each other, shape (C * width,).
        cases: changes of the forces that must stay inside cones and limits, shape (M, C * width).
        most_force: the normal forces sum to at most this [N].
    """
    wanted = LOSS_RESERVE * loss_of_torques(held, plan) - 1.0
    if wanted <= 0.0:
        return plan
    forces = plan.forces.reshape(-1)

    def allowed(share: float) -> bool:
        return _keeps(held, forces + share * internal + cases, most_force)

    low, high = 0.0, wanted
    if allowed(high):
        low = high
    else:
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if allowed(middle) else (low, middle)
    for _ in range(_TENDON_HALVINGS):
        harder = _plan(held, plan, forces + low * internal)
        if harder is not None:
            return harder
        low *= 0.5
    return plan


def _plan(held: HeldObject, plan: HoldingForces, forces: FloatArray) -> HoldingForces | None:
    """Return a plan with other forces, None where the tendons cannot exert them."""
    torques, tensions = held.torques(forces), plan.tensions
    if held.drive is not None:
        found = held.drive.tensions(torques[list(held.drive.columns)])
        if not found.feasible:
            return None
        tensions = found.tensions
    return replace(plan, forces=forces.reshape(plan.forces.shape), torques=torques, tensions=tensions)


def _keeps(held: HeldObject, forces: FloatArray, most_force: float) -> bool:
    """Say whether rows of forces are inside cones and limits, and the first case's total, shape (M, C * width)."""
    contacts = held.contacts
    each = forces.reshape(len(forces), len(contacts), contacts.width)
    leaning = np.concatenate([each[:, :, :2], each[:, :, 3:]], axis=2) / contacts.reach
    slack = each[:, :, 2] - np.linalg.norm(leaning, axis=2)
    tolerance = ALLOWED * max(1.0, float(np.abs(forces).max()))
    return bool(
        slack.min() >= -tolerance
        and (np.abs(forces @ held.jacobian) <= held.dofs.limits + tolerance).all()
        and each[0, :, 2].sum() <= most_force + tolerance
    )


def _fingers(held: HeldObject) -> list[list[int]]:
    """Return the degrees of freedom that move the same contacts, group by group."""
    moved = np.abs(held.jacobian.reshape(len(held.contacts), held.contacts.width, -1)).max(axis=1) > 0.0
    groups: list[set[int]] = []
    for row in moved:
        own = set(np.flatnonzero(row).tolist())
        if own:
            own.update(*(group for group in groups if group & own))
            groups = [*(group for group in groups if not group & own), own]
    return [sorted(group) for group in groups]
