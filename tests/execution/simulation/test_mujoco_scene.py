"""Real hands in simulation: the scene has the hand's own kinematics, and the servos hold and reach postures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clench.core.pose import Pose
from clench.execution.simulation.mujoco_scene import body_pose, build_scene
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import Body, GraspObject
from clench.models.shapes import Shape, ShapeKind

PALM_POSE = Pose([0.1, 0.2, 0.3], wxyz=[0.5, 0.5, -0.5, 0.5])
FAR = GraspObject("dot", (Body("dot", (Shape(ShapeKind.SPHERE, (0.01, 0, 0)),)),), pose=Pose([0, 0, 5]))
SHARED_HANDS = [
    "allegro_urdf/allegro_hand_right.urdf",
    "barrett_hand_urdf/bhand_model.urdf",
    "dclaw_urdf/dclaw_gripper.urdf",
    "leap_hand_urdf/leap_hand_right.urdf",
    "shadow_hand_mjcf/right_hand.xml",
    "wonik_allegro_mjcf/right_hand.xml",
]


def check(hand: Hand) -> None:
    """Hold the open hand still for a moment, and compare every link with the hand's own kinematics."""
    import mujoco

    q = hand.open_angles()
    scene = build_scene(hand, FAR, PALM_POSE, q)
    data = mujoco.MjData(scene.model)
    data.qpos[scene.qpos] = q
    data.ctrl[:] = q
    mujoco.mj_forward(scene.model, data)
    assert data.ncon == 0
    expected = PALM_POSE.matrix @ hand.link_poses(q)
    for link, body in enumerate(scene.link_bodies):
        np.testing.assert_allclose(body_pose(data, body), expected[link], atol=1e-9)
    for _ in range(200):
        mujoco.mj_step(scene.model, data)
    np.testing.assert_allclose(data.qpos[scene.qpos], q, atol=1e-6)


@pytest.mark.parametrize("name", ["robonaut2", "patent15"])
def test_built_in_hands(name: str) -> None:
    check(Hand.load(name))


@pytest.mark.shared
@pytest.mark.parametrize("file", SHARED_HANDS)
def test_shared_hands(file: str, shared_data: Path) -> None:
    check(Hand.load(shared_data / "hands" / file))


def test_servos_reach_a_bent_posture() -> None:
    import mujoco

    hand = Hand.load("robonaut2")
    start = hand.open_angles()
    goal = start.copy()
    goal[hand.joint_index("index_medial")] = 0.8
    goal = hand.coupled(goal)
    assert goal[hand.joint_index("index_distal")] == pytest.approx(0.72)
    scene = build_scene(hand, FAR, PALM_POSE, start)
    data = mujoco.MjData(scene.model)
    data.qpos[scene.qpos] = start
    data.ctrl[:] = goal
    for _ in range(300):
        mujoco.mj_step(scene.model, data)
    np.testing.assert_allclose(data.qpos[scene.qpos], goal, atol=1e-4)


@pytest.mark.shared
def test_the_palm_of_a_hand_with_a_wrist_stays_where_it_is(shared_data: Path) -> None:
    """Fingers that close as fast as they can do not push the palm back through the wrist."""
    import mujoco

    hand = Hand.load(shared_data / "hands" / "shadow_hand_mjcf/right_hand.xml")
    start = hand.open_angles()
    goal = start.copy()
    for finger in hand.fingers:
        goal[list(finger.joints)[-3:]] += 0.5
    scene = build_scene(hand, FAR, PALM_POSE, start)
    data = mujoco.MjData(scene.model)
    data.qpos[scene.qpos] = start
    data.ctrl[:] = hand.coupled(goal)
    moved = 0.0
    for _ in range(100):
        mujoco.mj_step(scene.model, data)
        mujoco.mj_kinematics(scene.model, data)
        palm = body_pose(data, scene.link_bodies[hand.palm])
        moved = max(moved, float(np.linalg.norm(palm[:3, 3] - PALM_POSE.position)))
    assert moved < 2e-6
