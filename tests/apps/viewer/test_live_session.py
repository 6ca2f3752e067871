"""A session without a page: what it answers, and that it keeps going."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

import clench
from clench.apps.viewer.opening import Given, open_session
from clench.apps.viewer.session.live_session import LiveSession
from clench.apps.viewer.session.view_state import Ask, ViewState

#: A grasp of the built-in hand on the mug.
GOOD_POSE = clench.Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5])


@dataclass
class Told:
    """A listener that remembers what it was told."""

    calls: list[tuple[str, Any]] = field(default_factory=list)

    def __getattr__(self, what: str) -> Any:
        return lambda value: self.calls.append((what, value))

    def last(self, what: str) -> Any:
        return [value for name, value in self.calls if name == what][-1]

    def names(self) -> list[str]:
        return [name for name, _ in self.calls]


@pytest.fixture(scope="module")
def given() -> Given:
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    return Given(hand, mug, clench.GraspCommand(GOOD_POSE), {}, 1.0, 0.1, {"seed": 0})


@pytest.fixture
def session(given: Given) -> Iterator[LiveSession]:
    made = open_session(given)
    yield made
    made.close()


def begun(session: LiveSession) -> Told:
    told = Told()
    session.begin(told)
    assert session.wait()
    return told


def test_the_answer_is_that_of_a_solve(session: LiveSession) -> None:
    told = begun(session)
    quick, settled = told.last("answered"), told.last("rested")
    solution = clench.solve(quick.hand, quick.obj, session.state.command)
    assert quick.status == solution.status.value == "grasp"
    assert quick.joint_angles.tolist() == list(solution.joint_angles.values())
    places = [c.position for c in solution.contacts if not c.passed]
    np.testing.assert_allclose(quick.positions, places, atol=1e-9)
    exact = clench.grasp_quality(solution, quick.hand, quick.obj, friction=1.0).epsilon.radius
    assert settled.quality.epsilon.radius == pytest.approx(exact)
    assert 0.0 < quick.bound <= exact + 1e-9


def test_the_preshape_stays_while_the_object_is_moved(session: LiveSession) -> None:
    begun(session)
    before = dict(session.state.command.angles)
    assert before
    for k in range(5):
        pose = clench.Pose([0.0, 0.0, 2e-3 * k])
        session.drag(lambda state, pose=pose: state.moved(object_pose=pose), moving=True)
    assert session.wait()
    assert session.state.command.angles == before
    assert session.answer is not None
    assert session.answer.state.command.object_pose == clench.Pose([0.0, 0.0, 8e-3])


def test_other_orders_and_geometry_are_answered_too(session: LiveSession) -> None:
    told = begun(session)
    session.change(lambda state: state.with_order(clench.ClosingOrder.TOGETHER))
    assert session.wait()
    assert "failed" not in told.names()
    assert told.last("rested").solution.fingers["index"].best.order == "together"
    session.change(lambda state: state.with_source(clench.CollisionSource.RAW))
    assert session.wait()
    assert told.last("rested").solution.collision_source == "raw"


def test_friction_changes_the_margin_but_not_the_closing(session: LiveSession) -> None:
    told = begun(session)
    before = told.last("rested")
    session.change(lambda state: replace(state, friction=0.2))
    assert session.wait()
    after = told.last("rested")
    assert after.quick.joint_angles.tolist() == before.quick.joint_angles.tolist()
    assert after.quality.epsilon.radius < before.quality.epsilon.radius


def test_a_solve_that_raises_is_said_and_the_next_one_is_answered(session: LiveSession) -> None:
    told = begun(session)
    good = session.state
    session.change(lambda state: state.with_angle("no such joint", 0.1))
    assert session.wait()
    assert told.calls[-1][0] == "failed"
    assert "no such joint" in told.last("failed")
    assert "internal error" not in told.last("failed")
    session.change(lambda _: good)
    assert session.wait()
    assert told.calls[-1][0] == "rested"


def test_a_mistake_in_a_listener_does_not_end_the_session(
    session: LiveSession, capsys: pytest.CaptureFixture[str]
) -> None:
    class Broken(Told):
        def rested(self, _: Any) -> None:
            raise ZeroDivisionError("mine")

    told = Broken()
    session.begin(told)
    assert session.wait()
    assert "ZeroDivisionError: mine" in told.last("failed")
    assert "ZeroDivisionError" in capsys.readouterr().err
    session.change(lambda state: state.moved(object_pose=clench.Pose([0.0, 0.0, 0.001])))
    assert session.wait()
    assert told.last("answered").state == session.state


def test_undo_and_redo_go_back_and_forth(session: LiveSession) -> None:
    told = begun(session)
    first = session.state
    session.change(lambda state: state.moved(object_pose=clench.Pose([0.0, 0.0, 0.01])))
    assert session.wait()
    second = session.state
    assert session.undo()
    assert session.wait()
    assert session.state == first
    assert told.last("adopted") == first
    assert session.redo()
    assert session.wait()
    assert session.state == second
    assert not session.redo()


def test_a_drag_is_one_step_back_however_often_it_rests(session: LiveSession) -> None:
    begun(session)
    first = session.state
    for k in range(1, 4):
        pose = clench.Pose([0.0, 0.0, 1e-3 * k])
        session.drag(lambda state, pose=pose: state.moved(object_pose=pose), moving=k < 3)
        assert session.wait()
    assert session.undo()
    assert session.state == first


def test_where_a_slider_rests_can_be_undone(session: LiveSession) -> None:
    begun(session)
    first = session.state
    for friction in (0.9, 0.8):
        session.slide(lambda state, friction=friction: replace(state, friction=friction))
    assert session.wait()
    assert session.undo()
    assert session.state == first


def test_clench_chooses_a_preshape_when_asked(session: LiveSession) -> None:
    begun(session)
    session.change(lambda state: state.with_preshape({}), Ask.CHOOSE)
    assert session.wait()
    solution = clench.solve(*map(session_models(session).get, ("hand", "obj")), clench.GraspCommand(GOOD_POSE))
    assert session.state.command.preshape == solution.choice["preshapes"]["angles"]


def session_models(session: LiveSession) -> dict[str, Any]:
    return {"hand": session.shelf.hand("robonaut2"), "obj": session.shelf.object("mug")}


def test_another_object_gets_a_planned_grasp(session: LiveSession) -> None:
    told = begun(session)
    session.change(lambda state: replace(state, object="ball"), Ask.PLAN)
    assert session.wait()
    assert told.last("rested").solution.object == "ball"
    assert told.last("rested").solution.status.value == "grasp"


def test_names_that_are_not_offered_are_refused(session: LiveSession) -> None:
    told = begun(session)
    session.change(lambda state: ViewState(state.hand, "/etc/passwd", state.command), Ask.PLAN)
    assert session.wait()
    assert "has no object '/etc/passwd'" in told.last("failed") or "/etc/passwd" in told.last("failed")
    assert told.calls[-1][0] == "failed"
