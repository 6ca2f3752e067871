"""Check the motion after the touch: the squeeze, and the next steps of the work."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from clench.closing.collision.depths import hand_depths
from clench.closing.collision.path_check import PlacedObject, find_path_overlap, place_object
from clench.core.exceptions import MotionError
from clench.core.pose import FloatArray, invert
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import GraspSolution

from .next_steps import NEXT_STEP, Phase, squeeze_offsets


def refuse_after(solution: GraspSolution, hand: Hand, phases: Sequence[Phase]) -> None:
    """Raise an error if the squeeze or a next step would drive links of the hand into each other.

    Args:
        solution: the solution. hand: the hand that was solved for. phases: of the motion after the touch.

    Raises:
        MotionError: the sentence names the step and the links.
    """
    sentence = squeeze_overlap(solution, hand, squeeze_offsets(solution, hand)) or step_overlap(solution, hand, phases)
    if sentence is not None:
        raise MotionError(sentence)


def squeeze_overlap(solution: GraspSolution, hand: Hand, offsets: FloatArray) -> str | None:
    """Return a sentence about the first two links that a squeeze drives into each other; None without.

    The object stops the fingers that touch it: they press and do not move, regardless of their targets. Only the other
    joints move.

    Args:
        solution: the solution. hand: the hand that was solved for. offsets: angles beyond the touch [rad], shape (J,).
    """
    if not offsets.any():
        return None
    moved = offsets.copy()
    moved[_touching_joints(solution, hand)] = 0.0
    q = posture(solution.joint_angles, hand, "joint_angles")
    found = find_path_overlap(hand, np.array([q, q + moved]), CollisionSource(solution.collision_source))
    return None if found is None else f"In the squeeze, {found.sentence}."


def told_overlap(
    solution: GraspSolution,
    hand: Hand,
    obj: GraspObject | None,
    pregrasp: Mapping[str, float],
    squeezed: Mapping[str, float],
) -> str | None:
    """Return a sentence about the first overlap on straight lines from pregrasp to grasp and squeeze; None without.

    Another program that reads only these three postures moves the joints like that.

    Args:
        solution: the grasp. hand, obj: the hand and object that were solved for; without the object only links are
            checked against each other.
        pregrasp, squeezed: angles by joint name [rad].
    """
    q = posture(solution.joint_angles, hand, "joint_angles")
    before = np.array([pregrasp.get(name, angle) for name, angle in zip(hand.joint_names, q, strict=True)])
    after = np.array([squeezed.get(name, angle) for name, angle in zip(hand.joint_names, q, strict=True)])
    around = None if obj is None else placed_object(solution, obj)
    # From the grasp on, which is free: links that overlap where a path begins would be let apart.
    found = find_path_overlap(hand, np.array([q, before]), CollisionSource(solution.collision_source), around)
    if found is not None:
        return f"On the straight line from the pregrasp to the grasp, {found.sentence}."
    return squeeze_overlap(solution, hand, after - q)


def step_overlap(solution: GraspSolution, hand: Hand, phases: Sequence[Phase]) -> str | None:
    """Return a sentence about the first two links that next steps drive into each other; None when there are none.

    The object moves with the hand or stays behind, so only the hand is checked. Fingers that touch the object press on
    it until a step moves them. So they are checked twice: at their targets, and where the object stops them. Links that
    overlap when the steps begin may stay as deep as they are.

    Args:
        solution: the solution. hand: the hand that was solved for. phases: of the motion after the touch.
    """
    steps = [phase for phase in phases if phase.name == NEXT_STEP]
    if not steps:
        return None
    source = CollisionSource(solution.collision_source)
    told = np.vstack([steps[0].positions[:1], *(phase.positions[1:] for phase in steps)])
    held, touch = told.copy(), posture(solution.joint_angles, hand, "joint_angles")
    for j in _touching_joints(solution, hand):
        moved = np.flatnonzero(told[:, j] != told[0, j])
        held[: moved[0] if len(moved) else len(told), j] = touch[j]
    found = find_path_overlap(hand, told, source) or find_path_overlap(hand, held, source)
    if found is None:
        return None
    ends = np.cumsum([len(phase.positions) - 1 for phase in steps])
    number = min(int(np.searchsorted(ends, found.place)), len(steps) - 1)
    return f"In next step {1 + (steps[number].step or 0)}, {found.sentence}."


def placed_object(solution: GraspSolution, obj: GraspObject) -> PlacedObject:
    """Return the object of a solution where the palm sees it."""
    return place_object(obj, invert(solution.hand_pose.matrix) @ solution.object_pose.matrix)


def refuse_start(hand: Hand, q: FloatArray, source: CollisionSource, around: PlacedObject) -> None:
    """Raise an error if the hand overlaps the object or an obstacle where every path begins.

    Args:
        hand: the hand. q: angles of all joints there [rad], shape (J,). source: geometry of the links.
        around: the object with its obstacles.

    Raises:
        MotionError: names the link, the body and the depth.
    """
    from clench.kernels.toi.path_overlap import OVERLAP

    for packed in around.bodies:
        found = hand_depths(hand, q, packed, around.T_palm_object, source)
        deepest = max(found, key=lambda depth: depth.depth, default=None)
        if deepest is not None and deepest.depth > OVERLAP:
            raise MotionError(
                f"No path to the touch is free for hand '{hand.name}': '{hand.links[deepest.link].name}' overlaps "
                f"'{packed.body_names[0]}' {deepest.text} before anything moves."
            )


def _touching_joints(solution: GraspSolution, hand: Hand) -> list[int]:
    """Return the joints of the fingers that touch the object."""
    touching = {c.finger for c in solution.contacts if not c.passed}
    return [j for finger in hand.fingers if finger.name in touching for j in finger.joints]
