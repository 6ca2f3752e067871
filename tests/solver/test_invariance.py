"""Answers do not depend on where the scene is, how large it is, which hand it is, or who else is solving."""

import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import clench
from chain_hands import HandBuilder, along_x, mount, turned
from clench.core.pose import Pose
from clench.models.shapes import Shape, ShapeKind
from solver.images import mirrored_hand, mirrored_object, mirrored_pose, scaled_hand, scaled_object, scaled_pose

EXACT = 1e-9
HANDS = {
    "Allegro": "hands/wonik_allegro_mjcf/right_hand.xml",
    "Barrett": "hands/barrett_hand_urdf/bhand_model.urdf",
    "ORCA": "hands/orca_v1_mjcf/orcahand_right.mjcf",
    "LEAP": "hands/leap_hand_urdf/leap_hand_right.urdf",
}
TORUS = "objects/cdb_torusmedium/torusmedium.stl"
unit = st.floats(-1.0, 1.0)
poses = st.builds(
    lambda p, q: Pose(p, wxyz=np.array(q) / np.linalg.norm(q)),
    st.tuples(unit, unit, unit),
    st.tuples(unit, unit, unit, unit).filter(lambda q: np.linalg.norm(q) > 0.1),
)


def two_fingers():
    """Return a palm with a finger of three capsules, a coupled one of boxes, and a thumb across."""
    palm = Shape(ShapeKind.BOX, (0.03, 0.03, 0.005), Pose([0.0, 0.0, -0.02]))
    builder = HandBuilder(palm)
    builder.finger(
        "index", [along_x(0.007, n) for n in (0.04, 0.03, 0.02)], (0.04, 0.03, 0.02), base=mount((0.02, 0.015, 0))
    )
    boxes = [Shape(ShapeKind.BOX, (0.02, 0.006, 0.005), Pose([0.02, 0, 0])) for _ in range(2)]
    builder.finger("ring", boxes, (0.04, 0.04), base=mount((0.02, -0.015, 0)), upper=1.5)
    builder.couple("ring_0", "ring_1", 0.8)
    builder.finger(
        "thumb",
        [along_x(0.008, 0.05)] * 2,
        (0.05, 0.05),
        base=mount((-0.02, 0.002, 0), turned([0, 0, 1.0], 2.9)),
        thumb=True,
    )
    return builder.hand()


OBJECTS = [
    clench.GraspObject.load(
        "ellipsoid:a=0.02,b=0.03,c=0.015", pose=Pose([0.04, 0.003, 0.03], wxyz=[0.8, 0.36, 0.48, 0.0])
    ),
    clench.GraspObject.load("box:x=0.05,y=0.07,z=0.02", pose=Pose([0.02, 0.003, 0.03], wxyz=[0.96, 0.0, 0.28, 0.0])),
    clench.GraspObject.load("cylinder:r=0.02,h=0.09", pose=Pose([0.02, 0.003, 0.035], wxyz=[0.6, 0.64, 0.48, 0.0])),
]


def sets(solution):
    """Return the angles of every set of every finger, planes from one edge of the finger to the other."""
    return {
        name: [(c.plane is None, c.offset, np.array(list(c.joint_angles.values()))) for c in finger.candidates]
        for name, finger in solution.fingers.items()
    }


def assert_same(first, second, flipped=False):
    assert first.status == second.status
    a, b = sets(first), sets(second)
    assert a.keys() == b.keys()
    for name in a:
        planes = [s for s in b[name] if not s[0]]
        order = [*(reversed(planes) if flipped else planes), *(s for s in b[name] if s[0])]
        assert len(order) == len(a[name])
        for (_, _, p), (_, _, q) in zip(a[name], order, strict=True):
            np.testing.assert_allclose(p, q, atol=EXACT, rtol=0)
        assert first.fingers[name].status == second.fingers[name].status


@settings(max_examples=20, deadline=None)
@given(motion=poses, number=st.integers(0, 2))
def test_rigid_motion_of_everything(motion, number):
    hand, obj = two_fingers(), OBJECTS[number]
    here = clench.solve(hand, obj, clench.GraspCommand(hand_pose=Pose.identity(), preshape="open"))
    there = clench.solve(hand, obj.posed(motion @ obj.pose), clench.GraspCommand(hand_pose=motion, preshape="open"))
    assert_same(here, there)
    if number:
        return  # where a flat side lies on a flat face any of the equal contacts may be named
    for a, b in zip(here.contacts, there.contacts, strict=True):
        np.testing.assert_allclose(motion.apply(a.position), b.position, atol=1e-9)
        np.testing.assert_allclose(motion.rotation @ a.normal, b.normal, atol=1e-7)


@pytest.mark.parametrize("obj", OBJECTS, ids=lambda o: o.name)
def test_mirror_image(obj):
    hand = two_fingers()
    right = clench.solve(hand, obj, clench.GraspCommand(hand_pose=Pose.identity(), preshape="open"))
    left = clench.solve(
        mirrored_hand(hand), mirrored_object(obj), clench.GraspCommand(hand_pose=Pose.identity(), preshape="open")
    )
    assert any(f.status == "touch" for f in right.fingers.values())
    assert_same(right, left, flipped=True)


@pytest.mark.parametrize("factor", [1e-3, 0.1, 30.0])
@pytest.mark.parametrize("obj", OBJECTS, ids=lambda o: o.name)
def test_scale(obj, factor):
    hand = two_fingers()
    command = clench.GraspCommand(hand_pose=Pose.identity(), preshape="open")
    assert_same(
        clench.solve(hand, obj, command), clench.solve(scaled_hand(hand, factor), scaled_object(obj, factor), command)
    )


def document(solution):
    data = solution.to_dict()
    del data["timing"]
    return json.dumps(data)


def test_the_same_bits_again_and_in_many_threads():
    hand = two_fingers()
    turns = [Pose([0.001 * k, 0.0, 0.0]) for k in range(6)]
    work = [
        (obj, clench.GraspCommand(hand_pose=turn, planes=3 + k % 3, preshape="open"))
        for k, turn in enumerate(turns)
        for obj in OBJECTS
    ]
    alone = [document(clench.solve(hand, obj, command)) for obj, command in work]
    assert alone == [document(clench.solve(hand, obj, command)) for obj, command in work]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda w: document(clench.solve(two_fingers(), *w)), work * 2))
    assert together == alone * 2


def test_a_plan_that_was_kept_gives_what_a_new_hand_gives():
    """Neither the order of solves nor what was solved before plays a part."""
    hand, command = two_fingers(), clench.GraspCommand(hand_pose=Pose.identity(), preshape="open")
    first = [document(clench.solve(two_fingers(), obj, command)) for obj in OBJECTS]
    for obj, expected in [*zip(OBJECTS[::-1], first[::-1], strict=True), *zip(OBJECTS, first, strict=True)]:
        assert document(clench.solve(hand, obj, command)) == expected


@pytest.mark.shared
@pytest.mark.parametrize("model", HANDS.values(), ids=HANDS)
def test_real_hands_moved_and_scaled(shared_data, model):
    hand = clench.Hand.load(shared_data / model)
    obj = clench.GraspObject.load(shared_data / TORUS)
    motion = Pose([0.3, -0.7, 1.1], wxyz=np.array([0.5, -0.1, 0.7, 0.5]))
    small, smaller = scaled_hand(hand, 0.01), scaled_object(obj, 0.01)
    for pose in clench.approach_poses(hand, obj, 2, seed=3):
        here = clench.solve(hand, obj, clench.GraspCommand(hand_pose=pose, preshape="open"))
        assert_same(
            here, clench.solve(hand, obj.posed(motion), clench.GraspCommand(hand_pose=motion @ pose, preshape="open"))
        )
        assert_same(
            here, clench.solve(small, smaller, clench.GraspCommand(hand_pose=scaled_pose(pose, 0.01), preshape="open"))
        )


@pytest.mark.shared
@pytest.mark.parametrize("model", HANDS.values(), ids=HANDS)
def test_real_hands_mirrored(shared_data, model):
    hand = clench.Hand.load(shared_data / model)
    obj = clench.GraspObject.load(shared_data / TORUS)
    left, image = mirrored_hand(hand), mirrored_object(obj)
    for pose in clench.approach_poses(hand, obj, 2, seed=3):
        here = clench.solve(hand, obj, clench.GraspCommand(hand_pose=pose, preshape="open"))
        assert_same(
            here,
            clench.solve(left, image, clench.GraspCommand(hand_pose=mirrored_pose(pose), preshape="open")),
            flipped=True,
        )
