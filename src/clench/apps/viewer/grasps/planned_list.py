"""A search for grasps as a list: the grasps, and every rejected proposal at its place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

import clench
from clench.apps.viewer.session.live_session import LiveSession, planned_command
from clench.closing.motion import open_posture
from clench.core.pose import FloatArray, Pose
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.planner.grasp_plan import PlannedGrasp, RejectedProposal, UnfinishedGrasp

from .listed_grasp import ListedGrasp


def plan_list(session: LiveSession, count: int, tell: Callable[[int], None]) -> list[ListedGrasp]:
    """Plan grasps of the hand and the object of a session.

    Args:
        session: with the state. count: how many are wanted. tell: is called with how many were found so far.

    Raises:
        ClenchError: see `clench.plan_grasps`.
    """
    state = session.state
    hand, obj = session.shelf.hand(state.hand), session.shelf.object(state.object)
    pose = state.command.object_pose or obj.pose
    options = {"mass": state.mass, "friction": state.friction, **session.plan_options}
    search = clench.iter_grasps(hand, obj.posed(pose), count, path=False, **options)
    fallen: list[RejectedProposal] = []
    unfinished: list[UnfinishedGrasp] = []
    search.tell_rejected(fallen.append)
    search.tell_unfinished(unfinished.append)
    for number, _ in enumerate(search, start=1):
        tell(number)
    make = _Maker(state.hand, state.object, hand, pose, state.command)
    found = [make.planned(grasp, k) for k, grasp in enumerate(search.plan(), start=1)]
    return [*found, *map(make.unfinished, unfinished), *(make.rejected(p, k) for k, p in enumerate(fallen, start=1))]


class _Maker:
    """Make entries of a list. Args: hand_name, object_name: on the shelf. hand, pose: of the object. asked: command."""

    def __init__(self, hand_name: str, object_name: str, hand: Hand, pose: Pose, asked: GraspCommand) -> None:
        self._names, self._hand, self._pose, self._asked = (hand_name, object_name), hand, pose, asked

    def planned(self, grasp: PlannedGrasp, number: int) -> ListedGrasp:
        solution = grasp.solution
        return ListedGrasp(
            f"grasp {number}",
            *self._names,
            self._pose.inverse() @ grasp.hand_pose,
            command=partial(planned_command, grasp.command, solution, self._asked),
            status=solution.status.value,
            kind=str(grasp.kind),
            score=grasp.score,
            posture=partial(_touch, solution, self._hand),
        )

    def unfinished(self, grasp: UnfinishedGrasp) -> ListedGrasp:
        solution = grasp.solution
        return ListedGrasp(
            f"proposal {grasp.number}",
            *self._names,
            self._pose.inverse() @ solution.hand_pose,
            command=partial(planned_command, grasp.command, solution, self._asked),
            status=solution.status.value,
            kind=str(grasp.kind),
            rejected=str(grasp.reason),
            posture=partial(_touch, solution, self._hand),
        )

    def rejected(self, proposal: RejectedProposal, number: int) -> ListedGrasp:
        command = replace(
            self._asked,
            hand_pose=self._pose @ proposal.T_object_palm,
            object_pose=self._pose,
            preshape=dict(proposal.angles),
        )
        return ListedGrasp(
            f"rejected {number}",
            *self._names,
            proposal.T_object_palm,
            command=lambda: command,
            rejected=str(proposal.reason),
            posture=lambda: open_posture(self._hand, command),
        )


def _touch(solution: clench.GraspSolution, hand: Hand) -> FloatArray:
    return np.array([solution.joint_angles[name] for name in hand.joint_names])
