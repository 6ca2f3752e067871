"""States of the viewer, and the way back through them."""

from __future__ import annotations

from clench import ClosingOrder, GraspCommand, Pose
from clench.apps.viewer.session.view_state import History, ViewState


def state(x: float = 0.0) -> ViewState:
    return ViewState("robonaut2", "mug", GraspCommand(Pose([x, 0.0, 0.1]), object_pose=Pose.identity()))


def test_a_move_leaves_the_old_state_as_it_was() -> None:
    old = state()
    new = old.moved(object_pose=Pose([0.0, 0.0, 0.2]))
    assert old.command.object_pose == Pose.identity()
    assert new.command.object_pose == Pose([0.0, 0.0, 0.2])
    assert new.command.hand_pose == old.command.hand_pose


def test_an_angle_is_added_to_the_preshape_and_none_is_lost() -> None:
    both = state().with_angle("a", 0.1).with_angle("b", 0.2)
    assert both.command.preshape == {"a": 0.1, "b": 0.2}


def test_one_order_takes_the_place_of_alternatives() -> None:
    several = state().with_order(ClosingOrder.TOGETHER)
    assert several.command.order is ClosingOrder.TOGETHER
    assert several.command.orders == ()


def test_weights_of_zero_are_the_default_ones() -> None:
    assert state().with_weights({"range_of_motion": 0.0}).command.criteria is None
    assert state().with_weights({"range_of_motion": 2.0, "epsilon": 0.0}).command.criteria == {"range_of_motion": 2.0}


def test_undo_and_redo_go_through_the_states() -> None:
    history = History()
    for x in (0.0, 1.0, 2.0):
        history.keep(state(x))
    assert history.undo() == state(1.0)
    assert history.undo() == state(0.0)
    assert history.undo() is None
    assert history.redo() == state(1.0)
    history.keep(state(5.0))
    assert history.redo() is None
    assert history.undo() == state(1.0)


def test_the_same_state_twice_is_one_step() -> None:
    history = History()
    for x in (0.0, 1.0, 1.0):
        history.keep(state(x))
    assert history.undo() == state(0.0)


def test_undoing_keeps_what_can_be_redone_when_the_state_is_kept_again() -> None:
    """The session keeps every state that it settles on, also one that it went back to."""
    history = History()
    for x in (0.0, 1.0):
        history.keep(state(x))
    history.keep(history.undo() or state(9.0))
    assert history.redo() == state(1.0)
