"""Planned grasps are what they are said to be, judged without the planner."""

import itertools
from collections import Counter

import numpy as np
import pytest

import clench
from clench.core.exceptions import CommandError, ObjectError, UnknownNameError
from clench.execution.simulation.hold import Hold
from clench.execution.simulation.pulling import hold_and_pull
from clench.models.objects.obstacles import table
from clench.planner.options import PlanOptions
from clench.planner.rejections import Rejection
from clench.planner.search import GraspSearch


def test_every_grasp_is_certified_closes_by_force_and_is_the_answer_to_its_command(plan, hand, mug):
    assert len(plan) == 4
    for grasp in plan:
        assert grasp.solution.is_valid()
        assert grasp.solution.certified
        assert grasp.epsilon > 0.0
        assert grasp.squeeze.feasible
        again = clench.solve(hand, mug, grasp.command)
        assert again.joint_angles == grasp.joint_angles
        quality = clench.grasp_quality(again, hand, mug)
        assert quality.epsilon.radius == pytest.approx(grasp.epsilon, rel=1e-9)


def test_grasps_are_sorted_and_no_two_are_alike(plan, hand):
    scores = [grasp.score for grasp in plan]
    assert scores == sorted(scores, reverse=True)
    solid = list(hand.solid_links)
    places = []
    for grasp in plan:
        q = np.array([grasp.joint_angles[name] for name in hand.joint_names])
        places.append((grasp.hand_pose.matrix @ hand.link_poses(q)[solid])[:, :3, 3])
    apart = [np.sqrt(((a - b) ** 2).sum(axis=1).mean()) for a, b in itertools.combinations(places, 2)]
    assert min(apart) >= plan.asked.apart


def test_paths_go_from_the_open_hand_through_the_pregrasp_to_the_touch(plan, hand):
    for grasp in plan:
        positions = grasp.trajectory.positions
        assert dict(zip(hand.joint_names, positions[-1], strict=True)) == pytest.approx(grasp.joint_angles, abs=1e-9)
        assert set(grasp.solution.pregrasp) == set(hand.joint_names)


def test_every_proposal_is_a_grasp_or_fell_for_one_reason(hand, mug):
    search = clench.iter_grasps(hand, mug, 3, effort=32, most=96, path=False)
    found = list(search)
    assert len(found) == 3
    assert search.proposed == 96
    plan = search.plan()
    assert sum(plan.rejected.values()) + plan.waiting + len(found) == plan.proposed
    assert search.closed >= search.force_closed >= len(found)


def test_the_best_grasps_hold_in_simulation(plan, hand, mug):
    from clench.execution.simulation.convex_pieces import in_pieces

    pieces = in_pieces(mug, show_progress=False)
    best = clench.plan_grasps(hand, pieces, 2, effort=32, most=64)
    reports = [hold_and_pull(g.solution, hand, pieces, Hold(), g.trajectory) for g in best]
    assert [report.held for report in reports] == [True, True]


def test_the_same_seed_gives_the_same_grasps_for_any_number_of_threads(plan, hand, mug):
    for threads in (1, 3):
        again = clench.plan_grasps(hand, mug, 4, effort=16, most=128, threads=threads)
        assert [g.joint_angles for g in again] == [g.joint_angles for g in plan]
        assert [g.hand_pose for g in again] == [g.hand_pose for g in plan]
        assert [g.score for g in again] == [g.score for g in plan]
        assert again.rejected == plan.rejected
    other = clench.plan_grasps(hand, mug, 4, effort=16, most=128, seed=1)
    assert [g.hand_pose for g in other] != [g.hand_pose for g in plan]


def test_grasps_move_with_the_object(plan, hand, mug):
    pose = clench.Pose([0.3, -0.2, 0.5], wxyz=[0.5, 0.5, -0.5, 0.5])
    moved = clench.plan_grasps(hand, mug.posed(pose), 1, effort=16, most=64, path=False)
    still = clench.plan_grasps(hand, mug, 1, effort=16, most=64, path=False)
    relative = (pose.inverse() @ moved[0].hand_pose).matrix
    np.testing.assert_allclose(relative, (mug.pose.inverse() @ still[0].hand_pose).matrix, atol=1e-9)


def test_a_table_is_never_touched_or_crossed(hand):
    box = clench.GraspObject.load("box:x=0.05,y=0.05,z=0.12").with_body(table(-0.06))
    plan = clench.plan_grasps(hand, box, 3, effort=32, most=256)
    assert plan.rejected["obstacle"] > 0
    assert len(plan) == 3
    for grasp in plan:
        assert {contact.body for contact in grasp.solution.contacts} == {box.bodies[0].name}
        assert grasp.hand_pose.position[2] > -0.06


def test_the_palm_comes_from_where_it_is_asked_to(hand, mug):
    plan = clench.plan_grasps(hand, mug, 2, approach=[0, 0, -2.0], approach_angle=0.5, effort=32, most=256, path=False)
    assert plan.rejected["other direction"] > 0
    assert len(plan)
    for grasp in plan:
        assert -(grasp.hand_pose.rotation @ hand.palm_normal)[2] >= np.cos(0.5) - 1e-9


def test_only_reachable_poses_are_returned(hand, mug):
    asked = []

    def reachable(poses):
        asked.append(poses.shape)
        return poses[:, 0, 3] > 0.02

    plan = clench.plan_grasps(hand, mug, 2, reachable=reachable, effort=32, most=128, path=False)
    assert len(plan) == 2
    assert asked
    assert all(shape[1:] == (4, 4) for shape in asked)
    assert all(grasp.hand_pose.position[0] > 0.02 for grasp in plan)
    nothing = clench.plan_grasps(hand, mug, 2, reachable=lambda poses: np.zeros(len(poses), dtype=bool), most=64)
    assert len(nothing) == 0
    assert "unreachable" in nothing.text


@pytest.mark.parametrize(
    ("reachable", "said"),
    [
        (lambda poses: 1 / 0, "ZeroDivisionError"),
        (lambda poses: [True], "truth values"),
        (lambda poses: np.ones(len(poses)), "truth values"),
    ],
)
def test_a_function_that_does_not_answer_is_told_in_one_sentence(hand, mug, reachable, said):
    with pytest.raises(CommandError, match=said):
        clench.plan_grasps(hand, mug, 1, reachable=reachable, most=64)


def test_contacts_lie_where_they_are_to_be(hand, mug):
    upper = clench.Region.box([-1.0, -1.0, 0.03], [1.0, 1.0, 1.0])
    for asked in ({"touch": upper}, {"avoid": upper}):
        plan = clench.plan_grasps(hand, mug, 1, effort=64, most=256, path=False, **asked)
        places = np.array([c.position for g in plan for c in g.solution.contacts])
        inside = upper.contains(mug.pose.inverse().apply(places))
        assert len(places)
        assert inside.all() == ("touch" in asked)
        assert inside.any() == ("touch" in asked)


@pytest.mark.parametrize(("kind", "fingers"), [("pinch", 2), ("tripod", 3)])
def test_kinds_have_their_number_of_fingers_and_tips_alone(hand, mug, kind, fingers):
    plan = clench.plan_grasps(hand, mug, 1, kinds=[kind], effort=64, most=192, path=False)
    assert len(plan) == 1
    assert plan[0].kind == kind
    touching = {(c.finger, c.link) for c in plan[0].solution.contacts if not c.passed}
    tips = {(f.name, hand.links[f.tip_link].name) for f in hand.fingers}
    assert len({finger for finger, _ in touching}) == fingers
    assert touching <= tips


def test_a_range_of_friction_and_mass_is_held_throughout(hand, mug):
    plan = clench.plan_grasps(hand, mug, 1, friction=(0.3, 0.6), mass=(0.05, 0.3), effort=64, most=192, path=False)
    grasp = plan[0]
    assert grasp.squeeze.mass == 0.3
    assert grasp.squeeze.lightest == 0.05
    assert grasp.squeeze.grasp.held.contacts.friction.max() == 0.3
    lowest = clench.grasp_quality(grasp.solution, hand, mug, friction=0.3)
    assert lowest.epsilon.radius == pytest.approx(grasp.epsilon, rel=1e-9)


def test_displacements_lower_the_score_and_change_the_order(hand, mug):
    plan = clench.plan_grasps(hand, mug, 2, pose_sigma=0.004, effort=32, most=64, path=False)
    again = clench.plan_grasps(hand, mug, 2, pose_sigma=(0.004, np.deg2rad(2.4)), effort=32, most=64, path=False)
    assert len(plan) == 2
    assert [g.displaced for g in plan] == pytest.approx([g.displaced for g in again])
    assert all(0.0 < grasp.displaced < grasp.score for grasp in plan)
    assert [g.displaced for g in plan] == sorted([g.displaced for g in plan], reverse=True)


def test_a_time_budget_ends_the_search_after_a_first_grasp_and_says_so(hand, mug):
    plan = clench.plan_grasps(hand, mug, 1000, effort=1, seconds=1e-6, path=False)
    assert plan.proposed == 64
    assert len(plan) == 1
    assert plan.text == "Found 1 of 1000 grasps from 64 proposals. The time was over."


def test_the_weight_counts_besides_the_wrenches_of_a_task(hand, mug):
    gentle = [[0.0, 0.0, 0.01, 0.0, 0.0, 0.0]]
    asked = {"path": False, "most": 128, "effort": 32, "task_wrenches": gentle}
    assert len(clench.plan_grasps(hand, mug, 1, mass=50.0, **asked)) == 0
    assert len(clench.plan_grasps(hand, mug, 1, mass=0.1, **asked)) == 1


def test_every_wrench_of_a_task_is_resisted_or_there_is_no_grasp(hand, mug):
    asked = {"path": False, "most": 128, "effort": 32, "gravity": [0, 0, -1]}
    assert len(clench.plan_grasps(hand, mug, 1, task_wrenches=[[0, 0, 1000.0, 0, 0, 0]], **asked)) == 0
    (grasp,) = clench.plan_grasps(hand, mug, 1, task_wrenches=[[0, 0, 0.5, 0, 0, 0]], **asked)
    assert grasp.squeeze.margin >= 1.0


def test_lists_and_arrays_are_ranges_and_names(hand, mug):
    asked = {"path": False, "most": 64, "effort": 32}
    one = clench.plan_grasps(hand, mug, 1, friction=(0.3, 0.6), pose_sigma=(0.003, 0.02), kinds=["power"], **asked)
    other = clench.plan_grasps(
        hand, mug, 1, friction=[0.3, 0.6], pose_sigma=np.array([0.003, 0.02]), kinds=(k for k in ["power"]), **asked
    )
    assert [g.hand_pose for g in one] == [g.hand_pose for g in other]
    assert len(one) == 1


def test_grasps_come_one_by_one_before_all_are_found(hand, mug):
    search = clench.iter_grasps(hand, mug, 6, effort=16, path=False)
    first = next(iter(search))
    assert search.proposed < 6 * 16
    assert first.solution.is_valid()


def test_a_search_that_was_left_goes_on_where_it_was(hand, mug):
    asked = {"effort": 16, "most": 128, "path": False}
    whole = list(clench.iter_grasps(hand, mug, 6, **asked))
    search = clench.iter_grasps(hand, mug, 6, **asked)
    parts = [next(iter(search)) for _ in range(2)] + list(search)
    assert [g.number for g in parts] == [g.number for g in whole]
    assert list(search) == []


def test_a_search_ends_when_nothing_can_be_squeezed(hand, mug, monkeypatch):
    from clench.planner import search as searching

    monkeypatch.setattr(searching, "FRUITLESS", 5)
    plan = clench.plan_grasps(hand, mug, 3, mass=500.0, path=False)
    assert len(plan) == 0
    assert plan.rejected["no squeeze within limits"] == 5
    assert "lighter object" in plan.text or "stopped" in plan.text


@pytest.mark.parametrize(
    ("shape", "reason"),
    [
        ("sphere:r=0.001", "too few fingers touch"),
        ("sphere:r=0.5", "Check the object's scale"),
        ("box:x=0.6,y=0.6,z=0.6", "stopped before its place"),
    ],
)
def test_without_a_grasp_the_text_says_what_stood_in_the_way(hand, shape, reason):
    plan = clench.plan_grasps(hand, clench.GraspObject.load(shape), 2, most=128)
    assert len(plan) == 0
    assert reason in plan.text
    assert "Found 0 of 2 grasps" in plan.text


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"count": 0}, "count"),
        ({"count": 2.5}, "count"),
        ({"seed": -1}, "seed"),
        ({"friction": -0.1}, "friction"),
        ({"mass": float("nan")}, "mass"),
        ({"gravity": [0, 0, 0]}, "gravity"),
        ({"approach": [0, 0]}, "approach"),
        ({"kinds": ["fist"]}, "pinch, tripod, precision, power"),
        ({"kinds": []}, "at least one"),
        ({"kinds": ["pinch"], "min_fingers": 3}, "min_fingers is 3"),
        ({"kinds": ["tripod"], "min_fingers": 4}, "min_fingers is 4"),
        ({"touch": [0, 0, 0]}, "clench.Region"),
        ({"reachable": True}, "function"),
        ({"pose_sigma": 0.0}, "pose_sigma"),
        ({"pose_sigma": "little"}, "pose_sigma"),
        ({"pose_sigma": [0.1]}, "pose_sigma: expected one number or two"),
        ({"kinds": 3}, "kinds: expected names"),
        ({"fingers": "thumb"}, "fingers: expected names"),
        ({"apart": float("inf")}, "apart"),
        ({"approach_angle": 45.0}, "in degrees"),
        ({"seconds": -1.0}, "seconds"),
        ({"contact_model": "sticky"}, "contact_model"),
        ({"fingers": ["thumb"]}, "at least 2 fingers"),
    ],
)
def test_bad_options_get_one_sentence(hand, mug, asked, said):
    with pytest.raises(CommandError, match=said):
        clench.plan_grasps(hand, mug, **asked)


def test_a_finger_that_does_not_exist_is_refused_with_those_that_do(hand, mug):
    with pytest.raises(UnknownNameError, match="index"):
        clench.plan_grasps(hand, mug, fingers=["thumb", "indx"])


def test_what_is_no_hand_or_object_is_refused(hand, mug):
    with pytest.raises(CommandError, match=r"hand: expected a clench\.Hand"):
        clench.plan_grasps("robonaut2", mug)
    with pytest.raises(CommandError, match=r"obj: expected a clench\.GraspObject"):
        clench.iter_grasps(hand, "mug")


def test_regions_without_surface_are_refused(hand, mug):
    far = clench.Region.sphere([5.0, 0.0, 0.0], 0.1)
    with pytest.raises(ObjectError, match="regions"):
        clench.plan_grasps(hand, mug, touch=far)


def test_a_plan_is_one_json_document(plan):
    import msgspec

    document = msgspec.json.decode(msgspec.json.encode(plan.to_dict()))
    assert document["schema"] == "clench.plan/1"
    assert len(document["grasps"]) == 4
    assert len(repr(plan).splitlines()) == 1
    assert len(repr(plan[0]).splitlines()) == 1


def test_a_search_without_a_grasp_still_has_a_plan(hand, mug):
    search = GraspSearch(hand, mug, PlanOptions(count=1, most=64, min_fingers=5, kinds=["precision"], path=False))
    list(search)
    assert search.plan().proposed == 64 or len(search.plan())


def test_every_rejected_proposal_is_told_with_its_place(hand, mug):
    search = clench.iter_grasps(hand, mug, 3, path=False, seed=3)
    told = []
    search.tell_rejected(told.append)
    assert len([*search]) == 3
    later = {Rejection.ALIKE, Rejection.NO_SQUEEZE, Rejection.NO_WAY, Rejection.NOT_ROBUST}
    expected = {reason: n for reason, n in search.plan().rejected.items() if n and Rejection(reason) not in later}
    assert Counter(each.reason.value for each in told) == expected
    stopped = [each for each in told if each.reason is Rejection.STOPPED]
    assert stopped
    far = [np.linalg.norm(each.T_object_palm.position) for each in stopped]
    assert max(far) < 0.5, "the place is where the hand stopped, near the object"


def test_a_misspelt_option_is_refused_with_a_guess(hand, mug):
    with pytest.raises(CommandError, match=r"^plan_grasps: unknown option 'aproach'\. Did you mean 'approach'\?"):
        clench.plan_grasps(hand, mug, 1, aproach=[0, 0, -1])
    with pytest.raises(CommandError, match=r"^plan_grasps: unknown option 'zzz'\. See"):
        clench.iter_grasps(hand, mug, 1, zzz=1)
