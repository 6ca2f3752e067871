"""Fingers that meet another finger stop there, and end as if they closed anew as a whole."""

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, Y, along_x, mount
from clench.closing import kernel_run
from clench.core.pose import Pose
from clench.kernels.closing import in_turn
from clench.kernels.closing.layout import CONTACT_DOF, ClosingArrays
from clench.kernels.closing.solve_layout import FINISH
from clench.models.shapes import Shape, ShapeKind
from kernels.kernel_entries import entry

undo_from = entry(in_turn.undo_from)


def answer_at(answers, n):
    """Return the answers at a pose."""
    return ClosingArrays(*(array[n] for array in answers))


def facing():
    """Return a hand whose second finger closes onto the first one's tip with its first joint."""
    links = [along_x(0.006, 0.05), along_x(0.006, 0.04)]
    one = HandBuilder().finger("a", links, [0.05, 0.04], axes=[-Y, -Y], upper=0.8)
    return one.finger("b", links, [0.05, 0.04], base=mount((0.0, 0.0, 0.09)), axes=[Y, Y], upper=1.2).hand()


def crossing(palm=None, upper=0.35):
    """Return a hand whose second finger meets the first one's tip with its second joint."""
    links = [along_x(0.006, 0.05), along_x(0.006, 0.04)]
    one = HandBuilder(palm).finger("a", links, [0.05, 0.04], axes=[-Y, -Y], upper=0.6)
    return one.finger("b", links, [0.05, 0.04], base=mount((0.0, 0.0, 0.1)), axes=[Y, Y], upper=upper).hand()


def finished(monkeypatch, obj, whole, hand=None, poses=None):
    """Return the answers of a batch whose fingers interlock, and the hand's arrays.

    Args:
        obj: model of the object, or the object. whole: fingers close anew as a whole. hand: Robonaut 2 if None.
        poses: of the hand, 40 approach poses if None.
    """
    seen = []

    def in_two_parts(problem, T_palm_object, answers, stages):
        run(problem, T_palm_object, answers, stages & ~FINISH)
        if whole:
            answers.closed.free.skipped[:] = 1
        run(problem, T_palm_object, answers, FINISH)
        seen.append((answers.closed, problem.arrays.hand))

    run = kernel_run.run_stages
    monkeypatch.setattr(kernel_run, "run_stages", in_two_parts)
    hand, shape = clench.Hand.load("robonaut2") if hand is None else hand, obj
    if isinstance(obj, str):
        shape = clench.GraspObject.load(obj)
    poses = clench.approach_poses(hand, shape, 40, 3) if poses is None else poses
    command = clench.GraspCommand(hand_pose=poses[0], preshape="open", measure=False)
    clench.solve_batch(hand, shape, poses, command, threads=1)
    monkeypatch.setattr(kernel_run, "run_stages", run)
    ((closed, arrays),) = seen
    return closed, arrays


@pytest.mark.parametrize("obj", ["box:x=0.01,y=0.01,z=0.01", "sphere:r=0.012"])
def test_stopping_at_a_finger_ends_as_closing_anew_as_a_whole_does(obj, monkeypatch):
    part, _ = finished(monkeypatch, obj, False)
    whole, _ = finished(monkeypatch, obj, True)
    assert np.array_equal(part.anew, whole.anew)
    assert part.anew.sum() >= 10
    for n, f in zip(*np.nonzero(part.anew), strict=True):
        one, other = answer_at(part.final, n), answer_at(whole.final, n)
        count = one.contacts[f]
        assert count == other.contacts[f]
        assert np.array_equal(one.turn[f], other.turn[f])
        assert np.array_equal(one.travel[f], other.travel[f])
        assert np.array_equal(one.contact[f, :count], other.contact[f, :count])
        assert np.array_equal(one.point[f, :count], other.point[f, :count])


def test_a_finger_closes_anew_from_its_first_joint_if_that_meets(monkeypatch):
    part, hand = finished(monkeypatch, "sphere:r=0.004", False, facing())
    whole, _ = finished(monkeypatch, "sphere:r=0.004", True, facing())
    first = hand.first_dof[1]
    met = [n for n in range(len(part.anew)) if part.anew[n, 1] and part.final.contact[n, 1, 0, CONTACT_DOF] == first]
    assert len(met) >= 10
    for n in met:
        one, other = answer_at(part.final, n), answer_at(whole.final, n)
        assert np.array_equal(one.turn[1], other.turn[1])
        assert np.array_equal(one.contact[1], other.contact[1])


def test_links_that_were_left_alone_are_counted_as_in_closing_as_a_whole(monkeypatch):
    """A palm in which the last link of the second finger begins: closing starts at its first joint again."""
    palm = Shape(ShapeKind.SPHERE, (0.005, 0.0, 0.0), Pose([0.08, 0.0, 0.103]))
    far, poses = clench.GraspObject.load("sphere:r=0.004", pose=Pose([1.0, 0.0, 0.0])), [Pose.identity()]
    for hand, skipped in ((crossing(), False), (crossing(palm), True)):
        part, arrays = finished(monkeypatch, far, False, hand, poses)
        whole, _ = finished(monkeypatch, far, True, hand, poses)
        assert part.anew[0].tolist() == whole.anew[0].tolist() == [0, 1]
        assert part.final.contact[0, 1, 0, CONTACT_DOF] == arrays.first_dof[1] + 1
        assert (part.final.skipped[0, 1] > 0) == skipped
        assert part.final.skipped[0, 1] == whole.final.skipped[0, 1]
        assert part.final.travel[0, 1] == pytest.approx(whole.final.travel[0, 1], abs=1e-12)


def test_a_touch_of_an_earlier_joint_stays_where_a_later_one_meets_a_finger(monkeypatch):
    """The first joint of the second finger stops on a ball, its second joint at the first finger."""
    turn, r, size = 0.2, 0.006, 0.004
    link, under = np.array([np.cos(turn), 0.0, -np.sin(turn)]), np.array([-np.sin(turn), 0.0, -np.cos(turn)])
    ball = clench.GraspObject.load(f"sphere:r={size}", pose=Pose([0.0, 0.0, 0.1] + 0.02 * link + (r + size) * under))
    found, arrays = finished(monkeypatch, ball, False, crossing(upper=1.0), [Pose.identity()])
    first = arrays.first_dof[1]
    assert found.anew[0].tolist() == [0, 1]
    assert found.final.contact[0, 1, : found.final.contacts[0, 1], CONTACT_DOF].tolist() == [first, first + 1]
    assert found.final.travel[0, 1, first] == pytest.approx(turn, abs=1e-8)
    assert 0.4 < found.final.travel[0, 1, first + 1] < 0.9


@pytest.mark.parametrize("early", [1e-10, 1e-5])
def test_a_touch_of_the_object_is_kept_where_another_finger_is_met_just_after_it(early):
    """The second finger touches the object; by so many radians later it would meet the first one."""
    r, reach, high = 0.006, 0.09, 0.09
    builder = HandBuilder().finger("a", [along_x(r, 0.08)], [0.08], axes=[-Y], upper=0.3)
    hand = builder.finger("b", [along_x(r, reach)], [reach], base=mount((0.0, 0.0, high)), axes=[Y], upper=1.2).hand()
    far = clench.GraspObject.load("sphere:r=0.004", pose=Pose([1.0, 0.0, 0.0]))
    command = clench.GraspCommand(hand_pose=Pose.identity(), preshape="open", measure=False)
    met = clench.solve(hand, far, command).joint_angles["b_0"]
    assert 0.1 < met < 1.0
    turn, size = met - early, 0.004
    link, under = np.array([np.cos(turn), 0.0, -np.sin(turn)]), np.array([-np.sin(turn), 0.0, -np.cos(turn)])
    place = [0.0, 0.0, high] + 0.03 * link + (r + size) * under
    ball = clench.GraspObject.load(f"sphere:r={size}", pose=Pose(place))
    solution = clench.solve(hand, ball, command)
    assert solution.joint_angles["b_0"] == pytest.approx(turn, abs=1e-9)
    assert solution.fingers["b"].status == "touch"
    assert {contact.body for contact in solution.contacts if contact.finger == "b"} == {ball.bodies[0].name}


def test_only_what_came_from_a_joint_on_is_taken_back(monkeypatch):
    closed, hand = finished(monkeypatch, "sphere:r=0.03", False)
    tried = 0
    for n in range(len(closed.anew)):
        for f in range(closed.anew.shape[1]):
            answer = answer_at(closed.final, n)
            begin, end = hand.first_dof[f], hand.first_dof[f + 1]
            for dof in range(begin + 1, end):
                before = [array.copy() for array in answer]
                answer.skipped[f] = 0
                assert undo_from(hand, f, dof, answer, f) == dof
                kept = answer.contact[f, : answer.contacts[f], CONTACT_DOF]
                assert (kept < dof).all()
                assert answer.contacts[f] == (before[3][f, : before[2][f], CONTACT_DOF] < dof).sum()
                assert np.array_equal(answer.travel[f, :dof], before[0][f, :dof])
                assert not answer.travel[f, dof:end].any()
                moved = hand.chain.joint_dof < dof
                assert np.array_equal(answer.turn[f, moved], before[1][f, moved])
                for array, old in zip(answer, before, strict=True):
                    array[:] = old
                tried += 1
            answer.skipped[f] = 1
            assert undo_from(hand, f, end - 1, answer, f) == begin
            assert answer.contacts[f] == 0
            assert not answer.turn[f].any()
    assert tried >= 100
