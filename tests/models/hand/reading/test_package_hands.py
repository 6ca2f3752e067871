"""Hands that come inside Python packages load and close; each is skipped, visibly, where its package is absent."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from test_kinematics import assert_same_kinematics

from clench.core.exceptions import HandError
from clench.models.hand.hand import Hand


def packaged(package: str, path: str) -> Path:
    """Return a file of an installed package without importing it."""
    spec = importlib.util.find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        pytest.skip(f"package {package} is not installed")
    file = Path(spec.submodule_search_locations[0]) / path
    if not file.is_file():
        pytest.skip(f"package {package} has no {path}")
    return file


# package, path, palm to name, fingers (thumb marked *), closing joints, couplings
CASES = [
    ("gymnasium_robotics", "envs/assets/hand/reach.xml", None, "ff mf rf lf th*", 14, 0),
    ("gymnasium_robotics", "envs/assets/adroit_hand/adroit_relocate.xml", None, "ff mf rf lf th*", 14, 0),
    ("robosuite", "models/assets/grippers/inspire_right_hand.xml", None, "thumb* index middle ring pinky", 11, None),
    ("robosuite", "models/assets/grippers/fourier_right_hand.xml", None, "thumb* index middle ring pinky", 10, None),
    ("dexmate_urdf", "robots/hands/f5d6_hand/f5d6_right.urdf", None, "th* ff mf rf lf", 10, 5),
]
#: A whole robot with two hands: its meshes take most of the time.
HUMANOID = ("dexmate_urdf", "robots/humanoid/vega_1/vega_1_f5d6.urdf", "R_hand_base", "th* ff mf rf lf", 10, 5)


@pytest.mark.parametrize(
    ("package", "path", "palm", "names", "count", "coupled"),
    [*CASES, pytest.param(*HUMANOID, marks=pytest.mark.long)],
    ids=[Path(c[1]).stem for c in (*CASES, HUMANOID)],
)
def test_packaged_hands(package: str, path: str, palm: str | None, names: str, count: int, coupled: int | None) -> None:
    hand = Hand.load(packaged(package, path), palm=palm)
    assert " ".join(f.name + "*" * f.is_thumb for f in hand.fingers) == names
    assert sum(j.role == "closing" for j in hand.joints) == count
    if coupled is not None:
        assert len(hand.couplings) == coupled
    # A model that had to be changed is written anew, with six digits.
    changed = any(f.code in ("links_left_out", "collision_from_visuals") for f in hand.findings)
    assert_same_kinematics(hand, np.random.default_rng(0), 1e-5 if changed else 1e-12)


@pytest.mark.parametrize(("package", "path"), [c[:2] for c in CASES], ids=[Path(c[1]).stem for c in CASES])
def test_packaged_hands_close_around_a_ball(package: str, path: str) -> None:
    """The ball lies between the fingertips when they are half closed, so that some of them must touch it."""
    import clench
    from clench.models.hand.understanding.finger_geometry import finger_line

    hand = Hand.load(packaged(package, path))
    q = hand.open_angles()
    for i, joint in enumerate(hand.joints):
        if joint.role == "closing":
            q[i] += 0.5 * ((joint.upper if joint.direction > 0 else joint.lower) - q[i])
    tips = [finger_line(hand, f, hand.coupled(q)).tip for f in hand.fingers if not f.is_thumb]
    place = np.mean(tips, axis=0) + 0.02 * hand.palm_normal
    obj = clench.GraspObject.load("sphere:r=0.02", pose=clench.Pose(place))
    solution = clench.solve(hand, obj, clench.GraspCommand(hand_pose=clench.Pose.identity(), planes=3))
    touching = [f for f in solution.fingers.values() if f.status == "touch"]
    assert len(touching) >= 2
    assert all(abs(c.gap) < 1e-9 for c in solution.contacts if not c.passed)
    assert all(f.cause is not None for f in solution.fingers.values() if f.status != "touch")


@pytest.mark.long
def test_a_humanoid_lists_its_hands() -> None:
    path = packaged(*HUMANOID[:2])
    with pytest.raises(HandError, match=r"'L_hand_base', 'R_hand_base'.*name the palm"):
        Hand.load(path)


def test_a_gripper_with_sliding_fingers_is_refused() -> None:
    path = packaged("robosuite", "models/assets/grippers/panda_gripper.xml")
    with pytest.raises(HandError, match="'finger_joint1' of link 'leftfinger' is prismatic"):
        Hand.load(path)
