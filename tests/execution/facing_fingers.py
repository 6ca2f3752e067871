"""Two fingers that point at each other, so that one of them has to wait."""

from __future__ import annotations

import numpy as np

from chain_hands import HandBuilder, along_x, mount, turned
from clench.closing.collision.packed_object import hash_hand
from clench.models.hand.hand import Hand
from clench.models.shapes import CollisionSource
from clench.solver.solution import FingerResult, FingerStatus, GraspSolution, SolutionStatus
from handmade import make_candidate, make_solution

Z = np.array([0.0, 0.0, 1.0])


def facing_fingers() -> Hand:
    """Return two fingers that point at each other at angle 0, where their tips would overlap by 2 mm."""
    shape = along_x(0.006, 0.04)
    builder = HandBuilder().finger("a", [shape], [0.04], axes=[Z], lower=-2.0)
    away = mount((0.09, 0.0, 0.0), turned(Z, np.pi))
    return builder.finger("b", [shape], [0.04], base=away, axes=[Z], lower=-2.0).hand()


def crossing(hand: Hand, start: float, end: float) -> GraspSolution:
    fingers = {
        name: FingerResult(
            name, FingerStatus.LIMIT, "limit", 0, (make_candidate(joint_angles={f"{name}_0": end}, contacts=()),)
        )
        for name in "ab"
    }
    return make_solution(
        hand=hand.name,
        status=SolutionStatus.PARTIAL,
        geometry_hash=f"{hash_hand(hand, CollisionSource.ENGINE)}+",
        open_angles={"a_0": start, "b_0": start},
        joint_angles={"a_0": end, "b_0": end},
        joint_limits={},
        fingers=fingers,
        contacts=(),
        max_penetration=0.0,
    )
