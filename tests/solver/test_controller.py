"""The controller: what the solution holds of the three inputs and of every alternative set."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, along_x, mount, one_link, three_links, turned
from clench.core.exceptions import CommandError, HandError, UnknownNameError
from clench.core.pose import Pose

BALL = clench.GraspObject.load("sphere:r=0.02", pose=Pose([0.045, 0.004, 0.035]))


def command(**changes):
    return clench.GraspCommand(**{"hand_pose": Pose.identity(), "preshape": "open", **changes})


def yawed_hand(**options):
    """Return a finger with a yaw before its two closing joints."""
    roles = [clench.JointRole.POSTURE, clench.JointRole.CLOSING, clench.JointRole.CLOSING]
    links = [None, along_x(0.007, 0.05), along_x(0.007, 0.04)]
    axes = [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [0.0, -1.0, 0.0]]
    builder = HandBuilder().finger("index", links, [0.0, 0.05, 0.04], axes=axes, roles=roles, lower=-1.0, upper=2.0)
    return builder.hand(**options)


def test_one_candidate_per_plane_and_the_full_width():
    solution = clench.solve(three_links(), BALL, command(planes=5))
    finger = solution.fingers["index"]
    planes = [c.plane for c in finger.candidates]
    assert planes == [*range(5), None]
    offsets = [c.offset for c in finger.candidates[:-1]]
    assert offsets == sorted(offsets)
    np.testing.assert_allclose(offsets[::4], [-0.007 * (1 - 2e-4), 0.007 * (1 - 2e-4)])
    assert finger.candidates[-1].offset is None
    chosen = finger.candidates[finger.chosen]
    assert solution.contacts == chosen.contacts
    assert all(solution.joint_angles[name] == angle for name, angle in chosen.joint_angles.items())


def test_next_steps_are_in_the_solution_as_commanded():
    steps = ({"index_0": 0, "index_2": 0.1}, {})
    assert clench.solve(three_links(), BALL, command(next_steps=steps)).next_steps == steps
    assert clench.solve(three_links(), BALL, command()).next_steps == ()


def test_the_full_width_gets_no_farther_than_any_plane_in_its_first_joint():
    finger = clench.solve(three_links(), BALL, command(planes=7)).fingers["index"]
    first = [c.joint_angles["index_0"] for c in finger.candidates]
    assert first[-1] == min(first)


@pytest.mark.parametrize("planes", [1, 2, 3, 8])
def test_as_many_planes_as_asked_for(planes):
    solution = clench.solve(three_links(), BALL, command(planes=planes, full_width=False))
    assert [c.plane for c in solution.fingers["index"].candidates] == list(range(planes))


def test_every_contact_lies_on_the_ball_and_looks_out():
    solution = clench.solve(three_links(), BALL, command())
    for candidate in solution.fingers["index"].candidates:
        for contact in candidate.contacts:
            away = contact.position - BALL.pose.position
            assert np.linalg.norm(away) == pytest.approx(0.02, abs=1e-12)
            np.testing.assert_allclose(contact.normal, away / 0.02, atol=1e-9)
            assert contact.body == BALL.bodies[0].name


def test_scores_and_timing_are_in_the_result():
    solution = clench.solve(three_links(), BALL, command())
    for candidate in solution.fingers["index"].candidates:
        assert {"range_of_motion", "touching_links", "limit_distance"} <= candidate.scores.keys()
        assert candidate.scores["range_of_motion"] == pytest.approx(sum(candidate.joint_angles.values()))
        links = {c.link for c in candidate.contacts if not c.passed}
        assert candidate.scores["touching_links"] == len(links)
    assert solution.timing["total"] > 0.0


def test_the_chosen_candidate_has_the_best_weighted_score_of_those_that_may_be_chosen():
    centered = BALL.posed(Pose([0.045, 0.0, 0.035]))  # touched on the middle plane, so that some set is feasible
    for criteria in ({"range_of_motion": 1.0}, {"limit_distance": 1.0}):
        asked = command(criteria=criteria, check_candidates=True)
        finger = clench.solve(three_links(), centered, asked).fingers["index"]
        may = [c for c in finger.candidates if c.feasible]
        assert may
        (name,) = criteria
        sign = -1.0 if name == "range_of_motion" else 1.0
        best = max(sign * c.scores[name] for c in may)
        assert sign * finger.candidates[finger.chosen].scores[name] == best


def test_checked_candidates_are_feasible_as_far_as_their_penetration_says():
    finger = clench.solve(three_links(), BALL, command(check_candidates=True)).fingers["index"]
    assert all(c.feasible is not None for c in finger.candidates)
    deep = [c for c in finger.candidates if c.penetration is not None and c.penetration > 1e-6]
    assert deep
    assert not any(c.feasible for c in deep)


def test_yaw_grid_and_open_values_give_alternatives():
    solution = clench.solve(yawed_hand(), BALL, command(yaw_grid=(0.0, 0.1, -0.1), open_variants=(0.0, 0.2), planes=1))
    candidates = solution.fingers["index"].candidates
    assert sorted({c.posture for c in candidates}) == list(range(6))
    yaws = {round(c.joint_angles["index_0"], 12) for c in candidates}
    assert yaws == {0.0, 0.1, -0.1}
    assert all(c.joint_angles["index_1"] >= 0.2 - 1e-12 for c in candidates if c.posture % 2)


def test_a_preshape_candidates_posture_and_open_values():
    solution = clench.solve(yawed_hand(), BALL, command(preshape={"index_0": 0.1, "index_1": 0.05}))
    assert solution.joint_angles["index_0"] == 0.1
    assert solution.open_angles["index_1"] == 0.05
    assert solution.decomposition["posture"] == {"index_0": 0.1}
    assert solution.decomposition["closing"].keys() == {"index_1", "index_2"}


def test_a_whole_posture_is_snapped_to_contact():
    hand = yawed_hand()
    rough = clench.GraspCommand.from_posture(hand, {"index_0": 0.05, "index_1": 0.3, "index_2": 0.2}, Pose.identity())
    solution = clench.solve(hand, BALL, rough)
    assert solution.joint_angles["index_0"] == 0.05
    assert solution.status == "grasp"
    assert all(abs(c.gap) <= 1e-9 for c in solution.contacts if not c.passed)


def test_object_pose_of_the_command_overrides_the_objects_own():
    there = Pose([0.05, 0.0, 0.04], wxyz=[0.0, 1.0, 0.0, 0.0])
    a = clench.solve(three_links(), BALL, command(object_pose=there))
    b = clench.solve(three_links(), BALL.posed(there), command())
    assert a.joint_angles == b.joint_angles
    assert a.object_pose == there


def test_a_root_link_that_a_finger_moves_is_refused():
    with pytest.raises(CommandError, match="index_link_1"):
        clench.solve(three_links(), BALL, command(root_link="index_link_1"))
    named = clench.solve(three_links(), BALL, command(root_link="palm"))
    assert named.joint_angles == clench.solve(three_links(), BALL, command()).joint_angles


def test_only_the_fingers_asked_for_close_in_the_order_asked():
    builder = HandBuilder().finger("index", [along_x(0.007, 0.06)], [0.06], base=mount((0, 0.02, 0)))
    builder.finger(
        "thumb", [along_x(0.007, 0.06)], [0.06], base=mount((0, -0.02, 0), turned([0, 0, 1.0], 0.2)), thumb=True
    )
    hand = builder.hand()
    solution = clench.solve(hand, BALL, command(fingers=("thumb", "index")))
    assert list(solution.fingers) == ["thumb", "index"]
    alone = clench.solve(hand, BALL, command(fingers=("index",)))
    assert list(alone.fingers) == ["index"]
    assert alone.joint_angles["thumb_0"] == 0.0
    assert alone.joint_angles["index_0"] == solution.joint_angles["index_0"]


def test_a_second_round_changes_nothing_that_is_held():
    once, twice = (clench.solve(three_links(), BALL, command(rounds=r)) for r in (1, 2))
    assert twice.joint_angles == pytest.approx(once.joint_angles, abs=1e-9)


def test_opposed_thumb_and_finger_make_a_grasp():
    builder = HandBuilder().finger(
        "index", [along_x(0.007, 0.08)], [0.08], base=mount((-0.04, 0, 0.06)), upper=1.5, axes=[[0, 1, 0]]
    )
    builder.finger("thumb", [along_x(0.007, 0.08)], [0.08], base=mount((-0.04, 0, -0.06)), upper=1.5, thumb=True)
    builder.finger("far", [along_x(0.007, 0.01)], [0.01], base=mount((-0.04, 0.2, 0.0)))
    solution = clench.solve(builder.hand(), clench.GraspObject.load("sphere:r=0.02"), command())
    assert solution.fingers["far"].status == "limit"
    assert solution.status == "grasp"
    assert solution.reason["code"] == "opposed"


def test_what_does_not_fit_is_refused():
    with pytest.raises(UnknownNameError, match="indx"):
        clench.solve(three_links(), BALL, command(preshape={"indx": 0.1}))
    with pytest.raises(UnknownNameError, match="pinky"):
        clench.solve(three_links(), BALL, command(fingers=("pinky",)))
    with pytest.raises(CommandError, match="index_0"):
        clench.solve(three_links(), BALL, command(preshape={"index_0": 99.0}))
    fixed = HandBuilder().finger("index", [along_x(0.007, 0.05)], [0.05], roles=[clench.JointRole.POSTURE]).hand()
    with pytest.raises(HandError, match="closing joint"):
        clench.solve(fixed, BALL, command())


def test_solutions_are_recorded_when_asked(tmp_path):
    with clench.Record(tmp_path / "grasps.db") as record:
        solution = clench.solve(three_links(), BALL, command(seed=5), record=record)
        assert solution.seed == 5
        assert len(record) == 1


def test_touches_of_an_object_with_more_elements_than_triangles():
    """A coin between two planes is swept as a polyhedron of many triangles; the tree has those of the box alone."""
    lying = Pose([0.045, 0.00175, 0.035], wxyz=[np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0])
    coin = clench.GraspObject.load("cylinder:r=0.02,h=0.001", pose=lying)
    box = clench.GraspObject.load("box:x=0.01,y=0.01,z=0.01").bodies[0].moved(Pose([0.0, 0.0, 0.06]))
    both = replace(coin, bodies=(*coin.bodies, replace(box, name="knob")))
    solution = clench.solve(three_links(), both, command())
    touching = [c for c in solution.contacts if c.plane is None]
    assert touching
    for contact in touching:
        away = contact.position - lying.position
        assert np.hypot(away[0], away[2]) == pytest.approx(0.02, abs=1e-5)
        assert abs(away[1]) <= 0.0005 + 1e-9


def test_the_pose_sensitivity_of_a_candidate_is_that_of_the_solution():
    solution = clench.solve(three_links(), BALL, command(criteria={"pose_sensitivity": 1.0}))
    index = solution.fingers["index"]
    linear = clench.sensitivity(solution, three_links(), BALL)
    expected = np.linalg.norm(linear.translation, axis=1).max()
    assert np.isfinite(expected)
    assert index.candidates[index.chosen].scores["pose_sensitivity"] == pytest.approx(expected, rel=1e-9)


def test_the_pose_sensitivity_of_one_link_on_a_ball_is_the_closed_form():
    """A link that turns onto a ball at distance D moves by 1 / sqrt(D² - (R + w)²) per shift across it."""
    hand, distance = one_link(), 0.06
    ball = clench.GraspObject.load("sphere:r=0.02", pose=Pose([distance * np.cos(1.2), 0.0, distance * np.sin(1.2)]))
    solution = clench.solve(hand, ball, command(criteria={"pose_sensitivity": 1.0}))
    (finger,) = solution.fingers.values()
    found = finger.candidates[finger.chosen].scores["pose_sensitivity"]
    assert found == pytest.approx(1.0 / np.sqrt(distance**2 - 0.028**2), rel=1e-6)


@pytest.mark.parametrize("distance", [0.0, 0.5], ids=["touching", "out of reach"])
def test_what_is_made_when_it_is_read_is_what_the_choice_was_made_of(distance):
    """Alternatives, causes and reasons are made late; copies and documents hold them, read before or not."""
    ball = BALL.posed(Pose(BALL.pose.position + distance))
    solution, again = (clench.solve(three_links(), ball, command(planes=3)) for _ in range(2))
    finger = again.fingers["index"]
    assert again.violations() == solution.violations() == ()
    assert again.is_valid() == (distance == 0.0)
    assert list(finger.made) == [finger.chosen]
    assert "candidates" not in vars(finger)
    copied = pickle.loads(pickle.dumps(again))
    assert {**copied.to_dict(), "timing": {}} == {**solution.to_dict(), "timing": {}}
    assert finger == solution.fingers["index"]
    assert finger.candidates is finger.candidates
    chosen = finger.candidates[finger.chosen]
    assert finger.best is chosen
    assert finger.made == dict(enumerate(finger.candidates))
    assert [id(c) for c in again.contacts] == [id(c) for c in chosen.contacts]
    assert (finger.cause is None) == (finger.status is clench.FingerStatus.TOUCH)
    with pytest.raises(AttributeError, match="no attribute 'other'"):
        finger.other  # noqa: B018
