"""The hold test: what must be held is held, what must be dropped is dropped, and the report says what was done."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clench.core.exceptions import CommandError
from clench.core.pose import Pose
from clench.execution.executing import execute
from clench.execution.execution_report import ExecutionReport
from clench.execution.simulation.hold import Hold
from clench.execution.simulation.mujoco_scene import build_scene, lowest
from clench.execution.simulation.pulling import hold_and_pull, joint_torques
from clench.execution.simulation.simulated_hand import SimulatedHand
from clench.execution.trajectory import plan_trajectory
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import Body, BodyRole, GraspObject
from clench.models.shapes import Shape, ShapeKind
from clench.solver.analysis.squeezing import plan_squeeze
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import GraspSolution

#: Two fingers hold a ball in every direction only if they also resist turning about the line between them.
FIRM = Hold(friction=1.0, contact_model="soft")


def carried_out(solution: GraspSolution, hand: Hand, obj: GraspObject, hold: Hold) -> ExecutionReport:
    return execute(solution, SimulatedHand(hand, obj, hold=hold))


def test_a_firm_pinch_is_held(pincer: Hand, pinch: GraspSolution, ball: GraspObject, tmp_path: Path) -> None:
    report = carried_out(pinch, pincer, ball, FIRM)
    held = report.hold
    assert held is not None
    assert (report.success, held.held, held.planned) == (True, True, True), report.reason
    assert "Held against 1 N in six directions" in report.reason
    assert set(held.pulls) == {"+x", "-x", "+y", "-y", "+z", "-z"}
    for pulled in held.pulls.values():
        assert pulled.time == pytest.approx(2.0)
        assert pulled.motion.distance < 2e-3
        assert pulled.motion.angle < np.deg2rad(5.0)
    assert held.squeezed.distance < 5e-4
    report.save(tmp_path / "report.json")
    document = json.loads((tmp_path / "report.json").read_text())["hold"]
    assert document["settings"]["friction"] == 1.0
    assert document["pulls"]["-z"]["motion"]["distance"] == held.pulls["-z"].motion.distance


def test_servos_exert_the_planned_torques(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    held = carried_out(pinch, pincer, ball, FIRM).hold
    assert held is not None
    plan = plan_squeeze(
        pinch, pincer, ball, mass=FIRM.mass, gravity=None, contact_model="soft", friction=1.0, torsion=FIRM.torsion
    )
    q = posture(pinch.joint_angles, pincer, "joint_angles")
    torques = joint_torques(plan, pincer, q)
    np.testing.assert_array_equal(torques, list(held.torques.values()))
    # The coupling adds up the torques of its joints: this is how the plan itself counts them.
    assert torques[0] == pytest.approx(plan.torques["thumb"])
    assert torques[1] + torques[2] == pytest.approx(plan.torques["index"])
    assert torques.min() > 0.01
    gains = build_scene(pincer, ball, pinch.hand_pose, q).model.actuator_gainprm[:, 0]
    exerted = gains * (q + torques / gains - list(held.angles.values()))
    # The contacts yield a little and the servos with them: 5 % is lost here.
    np.testing.assert_allclose(exerted, torques, rtol=0.1)


def test_without_a_squeeze_the_object_falls_freely(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    report = carried_out(pinch, pincer, ball, replace(FIRM, squeeze=0.0))
    held = report.hold
    assert held is not None
    assert not report.success
    assert not held.held
    assert "Dropped when pulled with 1 N along" in held.reason
    assert set(held.torques.values()) == {0.0}
    # Fingers stand in the way of some directions; the freest goes by a t²/2, t in whole looks, steps of 2 ms.
    free = max(held.pulls.values(), key=lambda pulled: pulled.motion.distance / pulled.time**2)
    expected = 10.0 * free.time * (free.time + 0.002) / 2.0
    assert free.motion.distance == pytest.approx(expected, rel=1e-3)


def test_the_free_object_hardly_moves_while_the_hand_closes(
    pincer: Hand, pinch: GraspSolution, ball: GraspObject
) -> None:
    """From the pregrasp all fingers arrive at once, so nothing pushes the object aside."""
    held = carried_out(pinch, pincer, ball, replace(FIRM, duration=0.1)).hold
    assert held is not None
    assert held.closed.distance < 5e-5
    assert held.touch_spread is not None
    assert held.touch_spread <= 0.005
    assert set(held.first_touch) == {"thumb", "index"}
    for force in held.forces.values():
        assert force.measured == pytest.approx(force.planned, rel=0.15)
    assert held.held_within(0.005, np.deg2rad(5.0))
    assert not held.held_within(1e-9, np.deg2rad(5.0))


def test_motions_count_from_before_the_hand_closed(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    """A trajectory that closes one finger only pushes the ball away, and that alone is a drop."""
    way = plan_trajectory(pinch, pincer, obj=ball)
    positions = way.positions.copy()
    positions[:, 1:] = 0.0
    positions[:, 0] *= 2.5
    held = hold_and_pull(pinch, pincer, ball, replace(FIRM, squeeze=0.0), replace(way, positions=positions))
    assert held.closed.distance > 0.01
    assert held.pulls["+x"].farthest.distance >= held.closed.distance
    assert not held.held


def on_a_table(pinch: GraspSolution, ball: GraspObject, tilt: float) -> tuple[GraspSolution, GraspObject]:
    """Return the pinch with the palm beside the ball and its fingers pointing down by an angle [rad]."""
    sine, cosine = np.sin(tilt), np.cos(tilt)
    T = np.eye(4)
    T[:3, :3] = np.array([[0.0, sine, cosine], [1.0, 0.0, 0.0], [0.0, cosine, -sine]])
    T[2, 3] = 0.2
    palm = Pose.from_matrix(T)
    old, place = pinch.hand_pose, palm @ pinch.hand_pose.inverse() @ ball.pose
    contacts = tuple(
        replace(
            c,
            position=palm.apply(old.inverse().apply(c.position)),
            normal=palm.rotation @ old.rotation.T @ c.normal,
        )
        for c in pinch.contacts
    )
    return replace(pinch, hand_pose=palm, object_pose=place, contacts=contacts), ball.posed(place)


def test_lifted_from_a_table(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    solution, placed = on_a_table(pinch, ball, np.deg2rad(15.0))
    way = plan_trajectory(solution, pincer, obj=placed)
    lift = replace(FIRM, test="lift", duration=0.5)
    held = hold_and_pull(solution, pincer, placed, lift, way)
    assert held.held, held.reason
    assert set(held.pulls) == {"lift"}
    assert held.pulls["lift"].time == pytest.approx(0.9)
    assert held.pulls["lift"].farthest.distance < 3e-3
    assert "Held when lifted by 0.1 m" in held.reason
    left = hold_and_pull(solution, pincer, placed, replace(lift, squeeze=0.0), way)
    assert not left.held
    assert left.reason == "Dropped when lifted by 0.1 m."
    # It is left behind, or rolls between the fingers, as far as the limits.
    assert not left.pulls["lift"].motion.within(0.05, np.deg2rad(15.0))
    assert left.pulls["lift"].motion.distance > 0.02


def test_a_hand_that_would_be_in_the_table_is_not_tested(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    """Straight down, the fingers reach 8.8 cm from the palm and the ball's lowest point is 7 cm from it."""
    solution, placed = on_a_table(pinch, ball, np.deg2rad(90.0))
    way = plan_trajectory(solution, pincer, obj=placed)
    held = hold_and_pull(solution, pincer, placed, replace(FIRM, test="lift"), way)
    assert not held.held
    assert held.pulls == held.forces == held.angles == {}
    assert held.closed is held.squeezed is None
    found = re.fullmatch(r"Not tested: the hand would be (.*) mm deep in the table\.", held.reason)
    assert found is not None, held.reason
    q = posture(pinch.joint_angles, pincer, "joint_angles")
    thumb = pincer.link_poses(q)[1]
    lowest_point = (thumb @ np.array([0.0, 0.0, 0.08, 1.0]))[2] + 0.008
    assert float(found[1]) >= (lowest_point - 0.07) * 1e3 - 0.1


def test_the_table_is_under_the_lowest_point(ball: GraspObject) -> None:
    assert lowest(ball) == pytest.approx(ball.pose.position[2] - 0.02, abs=2e-5)


def test_a_slippery_ball_is_dropped(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    report = carried_out(pinch, pincer, ball, replace(FIRM, friction=0.001))
    assert report.hold is not None
    assert not report.success
    assert not report.hold.planned
    assert report.notes[-1].startswith("The planned squeeze does not hold the mass. No squeeze holds 0.1 kg")


def test_heavier_than_the_hand_can_hold(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    """Servos of 10 mNm at 8 cm exert an eighth of a newton: no 1 kg, whatever the friction."""
    weak = replace(pincer, joints=tuple(replace(joint, effort=0.01) for joint in pincer.joints))
    report = carried_out(pinch, weak, ball, replace(FIRM, mass=1.0))
    assert report.hold is not None
    assert not report.hold.held
    assert not report.hold.planned


def test_the_same_every_time(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    short = replace(FIRM, duration=0.1)
    first, second = (carried_out(pinch, pincer, ball, short).to_dict() for _ in range(2))
    assert first == second


def test_an_obstacle_under_the_object_does_not_carry_it(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    shell = Body("tray", (Shape(ShapeKind.BOX, (0.05, 0.05, 0.002), Pose([0, 0, 0.0225])),), BodyRole.OBSTACLE)
    hold = replace(FIRM, squeeze=0.0, duration=0.3)
    way = plan_trajectory(pinch, pincer)
    alone, beside = (hold_and_pull(pinch, pincer, obj, hold, way) for obj in (ball, ball.with_body(shell)))
    assert alone.to_dict() == beside.to_dict()


def test_a_touch_that_is_not_reached_is_not_tested(pincer: Hand, pinch: GraspSolution) -> None:
    dot = GraspObject("ball", (Body("ball", (Shape(ShapeKind.SPHERE, (0.001, 0, 0)),)),))
    report = SimulatedHand(pincer, dot, hold=FIRM).execute(pinch, plan_trajectory(pinch, pincer))
    assert not report.success
    assert report.hold is None
    assert report.notes[-1] == "Holding was not tested: the touch was not reached."


def test_a_free_object_weighs_what_was_asked(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    model = build_scene(pincer, ball, pinch.hand_pose, np.zeros(3), free=Hold(mass=0.25, friction=0.3)).model
    body = model.body("object").id
    assert model.body_mass[body] == pytest.approx(0.25)
    np.testing.assert_allclose(model.body_inertia[body], 0.4 * 0.25 * 0.02**2)
    np.testing.assert_allclose(model.geom_friction[model.geom_bodyid == body][0, :2], [0.3, 0.02])
    assert not model.dof_armature[model.dof_bodyid == body].any()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"mass": -0.1}, r"hold: mass: expected a finite number of at least 0.001 kg, got -0.1"),
        ({"mass": float("nan")}, r"hold: mass: expected a finite .* got nan"),
        ({"mass": 0.0}, r"hold: mass: .* got 0.0"),
        ({"friction": -1.0}, r"hold: friction: expected a finite number above 0, got -1.0; nothing holds"),
        ({"friction": 0.0}, r"hold: friction: .* got 0"),
        ({"friction": float("nan")}, r"hold: friction: .* got nan"),
        ({"torsion": -0.1}, r"hold: torsion: expected a finite number of at least 0, got -0.1"),
        ({"squeeze": float("inf")}, r"hold: squeeze: .* got inf"),
        ({"pull": 0.0}, r"hold: pull: expected a finite number above 0, got 0.0"),
        ({"duration": float("inf")}, r"hold: duration: .* got inf"),
        ({"max_angle": -1.0}, r"hold: max_angle: .* got -1.0"),
        ({"test": "shake"}, r"hold: test: expected one of pulls, lift, got 'shake'"),
        ({"height": 0.0}, r"hold: height: expected a finite number above 0, got 0.0"),
        ({"contact_model": "firm"}, r"hold: contact_model: expected one of point, soft, got 'firm'"),
    ],
)
def test_settings_that_make_no_sense(given: dict[str, Any], message: str) -> None:
    with pytest.raises(CommandError, match=message):
        Hold(**given)


@pytest.mark.parametrize("key", ["mass", "friction", "torsion", "squeeze", "pull", "duration", "max_angle", "height"])
@pytest.mark.parametrize("value", ["x", None, True, [1.0, 2.0]], ids=str)
def test_settings_that_are_no_numbers_are_refused_in_one_sentence(key, value):
    with pytest.raises(
        CommandError, match=rf"^hold: {key}: expected a finite number .*, got {re.escape(repr(value))}[.;]"
    ):
        Hold(**{key: value})
