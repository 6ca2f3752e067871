"""Next steps in simulation: reached or not, held or let go, as statics and free fall have it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clench.core.exceptions import CommandError, UnknownNameError
from clench.execution.executing import execute
from clench.execution.execution_report import ExecutionReport
from clench.execution.simulation.simulated_hand import SimulatedHand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.solution import GraspSolution
from execution.simulation.test_pulling import FIRM, on_a_table
from execution.simulation.test_simulated_actuators import POSITIONS, changed

SHORT = replace(FIRM, duration=0.3)
LET_GO = {"thumb": 0.0}


def stepped(
    pinch: GraspSolution, hand: Hand, ball: GraspObject, *steps: dict[str, float], **options: object
) -> ExecutionReport:
    return execute(replace(pinch, next_steps=steps), SimulatedHand(hand, ball, **options))  # type: ignore[arg-type]


def test_a_thumb_that_opens_lets_go_and_the_finger_stays(
    pincer: Hand, pinch: GraspSolution, ball: GraspObject, tmp_path: Path
) -> None:
    report = stepped(pinch, pincer, ball, LET_GO, {"index": 0.0})
    assert report.success, report.reason
    first, second = report.next_steps
    assert (first.reached, first.touching, first.held) == (True, ("index",), None)
    assert first.joints["thumb"].reached == pytest.approx(0.0, abs=1e-3)
    assert set(second.joints) == {"index", "index_tip"}
    assert second.touching == ()
    assert "Next step 2 was reached" in report.reason
    # Touch and computed angles are those of before the steps.
    assert report.joints["thumb"].reached == pytest.approx(pinch.joint_angles["thumb"], abs=1e-3)
    assert all(contact.touches for contact in report.contacts)
    history = report.history
    assert history is not None
    assert history.commanded[-1] == pytest.approx([0.0, 0.0, 0.0])
    assert (np.diff(history.times) > 0.0).all()
    report.save(tmp_path / "r.json")
    document = json.loads((tmp_path / "r.json").read_text())["next_steps"]
    assert document[0]["joints"]["thumb"]["error"] == first.joints["thumb"].error
    assert document[1] == second.to_dict()


def test_a_step_that_moves_nothing_says_so(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    """Followers go with their leaders, so an angle that a step gives to one is no angle that anything reached."""
    report = stepped(pinch, pincer, ball, {"index_tip": 0.1}, {})
    assert report.success
    for number, step in enumerate(report.next_steps, start=1):
        assert (step.reached, dict(step.joints), step.touching) == (True, {}, ("thumb", "index"))
        assert step.reason == f"Next step {number} moves nothing: it names no joint, or followers only."


def test_a_step_into_the_object_is_not_reached_and_ends_it(
    pincer: Hand, pinch: GraspSolution, ball: GraspObject
) -> None:
    weak = replace(pincer, joints=tuple(replace(joint, effort=0.5) for joint in pincer.joints))
    report = stepped(pinch, weak, ball, {"thumb": 1.2}, LET_GO)
    assert not report.success
    (step,) = report.next_steps
    assert not step.reached
    assert step.joints["thumb"].reached == pytest.approx(pinch.joint_angles["thumb"], abs=0.05)
    assert "Next step 1 was not reached: joint 'thumb' is" in report.reason
    assert report.notes[-1].startswith("The last 1 of 2 next steps were not carried out")


def test_a_pinch_that_opens_no_longer_holds(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    report = stepped(pinch, pincer, ball, {}, LET_GO, hold=SHORT)
    assert report.success, report.reason
    still, gone = report.next_steps
    assert (still.reached, still.held, still.touching) == (True, True, ("thumb", "index"))
    assert set(still.pulls) == {"+x", "-x", "+y", "-y", "+z", "-z"}
    assert still.motion is not None
    assert still.motion.distance < 1e-4
    assert (gone.reached, gone.held) == (True, False)
    assert "The object is no longer held" in gone.reason
    assert report.hold is not None
    assert report.hold.held


def test_lifted_and_let_go_it_falls(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    solution, placed = on_a_table(pinch, ball, np.deg2rad(15.0))
    lift = replace(FIRM, test="lift", duration=0.5)
    report = stepped(solution, pincer, placed, {}, LET_GO, {"index": 0.0}, hold=lift)
    assert report.success, report.reason
    held = [step.held for step in report.next_steps]
    assert held[0] is True
    assert held[-1] is False
    assert "2 s" not in report.next_steps[0].reason
    assert "0.5 s long under gravity" in report.next_steps[0].reason
    assert report.next_steps[0].pulls["gravity"].motion.distance < 1e-3


def test_what_was_dropped_goes_to_no_next_step(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    report = stepped(pinch, pincer, ball, LET_GO, hold=replace(SHORT, friction=0.001))
    assert not report.success
    assert report.next_steps == ()
    assert report.notes[-1].startswith("The next steps were not carried out")


def test_actuators_of_the_model_let_go_too(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    report = stepped(
        pinch, changed(pincer, POSITIONS), ball, {}, LET_GO, hold=SHORT, drive="model", angle_tolerance=0.1
    )
    assert report.success, report.reason
    assert [step.held for step in report.next_steps] == [True, False]
    assert report.next_steps[1].joints["thumb"].reached == pytest.approx(0.0, abs=0.01)


def test_steps_can_be_left_out_and_are_refused_before_anything_moves(
    pincer: Hand, pinch: GraspSolution, ball: GraspObject, monkeypatch: pytest.MonkeyPatch
) -> None:
    hand = SimulatedHand(pincer, ball)
    report = execute(replace(pinch, next_steps=({"toe": 1.0},)), hand, next_steps=False)
    assert report.success
    assert report.next_steps == ()
    assert not any("step" in note for note in report.notes)
    monkeypatch.setattr(SimulatedHand, "execute", lambda *_: pytest.fail("moved"))
    with pytest.raises(UnknownNameError, match="toe"):
        execute(replace(pinch, next_steps=({"toe": 1.0},)), hand)
    with pytest.raises(CommandError, match=r"next_steps\[0\]\.index: -0.1 rad is outside"):
        execute(replace(pinch, next_steps=({"index": -0.1},)), hand)
