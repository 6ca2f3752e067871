"""A solved grasp of the mug, for tests of what is drawn or written of a grasp."""

from __future__ import annotations

from typing import NamedTuple

import clench
from clench.solver.solution import GraspSolution


class MugGrasp(NamedTuple):
    """A grasp of the mug, which stands away from the world's origin, and turned."""

    hand: clench.Hand
    mug: clench.GraspObject
    command: clench.GraspCommand
    solution: GraspSolution


def make_mug_grasp() -> MugGrasp:
    """Solve it."""
    command = clench.GraspCommand(
        hand_pose=clench.Pose([0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5]),
        object_pose=clench.Pose([0.1, 0.0, 0.0], rpy=[0.0, 0.0, 0.1]),
        preshape="open",
        planes=1,
    )
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    return MugGrasp(hand, mug, command, clench.solve(hand, mug, command))
