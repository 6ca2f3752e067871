"""The reserves of a squeeze: ranges of mass and friction, friction in the joints, the largest total force, servos."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clench
from clench.core.defaults import FRICTION, FRICTION_RESERVE, LOSS_RESERVE, MASS, MOST_FORCE_PER_WEIGHT
from clench.core.exceptions import CommandError
from clench.execution.simulation.hold import Hold
from clench.mechanics.grasp.held import HeldObject
from clench.mechanics.grasp.loads import GRAVITY
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.analysis.squeezing import SqueezePlan, plan_squeeze
from clench.solver.solution import GraspSolution

Grip = tuple[Hand, GraspObject, GraspSolution]


@pytest.fixture(scope="module")
def grip() -> Grip:
    hand, ball = clench.Hand.load("robonaut2"), clench.GraspObject.load("sphere:r=0.03")
    for pose in clench.approach_poses(hand, ball, 20, 1):
        solution = clench.solve(hand, ball, clench.GraspCommand(hand_pose=pose, preshape="open"))
        if solution.is_valid() and plan_squeeze(solution, hand, ball, gravity=None).feasible:
            return hand, ball, solution
    raise AssertionError("no grip found")


def slack(plan: SqueezePlan, friction: float, extra: np.ndarray) -> float:
    """How far the planned forces lie inside cones of another friction when an external wrench is added [N]."""
    held: HeldObject = plan.grasp.held
    change = np.linalg.pinv(held.grasp_map) @ extra
    forces = plan.found.plan.forces.reshape(-1) - change
    cones = held.with_friction(np.full(len(held.contacts), friction)).contacts
    return float(cones.cone_slack(forces.reshape(-1, 3)).min())


def weight(plan: SqueezePlan, mass: float) -> np.ndarray:
    return np.append(mass * GRAVITY * plan.grasp.palm_direction([0.0, 0.0, -1.0]), np.zeros(3))


def test_forces_for_a_range_of_masses_hold_both_ends(grip: Grip) -> None:
    hand, ball, solution = grip
    plan = plan_squeeze(solution, hand, ball, mass=(0.05, 0.5), margin=0.5)
    assert plan.feasible
    assert (plan.lightest, plan.mass) == (0.05, 0.5)
    assert "Holds 0.05 to 0.5 kg under gravity" in plan.text
    assert plan.to_dict()["mass_range"] == [0.05, 0.5]
    for mass in (0.05, 0.2, 0.5):
        for pull in np.vstack([np.eye(6), -np.eye(6)]) * 0.5 * plan.mass * GRAVITY * plan.margin:
            extra = weight(plan, mass) - weight(plan, 0.275) + pull
            assert slack(plan, FRICTION_RESERVE * FRICTION, extra) > -1e-6
    # With hardly any disturbance it is the ends of the range that the forces have to be made for.
    calm = plan_squeeze(solution, hand, ball, mass=(0.05, 0.5), disturbances=[[1e-3, 0.0, 0.0, 0.0, 0.0, 0.0]])
    for mass in (0.05, 0.5):
        assert slack(calm, FRICTION_RESERVE * FRICTION, weight(calm, mass) - weight(calm, 0.275)) > -1e-6


def test_one_mass_is_a_range_of_one_value(grip: Grip) -> None:
    hand, ball, solution = grip
    one, same = (plan_squeeze(solution, hand, ball, mass=mass) for mass in (0.1, (0.1, 0.1)))
    np.testing.assert_array_equal(one.forces, same.forces)


def test_of_a_range_of_friction_the_lowest_counts_and_a_part_of_it_is_kept_back(grip: Grip) -> None:
    hand, ball, solution = grip
    plan = plan_squeeze(solution, hand, ball, friction=(0.5, 0.8), gravity=None)
    assert plan.feasible
    assert set(plan.to_dict()["friction"]) == {0.5}
    assert plan.to_dict()["friction_reserve"] == FRICTION_RESERVE
    assert "counts on 80 % of the friction" in plan.text
    assert slack(plan, 0.8 * 0.5, np.zeros(6)) > -1e-6
    whole = plan_squeeze(solution, hand, ball, friction=0.5, gravity=None, reserve=1.0)
    assert slack(whole, 0.8 * 0.5, np.zeros(6)) < 0.0 or whole.found.plan.worst_torque < plan.found.plan.worst_torque


def test_without_enough_friction_for_the_reserve_all_of_it_is_counted_on(grip: Grip) -> None:
    hand, ball, solution = grip
    for friction in np.linspace(0.6, 0.02, 30):
        careful = plan_squeeze(solution, hand, ball, friction=friction, gravity=None)
        if careful.found.reserve == 1.0:
            break
    assert careful.feasible == (careful.margin >= 1.0 and not careful.found.unresisted)
    assert not plan_squeeze(
        solution, hand, ball, friction=FRICTION_RESERVE * friction, gravity=None, reserve=1.0
    ).feasible
    if careful.feasible:
        assert "counts on all of the friction" in careful.text


def test_torques_are_well_above_the_friction_of_the_joints(grip: Grip) -> None:
    hand, ball, solution = grip
    bare = replace(hand, joints=tuple(replace(j, friction_loss=0.0) for j in hand.joints))
    rough = replace(hand, joints=tuple(replace(j, friction_loss=0.02) for j in hand.joints))
    free, pressed = (plan_squeeze(solution, h, ball, mass=0.02, gravity=None) for h in (bare, rough))
    assert free.found.loss == 0.0
    assert pressed.feasible
    assert pressed.found.plan.worst_torque > 1.5 * free.found.plan.worst_torque
    assert pressed.found.loss <= (1.0 + 1e-6) / LOSS_RESERVE or pressed.found.plan.forces[:, 2].sum() > 9.99
    assert np.abs(pressed.forces.sum(axis=0)).max() < 1e-9


def test_the_total_force_is_bounded_per_weight(grip: Grip) -> None:
    hand, ball, solution = grip
    for friction in (0.6, 0.3, 0.2, 0.1, 0.05):
        plan = plan_squeeze(solution, hand, ball, mass=0.5, friction=friction, margin=50.0)
        if plan.found.plan is not None:
            assert plan.found.plan.forces[:, 2].sum() <= MOST_FORCE_PER_WEIGHT * 0.5 * GRAVITY * (1.0 + 1e-6)
    assert plan_squeeze(solution, hand, ball, mass=0.5, margin=50.0).margin < 50.0


def test_one_set_of_defaults() -> None:
    hold = Hold()
    assert (hold.mass, hold.friction) == (MASS, FRICTION)
    assert hold.planned_for == (MASS, FRICTION)
    assert Hold(planned_mass=(0.05, 0.5)).planned_for == ((0.05, 0.5), FRICTION)
    for function in (clench.grasp_quality, plan_squeeze, clench.complete):
        assert function.__kwdefaults__["mass"] == MASS
        assert function.__kwdefaults__["friction"] is None


def test_ranges_the_wrong_way_round_are_refused(grip: Grip) -> None:
    hand, ball, solution = grip
    for key in ("mass", "friction"):
        with pytest.raises(
            CommandError, match=rf"{key}: expected a number, or a range \(least, largest\), got \(0.5, 0.1\)"
        ):
            plan_squeeze(solution, hand, ball, **{key: (0.5, 0.1)})
    with pytest.raises(CommandError, match=r"hold: planned_mass: expected a number, or a range"):
        Hold(planned_mass=(0.5, 0.1))
    with pytest.raises(CommandError, match=r"reserve: expected a part of the friction, above 0 and up to 1, got 0.0"):
        plan_squeeze(solution, hand, ball, reserve=0.0)


TENDON_HAND = """
<mujoco>
  <worldbody><body name="palm">
    <geom type="box" size="0.03 0.03 0.005"/>
    <body name="near" pos="0.02 0 0.01">
      <joint name="near" axis="0 -1 0" range="0 1.5" frictionloss="0.01"/>
      <geom type="capsule" fromto="0 0 0 0 0 0.03" size="0.006"/>
      <body name="far" pos="0 0 0.03">
        <joint name="far" axis="0 -1 0" range="0 1.5"/><geom type="capsule" fromto="0 0 0 0 0 0.03" size="0.006"/>
      </body>
    </body>
    <body name="thumb" pos="-0.02 0 0.01">
      <joint name="thumb" axis="0 1 0" range="0 1.5"/><geom type="capsule" fromto="0 0 0 0 0 0.05" size="0.006"/>
    </body>
  </body></worldbody>
  <tendon><fixed name="both"><joint joint="near" coef="2"/><joint joint="far" coef="1"/></fixed></tendon>
  <actuator>
    <position name="pull" tendon="both" kp="3" gear="0.5"/>
    <position name="thumb" joint="thumb" kp="4"/>
  </actuator>
</mujoco>
"""


def test_the_servo_of_a_tendon_is_told_what_exerts_its_torques(tmp_path) -> None:
    """Told `tau / stiffness` more at each joint, the servo in MuJoCo exerts just these torques."""
    import mujoco

    (tmp_path / "hand.xml").write_text(TENDON_HAND)
    hand = clench.Hand.load(tmp_path / "hand.xml")
    near, far = (hand.joints[hand.joint_index(name)] for name in ("near", "far"))
    assert (near.friction_loss, far.friction_loss) == (0.01, 0.0)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "hand.xml"))
    data = mujoco.MjData(model)
    tension = 0.7
    torques = 0.5 * np.array([2.0, 1.0]) * tension
    moment = 0.5 * np.array([2.0, 1.0])
    data.ctrl[0] = moment @ (torques / [near.stiffness, far.stiffness])
    mujoco.mj_forward(model, data)
    at = [model.joint(name).dofadr[0] for name in ("near", "far")]
    np.testing.assert_allclose(data.qfrc_actuator[at], torques, rtol=1e-12)


def test_torques_without_limits_are_said(grip: Grip) -> None:
    hand, ball, solution = grip
    assert "without limits" not in plan_squeeze(solution, hand, ball).text
    free = replace(hand, tendons=None, joints=tuple(replace(j, effort=None) for j in hand.joints))
    plan = plan_squeeze(solution, free, ball)
    loaded = {name for name, torque in plan.torques.items() if torque}
    assert loaded <= set(plan.unlimited)
    others = len(plan.unlimited) - 2
    named = f"of '{plan.unlimited[0]}', '{plan.unlimited[1]}' and {others} other joints."
    assert plan.text.endswith(f" Torques are without limits, since the hand has no effort limits {named}")
    assert plan.to_dict()["text"] == plan.text
    found = clench.plan_grasps(free, ball, 1, effort=16, most=64, path=False)
    assert "Torques are without limits, since the hand has no effort limits of" in found.text
    assert "without limits" not in clench.plan_grasps(hand, ball, 1, effort=16, most=64, path=False).text
    endless = replace(hand, tendons=replace(hand.tendons, t_max=(np.inf,) * hand.tendons.count), joints=free.joints)
    assert plan_squeeze(solution, endless, ball).unlimited
    pulled = replace(hand, joints=free.joints)
    assert not set(plan_squeeze(solution, pulled, ball).unlimited) & set(hand.tendons.joints)
