"""A mirrored hand closes around a mirrored object as the hand does around the object; so it does in simulation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import clench
from clench.core.exceptions import HandError
from clench.models.hand.mirroring import mirrored_mesh, mirrored_pose

SIGNS = np.array([1.0, -1.0, 1.0])
MUG_POSE = clench.Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5])
REAL = ("shadow_hand_mjcf/right_hand.xml", "leap_hand_urdf/leap_hand_right.urdf", "orca_v1_mjcf/orcahand_right.mjcf")


@pytest.fixture(scope="module")
def hand() -> clench.Hand:
    return clench.Hand.load("robonaut2")


@pytest.fixture(scope="module")
def mug() -> clench.GraspObject:
    return clench.GraspObject.load("mug")


def mirrored_object(obj: clench.GraspObject) -> clench.GraspObject:
    """Return the mirror image of an object of meshes."""
    bodies = []
    for body in obj.bodies:
        shapes = [replace(s, mesh=mirrored_mesh(s.mesh), pose=mirrored_pose(s.pose)) for s in body.shapes]
        bodies.append(replace(body, shapes=tuple(shapes), pieces=tuple(map(mirrored_mesh, body.pieces))))
    return replace(obj, bodies=tuple(bodies), pose=mirrored_pose(obj.pose))


def test_mirrored_inputs_give_mirrored_answers(hand: clench.Hand, mug: clench.GraspObject) -> None:
    other, gum = hand.mirrored(), mirrored_object(mug)
    poses = [MUG_POSE, *clench.approach_poses(hand, mug, 20, 0)]
    # Preshapes are drawn for each hand by itself, so a choice among them has no mirror image.
    opened = clench.GraspCommand(MUG_POSE, preshape="open")
    answers = clench.solve_batch(hand, mug, poses, opened)
    images = clench.solve_batch(other, gum, [mirrored_pose(pose) for pose in poses], opened)
    assert answers.counts()["grasp"] >= 10
    assert images.status.tolist() == answers.status.tolist()
    assert images.certified.tolist() == answers.certified.tolist()
    np.testing.assert_allclose(images.joint_angles, answers.joint_angles, rtol=0.0, atol=1e-9)
    # Whole answers, too, of every order.
    for order in clench.ClosingOrder:
        command = clench.GraspCommand(MUG_POSE, order=order, preshape="open")
        one = clench.solve(hand, mug, command)
        image = clench.solve(other, gum, replace(command, hand_pose=mirrored_pose(MUG_POSE)))
        assert [(c.finger, c.link) for c in image.contacts] == [(c.finger, c.link) for c in one.contacts] != []
        for c, d in zip(one.contacts, image.contacts, strict=True):
            np.testing.assert_allclose(d.position, SIGNS * c.position, atol=1e-7)
            np.testing.assert_allclose(d.normal, SIGNS * c.normal, atol=1e-7)


def test_names_stay_and_twice_is_the_same(hand: clench.Hand) -> None:
    other = hand.mirrored()
    assert other.name == "robonaut2_mirrored"
    assert other.path is None
    assert other.joint_names == hand.joint_names
    assert [link.name for link in other.links] == [link.name for link in hand.links]
    assert (other.fingers, other.couplings, other.tendons) == (hand.fingers, hand.couplings, hand.tendons)
    np.testing.assert_array_equal(other.palm_center, SIGNS * hand.palm_center)
    twice = other.mirrored()
    q = np.random.default_rng(0).uniform(-1.0, 1.0, len(hand.joints))
    np.testing.assert_array_equal(twice.link_poses(q), hand.link_poses(q))
    S = np.diag([*SIGNS, 1.0])
    np.testing.assert_allclose(other.link_poses(q), S @ hand.link_poses(q) @ S, atol=1e-15)


def same_motion(text: str, image: str, assets: dict[str, bytes], steps: int, within: float) -> None:
    """Assert that two models are mirror images at random postures, and stay so while they are driven."""
    import mujoco

    models = [mujoco.MjSpec.from_string(xml, assets=assets).compile() for xml in (text, image)]
    rng = np.random.default_rng(1)
    q, told = rng.uniform(-0.3, 0.3, models[0].nq), rng.uniform(-0.5, 0.5, models[0].nu)
    places, turns = [], []
    for number, model in enumerate(models):
        if number:
            for joint in np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_BALL):
                # The turn of a ball joint is mirrored as that of a body is.
                q[model.jnt_qposadr[joint] :][:4] *= [1.0, -1.0, 1.0, -1.0]
        model.opt.gravity[:] = [0.5, 0.0, -9.81]
        data = mujoco.MjData(model)
        data.qpos[:], data.ctrl[:] = q, told
        mujoco.mj_step(model, data, steps)
        mujoco.mj_kinematics(model, data)
        assert np.isfinite(data.qpos).all()
        places.append(np.concatenate([data.xpos, data.geom_xpos, data.site_xpos]))
        turns.append(data.xmat.reshape(-1, 3, 3))
    np.testing.assert_allclose(places[1], SIGNS * places[0], atol=within)
    S = np.diag(SIGNS)
    np.testing.assert_allclose(turns[1], S @ turns[0] @ S, atol=within)
    np.testing.assert_allclose(models[1].body_mass, models[0].body_mass, rtol=1e-5)


def test_the_simulated_model_is_the_mirror_image(hand: clench.Hand) -> None:
    same_motion(hand.spec_xml, hand.mirrored().spec_xml, dict(hand.assets), steps=0, within=1e-5)
    same_motion(hand.spec_xml, hand.mirrored().spec_xml, dict(hand.assets), steps=20, within=1e-3)


@pytest.mark.shared
@pytest.mark.parametrize("model", REAL)
def test_simulated_models_of_real_hands_are_mirror_images(shared_data: Path, model: str) -> None:
    hand = clench.Hand.load(shared_data / "hands" / model)
    same_motion(hand.spec_xml, hand.mirrored().spec_xml, dict(hand.assets), steps=0, within=1e-5)


#: Every element that has a place, a direction or a turn.
ALL_KINDS = """
<mujoco><compiler angle="degree" eulerseq="XYZ"/>
<default><joint axis="0 1 0" damping="0.1"/><geom density="500"/></default>
<asset><mesh name="wedge" vertex="0 0 0 0.05 0 0 0 0.04 0 0 0 0.06 0.05 0.04 0.01" scale="1 2 1"/></asset>
<worldbody>
 <light pos="1 2 3" dir="0 0.3 -1"/><camera pos="0 1 0" euler="90 10 0"/><site name="fixed" pos="0 0.5 0.3"/>
 <body name="a" pos="0.1 0.2 0.3" euler="10 20 30">
  <joint name="hinge"/><geom type="capsule" fromto="0 0 0 0.1 0.02 0.03" size="0.01"/>
  <frame pos="0 0.02 0" euler="0 0 15"><geom type="mesh" mesh="wedge" pos="0.05 0.02 0"/></frame>
  <site name="tip" pos="0.1 0.03 0" euler="5 6 7"/>
  <body name="b" pos="0.1 0.03 0" axisangle="1 1 0 25">
   <inertial pos="0.01 0.02 0.03" mass="0.2" fullinertia="0.0011 0.0012 0.0013 0.0001 0.0002 0.00005"/>
   <joint name="slide" type="slide" axis="0.6 0.8 0"/><joint name="bend" axis="0 0 1" pos="0 0.01 0"/>
   <geom type="box" size="0.01 0.02 0.03" pos="0 0.03 0.01" euler="0 0 40"/>
   <site name="end" pos="0 0.05 0"/>
  </body>
 </body>
 <body name="c" pos="-0.1 0.1 0"><joint name="ball" type="ball"/><geom size="0.02" pos="0.05 0.05 0"/></body>
 <body name="d" pos="-0.3 0.1 0.1" euler="0 30 0"><joint axis="1 0 0"/><geom size="0.02" pos="0.05 0.05 0"/></body>
</worldbody>
<tendon><fixed name="tie"><joint joint="hinge" coef="1"/><joint joint="bend" coef="-0.5"/></fixed>
 <spatial name="rope" stiffness="20"><site site="fixed"/><site site="tip"/></spatial></tendon>
<equality><connect body1="c" body2="d" anchor="0.01 0.02 0.03"/>
 <weld body1="d" relpose="-0.3 0.1 0.1 0.96 0.1 0.26 0"/></equality>
<actuator><position joint="hinge" kp="2"/><general site="end" gear="0.2 0.3 0.1 0.01 0.02 0.03"/>
 <position tendon="tie" kp="1"/></actuator>
<keyframe><key qpos="0 0 0 1 0 0 0 0"/></keyframe>
</mujoco>"""


def test_every_kind_of_element_is_mirrored(hand: clench.Hand) -> None:
    image = replace(hand, spec_xml=ALL_KINDS, assets={}).mirrored().spec_xml
    same_motion(ALL_KINDS, image, {}, steps=0, within=2e-6)
    same_motion(ALL_KINDS, image, {}, steps=50, within=2e-4)


def test_a_mirrored_hand_is_simulated(hand: clench.Hand, mug: clench.GraspObject) -> None:
    other, gum = hand.mirrored(), mirrored_object(mug)
    solution = clench.solve(other, gum, mirrored_pose(MUG_POSE))
    report = clench.execute(solution, clench.SimulatedHand(other, gum))
    assert report.success, report.reason
    bare = replace(hand, spec_xml="").mirrored()
    with pytest.raises(HandError, match=r"'robonaut2_mirrored' has no model that can be simulated"):
        clench.execute(clench.solve(bare, gum, mirrored_pose(MUG_POSE)), clench.SimulatedHand(bare, gum))


def test_a_model_that_cannot_be_mirrored_is_refused(hand: clench.Hand) -> None:
    with pytest.raises(HandError, match=r"Hand 'robonaut2': MuJoCo cannot compile the mirror image of its model: "):
        replace(hand, spec_xml="<mujoco><worldbody><body><joint/></body></worldbody></mujoco>").mirrored()
