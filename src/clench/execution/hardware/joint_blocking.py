"""Name the obstruction of a joint that is off its target."""

from __future__ import annotations

from typing import Any

import numpy as np

from clench.closing.collision.path_check import find_path_overlap
from clench.core.pose import FloatArray
from clench.execution.simulation.mujoco_scene import Scene
from clench.execution.step_check import placed_object
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource
from clench.solver.solution import GraspSolution

#: Weaker contacts block nothing [N].
LEAST_FORCE = 1e-6


def modelled_blocker(
    solution: GraspSolution, hand: Hand, obj: GraspObject | None, reached: FloatArray, joint: str, told: float
) -> str:
    """Say in a sentence which body a joint meets first on its way from its present angle to its target.

    Args:
        solution: says where the object is. hand: the model. obj: the object; None checks the hand's links alone.
        reached: all joint angles, as measured [rad], shape (J,). joint: its name. told: its target [rad].
    """
    target = reached.copy()
    target[hand.joint_index(joint)] = told
    followers = list(hand.followers_of(hand.joint_index(joint)))
    target[followers] = hand.coupled(target)[followers]
    around = None if obj is None else placed_object(solution, obj)
    found = find_path_overlap(hand, np.array([reached, target]), CollisionSource(solution.collision_source), around)
    if found is not None:
        what = f"the object's '{found.other}'" if found.with_object else f"'{found.other}'"
        return f"In the model, '{found.link}' meets {what} there."
    known = "no other link" if obj is None else "neither another link nor the object"
    return f"In the model, {known} is in the way of joint '{joint}'."


def simulated_blocker(scene: Scene, data: Any, hand: Hand, joint: str) -> str:
    """Say in a sentence which body the joint's links press hardest; empty without contact.

    Args:
        scene, data: the simulation. hand: the hand in it. joint: the joint's name.
    """
    import mujoco

    moved = _links_moved_by(hand, hand.joint_index(joint))
    link_of = {geom: i for i, geoms in enumerate(scene.link_geoms) for geom in geoms}
    hardest, said, force = LEAST_FORCE, "", np.zeros(6)
    for number in range(data.ncon):
        geoms = data.contact.geom[number].tolist()
        inside = [link_of.get(geom, -1) in moved for geom in geoms]
        if inside[0] == inside[1]:
            continue
        mujoco.mj_contactForce(scene.model, data, number, force)
        if force[0] <= hardest:
            continue
        own, other = geoms if inside[0] else geoms[::-1]
        what = f"'{hand.links[link_of[other]].name}'" if other in link_of else "the object"
        hardest = float(force[0])
        said = f"'{hand.links[link_of[own]].name}' presses on {what} with {hardest:.2g} N."
    return said


def _links_moved_by(hand: Hand, joint: int) -> set[int]:
    """Return the links that a joint, or a joint that follows it, moves."""
    joints = {joint, *hand.followers_of(joint)}
    moved: set[int] = set()
    for number, link in enumerate(hand.links):
        if link.joint in joints or link.parent in moved:
            moved.add(number)
    return moved
