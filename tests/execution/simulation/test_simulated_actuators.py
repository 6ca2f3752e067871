"""Actuators of the model move a simulated hand where they can; servos do the rest, and the report says which."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clench.apps.cli.inputs.actuators import ActuatorOptions, make_actuator
from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray, Pose
from clench.execution.executing import execute
from clench.execution.simulation.hold import Hold
from clench.execution.simulation.mujoco_scene import Scene, build_scene
from clench.execution.simulation.simulated_actuators import Drive
from clench.execution.simulation.simulated_hand import SimulatedHand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import Body, GraspObject
from clench.models.shapes import Shape, ShapeKind
from clench.solver.solution import GraspSolution

FAR = GraspObject("far", (Body("far", (Shape(ShapeKind.SPHERE, (0.01, 0.0, 0.0)),)),), pose=Pose([9.0, 0.0, 0.0]))
MOTOR = '<actuator><motor joint="thumb"/></actuator>'
EQUALITY = '<equality><joint joint1="index_tip" joint2="index"/></equality>'
POSITIONS = (
    '<position name="a_thumb" joint="thumb" kp="8" kv="0.3"/><position name="a_index" joint="index" kp="6" kv="0.3"/>'
)
#: A general actuator that counts 0 to 255 instead of radians, with a gear: q = 1 rad at 170.
GENERAL = (
    '<general name="a_thumb" joint="thumb" gear="2" gaintype="fixed" gainprm="0.0235294117647" '
    'biastype="affine" biasprm="0 -2 -0.2"/>'
)
TENDON = (
    '<tendon><fixed name="t"><joint joint="index" coef="0.5"/><joint joint="index_tip" coef="0.5"/></fixed></tendon>'
)
PULL = '<position name="a_tendon" tendon="t" kp="20" kv="1"/>'


def changed(hand: Hand, actuators: str, others: str = EQUALITY) -> Hand:
    """Give the pincer other actuators, and joints as real models have them: damped, with the inertia of a drive."""
    damped = '<default><joint damping="0.2" armature="0.002"/></default><worldbody>'
    smooth = hand.spec_xml.replace('stiffness="1" frictionloss="0.1"', "").replace("<worldbody>", damped)
    return replace(hand, spec_xml=smooth.replace(MOTOR, f"<actuator>{actuators}</actuator>").replace(EQUALITY, others))


def reached(scene: Scene, q: FloatArray, seconds: float = 1.5) -> FloatArray:
    import mujoco

    data = mujoco.MjData(scene.model)
    data.ctrl[scene.drives.numbers] = scene.drives.command(q)
    for _ in range(round(seconds / scene.model.opt.timestep)):
        mujoco.mj_step(scene.model, data)
    return np.array(data.qpos[scene.qpos])


@pytest.mark.parametrize(
    ("actuators", "others", "by"),
    [
        (POSITIONS, EQUALITY, ("a_thumb", "a_index", "coupled")),
        (GENERAL, EQUALITY, ("a_thumb", "servo", "coupled")),
        (GENERAL + PULL, TENDON, ("a_thumb", "a_tendon", "a_tendon")),
        (GENERAL, "", ("a_thumb", "servo", "servo")),
    ],
)
def test_what_a_posture_asks_for_is_reached(pincer: Hand, actuators: str, others: str, by: tuple[str, ...]) -> None:
    hand = changed(pincer, actuators, others)
    q = np.array([0.3, 0.15, 0.15])
    scene = build_scene(hand, FAR, Pose.identity(), np.zeros(3), drive=Drive.MODEL)
    assert tuple(scene.drives.driven.by.values()) == by
    assert scene.model.nu == len(set(by) - {"coupled", "servo"}) + by.count("servo")
    found = reached(scene, q)
    np.testing.assert_allclose(scene.drives.arms @ found, scene.drives.arms @ q, atol=1e-3)
    if by[2] != by[1] or by[1] == "servo":  # one tendon sets the sum of its joints' angles only
        np.testing.assert_allclose(found, q, atol=1e-3)


def test_controls_are_in_the_actuators_own_units(pincer: Hand) -> None:
    scene = build_scene(changed(pincer, GENERAL + PULL, TENDON), FAR, Pose.identity(), np.zeros(3), drive=Drive.MODEL)
    told = scene.drives.command(np.array([1.0, 0.4, 0.2]))
    np.testing.assert_allclose(told, [2.0 / 0.0235294117647 * 2.0, 0.3], rtol=1e-12)


def test_torques_become_forces_that_do_the_same_work(pincer: Hand) -> None:
    """A tendon with arms of 0.5 on coupled joints: one radian of both is 1 of length, and torques add up."""
    hand = changed(pincer, GENERAL + PULL, TENDON)
    scene = build_scene(hand, FAR, Pose.identity(), np.zeros(3), drive=Drive.MODEL)
    added = scene.drives.pressing(hand, np.zeros(3), np.array([0.4, 0.2, 0.1]))
    np.testing.assert_allclose(added * [0.0235294117647, 20.0], [0.4 / 2.0, 0.3], rtol=1e-9)


def test_a_model_without_position_actuators_has_servos_and_says_so(
    pincer: Hand, pinch: GraspSolution, ball: GraspObject
) -> None:
    servo = execute(pinch, SimulatedHand(pincer, ball))
    report = execute(pinch, SimulatedHand(pincer, ball, drive="model"))
    assert report.joints == servo.joints
    assert set(report.driven_by.values()) == {"servo"}
    assert any("has no position actuators for this hand: all joints had servos" in note for note in report.notes)
    assert any(note.endswith("no position servos of joints or fixed tendons: 'actuator 0'.") for note in report.notes)
    assert servo.driven_by == report.driven_by
    assert not any("actuator" in note for note in servo.notes)


def test_the_models_actuators_close_and_hold(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    hold = Hold(friction=1.0, contact_model="soft", duration=0.2)
    report = execute(pinch, SimulatedHand(changed(pincer, POSITIONS), ball, hold=hold, drive="model"))
    assert report.success, report.reason
    assert report.to_dict()["driven_by"] == {"thumb": "a_thumb", "index": "a_index", "index_tip": "coupled"}
    assert any("moved by 2 actuators of the model, 1 followed" in note for note in report.notes)
    assert report.hold is not None
    for force in report.hold.forces.values():
        assert force.measured == pytest.approx(force.planned, rel=0.1)


def test_only_what_there_is_can_be_chosen(pincer: Hand, ball: GraspObject) -> None:
    with pytest.raises(CommandError, match="drive: expected one of servo, model, got 'motor'"):
        SimulatedHand(pincer, ball, drive="motor")
    options = ActuatorOptions(None, None, None, None, None, 1.0, None, None, drive="model")
    with pytest.raises(CommandError, match="--drive means nothing to --actuator ros2"):
        make_actuator("ros2", pincer, ball, options, show_progress=False)
