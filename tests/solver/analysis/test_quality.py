"""Quality and squeeze of solutions: conventions, world frames, invariance, limits that bind, bad input."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import clench
from clench.core.exceptions import CommandError
from clench.core.pose import Pose
from clench.mechanics.grasp.loads import GRAVITY
from clench.solver.analysis import quality, squeezing


@pytest.fixture(scope="module")
def grip():
    """A hand around a small ball, with contacts all around."""
    hand, ball = clench.Hand.load("robonaut2"), clench.GraspObject.load("sphere:r=0.03").with_friction(0.8)
    for pose in clench.approach_poses(hand, ball, 20, 1):
        solution = clench.solve(hand, ball, clench.GraspCommand(hand_pose=pose, preshape="open"))
        if solution.is_valid() and clench.grasp_quality(solution, hand, ball).epsilon.radius > 0.1:
            return hand, ball, solution
    raise AssertionError("no grip found")


def test_quality_says_what_it_depends_on(grip) -> None:
    quality = clench.grasp_quality(grip[2], grip[0], grip[1], mass=0.15)
    document = quality.to_dict()
    assert json.loads(json.dumps(document)) == document
    assert document["norm"] == "L1"
    assert document["edges"] == 8
    assert document["contact_model"] == "point"
    assert document["length_scale"] == pytest.approx(0.03, rel=1e-9)
    assert set(document["friction"]) == {0.8}
    assert np.allclose(document["center_of_mass"], grip[2].object_pose.position, atol=1e-12)
    assert document["force_closure"] is True
    assert document["epsilon"] > 0.1
    assert document["actuation"]["worst_torque"] > 0.0
    assert document["actuation"]["worst_tension"] > 5.0
    assert document["epsilon_within_torques"] is None


def test_quality_moves_with_the_world(grip) -> None:
    hand, ball, solution = grip
    T = Pose([1.0, -2.0, 0.5], wxyz=np.array([0.3, -0.5, 0.7, 0.1]) / np.sqrt(0.84))
    moved = replace(
        solution,
        hand_pose=T @ solution.hand_pose,
        object_pose=T @ solution.object_pose,
        contacts=tuple(
            replace(c, position=T.apply(c.position), normal=T.rotation @ c.normal) for c in solution.contacts
        ),
    )
    one, other = (clench.grasp_quality(s, hand, ball) for s in (solution, moved))
    assert other.epsilon.radius == pytest.approx(one.epsilon.radius, abs=1e-9)
    assert other.volume == pytest.approx(one.volume, rel=1e-9)
    assert other.effort.worst_torque == pytest.approx(one.effort.worst_torque, rel=1e-4)
    down, turned = clench.plan_squeeze(solution, hand, ball), None
    turned = clench.plan_squeeze(moved, hand, ball, gravity=T.rotation @ [0.0, 0.0, -1.0])
    assert turned.margin == pytest.approx(down.margin, rel=1e-5)
    assert np.allclose(turned.forces @ T.rotation, down.forces, atol=1e-3)


def test_a_squeeze_balances_the_weight_in_the_world(grip) -> None:
    hand, ball, solution = grip
    for model in ("point", "soft"):
        plan = clench.plan_squeeze(solution, hand, ball, mass=0.2, contact_model=model)
        assert plan.feasible
        assert plan.text.startswith("Holds 0.2 kg under gravity, with disturbances up to")
        assert np.allclose(plan.forces.sum(axis=0), [0.0, 0.0, 0.2 * GRAVITY], atol=1e-9)
        places = np.array([c.position for c in plan.grasp.contacts]) - solution.object_pose.position
        inward = -np.array([c.normal for c in plan.grasp.contacts])
        torque = np.cross(places, plan.forces).sum(axis=0) + plan.twists @ inward
        assert np.abs(torque).max() < 1e-9
        along = (plan.forces * inward).sum(axis=1)
        assert (np.linalg.norm(plan.forces - along[:, None] * inward, axis=1) <= 0.8 * along + 1e-9).all()
        for name, torque_of_joint in plan.torques.items():
            assert abs(torque_of_joint) <= hand.joints[hand.joint_index(name)].effort + 1e-9
        assert plan.tensions.min() >= 5.0 - 1e-9
        assert plan.tensions.max() <= 300.0 + 1e-9
        assert json.loads(json.dumps(plan.to_dict())) == plan.to_dict()


def test_offsets_are_torque_over_gain_and_followers_follow(grip) -> None:
    hand, ball, solution = grip
    plan = clench.plan_squeeze(solution, hand, ball)
    assert plan.offsets["thumb_roll"] == pytest.approx(plan.torques["thumb_roll"] / 12.0, abs=1e-15)
    assert plan.offsets["ring_distal"] == pytest.approx(0.9 * plan.offsets["ring_proximal"], abs=1e-15)
    bare = replace(hand, joints=tuple(replace(j, stiffness=None) for j in hand.joints))
    assert clench.plan_squeeze(solution, bare, ball).offsets == {}


def test_weak_joints_are_named(grip) -> None:
    hand, ball, solution = grip
    weak = replace(hand, joints=tuple(replace(j, effort=1e-3) for j in hand.joints), tendons=None)
    plan = clench.plan_squeeze(solution, weak, ball, mass=0.5)
    assert not plan.feasible
    assert plan.text.startswith("No squeeze holds 0.5 kg under gravity. Torque limits bind: '")
    effort = clench.grasp_quality(solution, weak, ball, mass=0.5).effort
    assert effort.worst_torque is None
    assert "Torque limits bind" in effort.reason


def test_slack_tendons_are_named(grip) -> None:
    hand, ball, solution = grip
    weak = replace(hand, tendons=replace(hand.tendons, t_max=tuple(t + 0.05 for t in hand.tendons.t_min)))
    assert "Tendons bind: no tensions within their limits give the torques of '" in (
        clench.plan_squeeze(solution, weak, ball, mass=0.5).text
    )


def test_gravity_in_any_direction_asks_for_more(grip) -> None:
    hand, ball, solution = grip
    plan = clench.plan_squeeze(solution, hand, ball, gravity=None, margin=1.5)
    assert plan.feasible == (plan.margin >= 1.0)
    assert "in every direction of gravity" in plan.text
    assert np.abs(plan.forces.sum(axis=0)).max() < 1e-9


@pytest.mark.parametrize("margin", [0.5, 1.0, 2.0])
def test_what_is_held_whichever_way_is_held_with_any_margin_asked_for(grip, margin: float) -> None:
    hand, ball, solution = grip
    plan = clench.plan_squeeze(solution, hand, ball, mass=0.05, gravity=None, margin=margin)
    assert plan.feasible
    assert plan.margin == max(margin, 1.0)
    assert "Holds 0.05 kg in every direction" in plan.text


def test_one_contact_holds_nothing_in_every_direction(grip) -> None:
    """No force of one contact balances a weight that points elsewhere; that must not drop out of the question."""
    hand, ball, solution = grip
    alone = replace(solution, contacts=tuple(c for c in solution.contacts if c.finger == "thumb"))
    plan = clench.plan_squeeze(alone, hand, ball, mass=0.1, gravity=None)
    assert not plan.feasible
    assert plan.text == (
        "No squeeze holds 0.1 kg in every direction of gravity: 12 of the disturbances cannot be resisted by any "
        "forces of these contacts."
    )
    # Two point contacts leave the turning about their line: every weight that turns the ball about it.
    two = [*alone.contacts[:1], next(c for c in solution.contacts if c.finger == "middle")]
    off = solution.object_pose.position + np.array([0.01, 0.005, 0.0])
    pinch = replace(solution, contacts=tuple(two))
    assert not clench.plan_squeeze(pinch, hand, ball, mass=0.01, gravity=None, center_of_mass=off).feasible


@pytest.mark.parametrize(
    ("margin", "said"), [(0.5, "only 0.5 times that mass."), (2.75e-19, "not even 0.001 times that mass.")]
)
def test_a_margin_that_is_a_rounded_zero_is_not_told_as_a_number(margin: float, said: str) -> None:
    found = SimpleNamespace(plan=np.zeros(3), margin=margin, unresisted=())
    assert squeezing._sentence(found, (0.1, 0.1), False, True).endswith(said)


def test_torque_limited_epsilon_is_a_force(grip) -> None:
    hand, ball, solution = grip
    quality = clench.grasp_quality(solution, hand, ball, within_torques=True)
    assert quality.within_torques.radius > 0.5
    assert quality.to_dict()["epsilon_within_torques"] == quality.within_torques.radius


def test_no_contacts_are_an_answer_not_an_error(grip) -> None:
    hand, ball, solution = grip
    nothing = replace(solution, contacts=())
    quality = clench.grasp_quality(nothing, hand, ball)
    assert (quality.epsilon.radius, quality.volume, quality.force_closure) == (0.0, 0.0, False)
    assert quality.effort.reason == "Nothing touches the object."
    plan = clench.plan_squeeze(nothing, hand, ball)
    assert plan.text == "No squeeze holds 0.1 kg under gravity. Nothing touches the object."
    assert json.loads(json.dumps(plan.to_dict()))["forces"] == []


def test_nothing_to_hold_takes_no_torque(grip) -> None:
    effort = clench.grasp_quality(grip[2], grip[0], grip[1], mass=0.0).effort
    assert effort.worst_torque == pytest.approx(0.0, abs=1e-9)
    assert effort.worst_tension == pytest.approx(5.0, abs=1e-6)  # taut


def test_passed_contacts_and_obstacles_do_not_hold(grip) -> None:
    hand, ball, solution = grip
    solution = replace(solution, contacts=clench.grasp_quality(solution, hand, ball).grasp.contacts)
    first, *rest = solution.contacts
    passed = replace(solution, contacts=(replace(first, passed=True), *rest))
    assert len(clench.grasp_quality(passed, hand, ball).grasp.contacts) == len(solution.contacts) - 1
    table = replace(ball.bodies[0], name="table", role=clench.BodyRole.OBSTACLE)
    other = replace(solution, contacts=(replace(first, body="table"), *rest))
    assert len(clench.grasp_quality(other, hand, ball.with_body(table)).grasp.contacts) == len(solution.contacts) - 1


def test_a_touch_that_stops_two_joints_counts_once(grip) -> None:
    hand, ball, solution = grip
    first = solution.contacts[0]
    twice = replace(solution, contacts=(*solution.contacts, replace(first, stops_joint="another")))
    one, other = (clench.grasp_quality(s, hand, ball, norm="Linf") for s in (solution, twice))
    assert other.epsilon.radius == one.epsilon.radius
    assert len(other.grasp.contacts) == len(one.grasp.contacts)
    places = [(c.link, *c.position.round(9)) for c in one.grasp.contacts]
    assert len(set(places)) == len(places)


def test_bad_input_gets_one_sentence(grip) -> None:
    hand, ball, solution = grip
    for friction in (0.0, -1.0, np.nan):
        with pytest.raises(CommandError, match=r"friction: expected a finite number above 0, got"):
            clench.grasp_quality(solution, hand, ball, friction=friction)
    for mass in (-0.1, np.nan):
        for function in (clench.grasp_quality, clench.plan_squeeze):
            with pytest.raises(CommandError, match=r"mass: expected a finite number of at least 0 kg"):
                function(solution, hand, ball, mass=mass)
    with pytest.raises(CommandError, match=r"loads: the set is empty"):
        clench.plan_squeeze(solution, hand, ball, disturbances=[])
    with pytest.raises(CommandError, match=r"norm: expected one of L1, Linf"):
        clench.grasp_quality(solution, hand, ball, norm="L3")
    with pytest.raises(CommandError, match=r"contact_model: expected one of point, soft, got 'glue'"):
        clench.plan_squeeze(solution, hand, ball, contact_model="glue")
    with pytest.raises(CommandError, match=r"center_of_mass: expected finite numbers .* got \[0.0, 0.0, nan\]"):
        clench.grasp_quality(solution, hand, ball, center_of_mass=[0.0, 0.0, np.nan])
    for values, message in (
        ({"friction": "slippery"}, r"friction: expected a finite number above 0, got 'slippery'"),
        ({"friction": [0.5] * 99}, r"friction: expected one number, or one for each of \d+ contacts"),
        ({"mass": "light"}, r"mass: expected a finite number of at least 0 kg, got 'light'"),
        ({"edges": 2.5}, r"edges: expected a whole number of at least 3 edges of the friction cone, got 2.5"),
        ({"edges": "8"}, r"edges: expected a whole number of at least 3"),
        ({"center_of_mass": [0.0, 0.0]}, r"center_of_mass: expected 3 numbers \[x, y, z\] in metres"),
    ):
        with pytest.raises(CommandError, match=message):
            clench.grasp_quality(solution, hand, ball, **values)
    for values, message in (
        ({"gravity": [0.0, -1.0]}, r"gravity: expected 3 numbers \[x, y, z\], got \[0.0, -1.0\]"),
        ({"gravity": "down"}, r"gravity: expected \[x, y, z\], got 'down'"),
        ({"gravity": [np.nan, 0.0, 0.0]}, r"gravity: expected finite numbers \[x, y, z\]"),
        ({"disturbances": [[1.0] * 6, [1.0]]}, r"loads: expected rows of six numbers"),
    ):
        with pytest.raises(CommandError, match=message):
            clench.plan_squeeze(solution, hand, ball, **values)
    with pytest.raises(CommandError, match=r"the solution does not fit hand 'patent15'"):
        clench.grasp_quality(solution, clench.Hand.load("patent15"), ball)


def test_what_takes_long_is_computed_when_it_is_read(monkeypatch, grip) -> None:
    hand, ball, solution = grip
    expected = clench.grasp_quality(solution, hand, ball).to_dict()
    calls: list[str] = []
    for name in ("actuation", "volume_l1"):
        exact = getattr(quality, name)
        monkeypatch.setattr(
            quality, name, lambda *given, name=name, exact=exact: [calls.append(name), exact(*given)][1]
        )
    found = clench.grasp_quality(solution, hand, ball)
    assert found.force_closure
    assert calls == []
    assert found.to_dict() == expected
    assert found.to_dict() == pickle.loads(pickle.dumps(found)).to_dict() == expected
    assert sorted(calls) == ["actuation", "volume_l1"]


def test_why_nothing_holds_is_looked_for_when_it_is_read(monkeypatch, grip) -> None:
    hand, ball, solution = grip
    weak = replace(hand, joints=tuple(replace(j, effort=1e-3) for j in hand.joints), tendons=None)
    asked: list[object] = []

    def why_not(held: object, load: object) -> str:
        asked.append(load)
        return "Too weak."

    monkeypatch.setattr("clench.mechanics.forces.squeeze.why_not", why_not)
    monkeypatch.setattr("clench.mechanics.forces.binding.why_not", why_not)
    plan, effort = clench.plan_squeeze(solution, weak, ball), clench.grasp_quality(solution, weak, ball).effort
    assert not plan.feasible
    assert effort.worst_torque is None
    assert asked == []
    assert plan.text.endswith("Too weak.")
    assert effort.reason == "Too weak."
    assert (plan.found.reason, len(asked)) == ("Too weak.", 2)
