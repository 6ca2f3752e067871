"""Criteria of the whole hand agree with the mechanics they are made of, and with forces worked out by hand."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

import clench
from chain_hands import HandBuilder, along_x, mount
from clench.closing.candidates import combined_posture
from clench.core.defaults import FRICTION
from clench.core.pose import Pose
from clench.mechanics.epsilon.epsilon_quality import epsilon, epsilon_bound
from clench.mechanics.grasp.contacts import make_contacts, pair_friction
from clench.mechanics.grasp.held import held_by_contacts
from clench.models.hand.reading.tendons import TendonMap
from clench.models.objects.grasp_object import BodyRole
from clench.models.objects.mass import mass_properties
from clench.scoring import criterion_registry
from clench.scoring.calibration import Calibration
from clench.scoring.choice import choose
from clench.scoring.criterion_registry import find_criterion
from clench.scoring.criterion_types import ScoringContext
from clench.solver.alternatives import finger_candidates
from clench.solver.problem import make_context, make_problem

MUG = clench.GraspObject.load("mug")
SEEN = {}


class Spy:
    """Keep what criteria are given."""

    name, unit, source, scale, larger_is_better = "spy", "-", "test", 1.0, True

    def score_hand(self, chosen, context):
        SEEN.update(chosen=list(chosen), context=context)
        return 0.0


@pytest.fixture
def chosen(monkeypatch):
    """Return the chosen sets of a solve, and their context."""

    def solve(hand, obj, command):
        with monkeypatch.context() as patch:
            patch.setattr(criterion_registry, "_registry", {**criterion_registry._registry, "spy": Spy()})
            solution = clench.solve(hand, obj, command)
        return SEEN["chosen"], SEEN["context"], solution

    return solve


def mug_command(**changes):
    pose = Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5])
    return clench.GraspCommand(hand_pose=pose, criteria={"spy": 1.0}, **{"preshape": "open", **changes})


def score(name, sets, context):
    return find_criterion(name, "test").score_hand(sets, context)


def test_epsilon_is_that_of_all_contacts(chosen):
    hand = clench.Hand.load("robonaut2")
    sets, context, _ = chosen(hand, MUG, mug_command())
    touches = [t for c in sets for t in c.holding]
    friction = [pair_friction(hand, t.link, MUG.bodies[t.body]) for t in touches]
    contacts = make_contacts([t.position for t in touches], [-t.normal for t in touches], friction)
    mass = mass_properties(MUG)
    T = context.T_palm_object
    held = held_by_contacts(contacts, T[:3, :3] @ mass.center + T[:3, 3], mass.length)
    found = score("epsilon", sets, context)
    assert found == pytest.approx(epsilon(held).radius, rel=1e-9, abs=1e-12)
    assert found > epsilon_bound(held) > 0.0
    assert score("epsilon", [], context) == 0.0


def test_what_is_prepared_at_once_is_what_is_found_one_by_one(chosen):
    sets, context, _ = chosen(clench.Hand.load("robonaut2"), MUG, mug_command())
    alone = score("epsilon", sets, context)
    context.kept.clear()
    find_criterion("epsilon", "test").prepare([replace(sets[0], touches=()), *sets], context)
    kept = {key for key in context.kept if "wrenches" in key}
    assert len(kept) == len(sets) + 1
    assert score("epsilon", sets, context) == pytest.approx(alone, rel=1e-12)
    assert {key for key in context.kept if "wrenches" in key} == kept


@pytest.mark.parametrize("seed", [0, 2, 7])
def test_the_steadiest_of_all_combinations_is_chosen(seed):
    """Every combination of three open values per finger is judged by itself: none is better than the chosen one."""
    hand = clench.Hand.load("patent15")
    pose = clench.approach_poses(hand, MUG, seed + 1, 0)[seed]
    command = clench.GraspCommand(hand_pose=pose, planes=1, open_variants=(0.0, 0.1, 0.2), preshape="open")
    problem = make_problem(hand, MUG, command)
    calibration = Calibration("steady", {"range_of_motion": 0.2, "epsilon": 1.0})
    context = make_context(problem, calibration)
    groups = finger_candidates(problem)
    choice = choose(groups, calibration, context)
    totals = {}
    for sets in itertools.product(*(finger.equals for finger in choice.fingers)):
        steady = score("epsilon", [g[i] for g, i in zip(groups, sets, strict=True)], context)
        own = sum(f.totals[i] for f, i in zip(choice.fingers, sets, strict=True))
        totals[sets] = own + calibration.worth("epsilon", steady)
    assert choice.proved
    assert choice.total == pytest.approx(max(totals.values()), abs=1e-9)
    assert totals[tuple(choice.chosen)] == pytest.approx(choice.total, abs=1e-9)
    assert len(totals) > 1


def pincer(height=0.035, **changes):
    """Return two fingers that close on what is between them, along z, links 80 mm long."""
    builder = HandBuilder().finger(
        "index", [along_x(0.007, 0.08)], [0.08], base=mount((-0.04, 0, height)), upper=1.5, axes=[[0, 1, 0]]
    )
    builder.finger("thumb", [along_x(0.007, 0.08)], [0.08], base=mount((-0.04, 0, -height)), upper=1.5, thumb=True)
    return replace(builder.hand(), **changes)


def held_ball(chosen, hand):
    command = clench.GraspCommand(hand_pose=Pose.identity(), criteria={"spy": 1.0}, preshape="open")
    sets, context, _ = chosen(hand, clench.GraspObject.load("sphere:r=0.02"), command)
    return sets, context


def test_the_least_torque_agrees_with_statics(chosen):
    """Two opposed fingers and a weight: what the lower one carries and both squeeze, balanced about both joints."""
    sets, context = held_ball(chosen, pincer())
    below, above = (next(t for t in c.holding) for c in sorted(sets, key=lambda c: c.holding[0].position[2]))
    found = score("actuation_force", sets, context)
    # Planar statics: forces (x, z) at both contacts inside the cones, and a fine grid over the one that is free.
    points = np.array([below.position, above.position])[:, [0, 2]]
    normals = -np.array([below.normal, above.normal])[:, [0, 2]]
    tangents = np.stack([normals[:, 1], -normals[:, 0]], axis=1)
    anchors = np.array([[-0.04, -0.035], [-0.04, 0.035]])
    columns = np.array([normals[0], tangents[0], normals[1], tangents[1]])
    moments = np.repeat(points, 2, axis=0)
    rows = np.column_stack([columns, moments[:, 1] * columns[:, 0] - moments[:, 0] * columns[:, 1]])
    base = np.linalg.lstsq(rows.T, np.array([0.0, 1.0, 0.0]), rcond=None)[0]
    f = base + np.linspace(-50.0, 50.0, 400001)[:, None] * np.linalg.svd(rows.T)[2][-1]
    f = f[(np.abs(f[:, [1, 3]]) <= FRICTION * f[:, [0, 2]]).all(axis=1)]
    forces = f[:, [0, 2], None] * normals + f[:, [1, 3], None] * tangents
    arms = points - anchors
    torques = arms[:, 1] * forces[:, :, 0] - arms[:, 0] * forces[:, :, 1]
    assert found == pytest.approx(np.abs(torques).max(axis=1).min(), abs=1e-5)


def test_any_way_is_no_less_than_one_way(chosen):
    hand = clench.Hand.load("robonaut2")
    sets, context, _ = chosen(hand, MUG, mug_command())
    one, any_way = (score(name, sets, context) for name in ("actuation_force", "actuation_force_any_way"))
    assert one is not None
    assert any_way is None or any_way >= one - 1e-9


def wrench_hull_torque(sets, context, load, edges=64):
    """Return the least worst torque that holds a load, by a linear program over fine polyhedra inside the cones.

    Moments are taken about every joint that moves the touching link: a computation apart from ours.
    """
    hand, T = context.hand, context.T_palm_object
    mass = mass_properties(context.obj)
    center = T[:3, :3] @ mass.center + T[:3, 3]
    wrenches, torques, followers = [], [], {c.follower for c in hand.couplings}
    q = combined_posture(hand, context.start, sets)
    for c in sets:
        for t in c.holding:
            n = -np.asarray(t.normal)
            moved = np.array([velocity(hand, q, j, t) for j in range(len(q)) if j not in followers])
            side = np.cross(n, [0.3, 0.5, 0.8])
            side /= np.linalg.norm(side)
            for angle in np.linspace(0.0, 2.0 * np.pi, edges, endpoint=False):
                f = n + FRICTION * (np.cos(angle) * side + np.sin(angle) * np.cross(n, side))
                arm = np.asarray(t.position) - center
                wrenches.append(np.concatenate([f, np.cross(arm, f)]))
                torques.append(moved @ f)
    W, R = np.array(wrenches).T, np.array(torques).T
    ones = np.ones((len(R), 1))
    found = linprog(
        np.append(np.zeros(W.shape[1]), 1.0),
        A_eq=np.hstack([W, np.zeros((6, 1))]),
        b_eq=-np.asarray(load),
        A_ub=np.vstack([np.hstack([R, -ones]), np.hstack([-R, -ones])]),
        b_ub=np.zeros(2 * len(R)),
        method="highs",
    )
    return found.fun if found.status == 0 else None


def velocity(hand, q, joint, touch, step=1e-6):
    """Return how a touch moves with a joint: a force's work is its torque; followers turn along."""
    shifted = []
    for sign in (1.0, -1.0):
        turned = q.copy()
        turned[joint] += sign * step
        for c in hand.couplings:
            turned[c.follower] += c.ratio * (turned[c.leader] - q[c.leader])
        before, after = (hand.link_poses(x)[touch.link] for x in (q, turned))
        local = np.linalg.solve(before, np.append(touch.position, 1.0))
        shifted.append((after @ local)[:3])
    return (shifted[0] - shifted[1]) / (2.0 * step)


def grip(chosen, **changes):
    """Return three fingers around a ball, which hold it every way, and the context."""
    hand = clench.Hand.load("robonaut2")
    sets, context, _ = chosen(hand, MUG, mug_command(**changes))
    return sets, context


def test_six_pulls_take_what_a_linear_program_finds(chosen):
    sets, context = grip(chosen)
    pulls = np.vstack([np.eye(6)[:3], -np.eye(6)[:3]])
    expected = max(wrench_hull_torque(sets, context, pull) for pull in pulls)
    assert score("actuation_force_six_pulls", sets, context) == pytest.approx(expected, rel=3e-3)
    assert score("actuation_force_six_pulls", sets, context) <= expected + 1e-9


def test_a_task_takes_what_a_linear_program_finds_and_is_told_in_the_world(chosen):
    force, torque = np.array([1.0, 0.0, -2.0]), np.array([0.0, 0.02, 0.0])
    sets, context = grip(chosen, task_wrenches=({"force": tuple(force), "torque": tuple(torque)},))
    R = mug_command().hand_pose.rotation
    expected = wrench_hull_torque(sets, context, np.concatenate([R.T @ force, R.T @ torque]))
    assert score("actuation_force_task", sets, context) == pytest.approx(expected, rel=3e-3)
    assert score("actuation_force_task", sets, replace(context, task=np.empty((0, 6)))) is None


def test_the_worst_task_counts_and_limits_bind(chosen):
    light, heavy = {"force": (0.0, 0.0, -1.0)}, {"force": (0.0, 0.0, -3.0)}
    sets, context = grip(chosen, task_wrenches=(heavy,))
    one = score("actuation_force_task", sets, context)
    both = score("actuation_force_task", *grip(chosen, task_wrenches=(light, heavy)))
    assert both == pytest.approx(one, rel=1e-6)
    assert one == pytest.approx(3.0 * score("actuation_force", sets, context), rel=1e-6)
    assert score("actuation_force_task", *grip(chosen, task_wrenches=({"force": (0.0, 0.0, -3000.0)},))) is None


def test_what_cannot_be_held_has_no_force(chosen):
    sets, context = held_ball(chosen, pincer())
    lower = [c for c in sets if c.holding and c.holding[0].position[2] > 0.0]
    assert score("actuation_force", lower, context) is None
    assert score("actuation_force", [], context) is None


def test_tensions_of_equal_antagonistic_tendons_are_torque_over_arm(chosen):
    """With equal arms the least worst tension is the least worst torque over the arm, and above the least tension."""
    arm, least = 0.01, 1.0
    arms = ((arm, -arm, 0.0, 0.0), (0.0, 0.0, arm, -arm))
    hand = pincer(tendons=TendonMap(("index_0", "thumb_0"), arms, (least,) * 4, (500.0,) * 4))
    sets, context = held_ball(chosen, hand)
    torque = score("actuation_force", sets, context)
    assert score("tendon_tension", sets, context) == pytest.approx(torque / arm + least, rel=1e-5)


def test_no_tendons_no_tension(chosen):
    assert score("tendon_tension", *held_ball(chosen, pincer())) is None


def test_criteria_of_the_hand_say_nothing_without_an_object():
    context = ScoringContext(pincer(), np.zeros(2))
    assert score("epsilon", [], context) is None
    assert score("actuation_force", [], context) is None


@pytest.mark.parametrize("preset", ["steady", "gentle", "quick", "balanced"])
def test_presets_choose(preset):
    hand = clench.Hand.load("robonaut2")
    pose = Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5])
    command = clench.GraspCommand(hand_pose=pose, criteria=preset, yaw_grid=(0.0, 0.1), planes=1, preshape="open")
    solution = clench.solve(hand, MUG, command)
    assert solution.choice["calibration"] == preset
    assert solution.is_valid()
    assert set(solution.choice["criteria"]) | set(solution.choice["unused"])


def test_weight_on_epsilon_never_makes_the_grip_less_steady():
    hand = clench.Hand.load("robonaut2")
    pose = Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5])
    bounds = []
    for weight in (0.0, 0.1, 1.0, 10.0):
        criteria = {"range_of_motion": 1.0, "epsilon": weight} if weight else {"range_of_motion": 1.0}
        command = clench.GraspCommand(
            hand_pose=pose, criteria=criteria, yaw_grid=(0.0, 0.15, -0.15), planes=1, preshape="open"
        )
        scores = clench.solve(hand, MUG, command).choice["hand_scores"]
        bounds.append(scores.get("epsilon", 0.0))
    assert bounds[1:] == sorted(bounds[1:])


def test_scores_of_the_hand_are_also_told_as_it_is_at_last():
    """With yaw alternatives some finger meets another and is closed again: what was compared stays beside what is."""
    hand = clench.Hand.load("robonaut2")
    pose = Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5])
    grids = {"yaw_grid": (0.0, 0.1, -0.1, 0.2, -0.2), "opposition_grid": (0.0, 0.2, -0.2), "planes": 1}
    command = clench.GraspCommand(hand_pose=pose, criteria={"range_of_motion": 1.0, "epsilon": 10.0}, **grids)
    choice = clench.solve(hand, MUG, command).choice
    again = [f["closed_again"] for f in choice["fingers"].values()]
    assert (choice["final_hand_scores"] != choice["hand_scores"]) == any(again)


def test_clearance_is_the_gap_to_obstacles_alone():
    hand = pincer(0.06)
    ball = clench.GraspObject.load("sphere:r=0.02")
    wall = clench.GraspObject.load("box:x=0.02,y=0.2,z=0.02").bodies[0].moved(Pose([0.09, 0.0, 0.03]))
    scene = replace(ball, bodies=(*ball.bodies, replace(wall, name="wall", role=BodyRole.OBSTACLE)))
    command = clench.GraspCommand(hand_pose=Pose.identity(), criteria={"clearance": 1.0}, preshape="open")
    solution = clench.solve(hand, scene, command)
    index = solution.fingers["index"]
    chosen = index.candidates[index.chosen]
    q = chosen.joint_angles["index_0"]
    # The index is a capsule from (-0.04, 0, 0.06), 80 mm long, turned down by q; the wall is a box beside its tip.
    along = np.array([np.cos(q), -np.sin(q)])
    points = np.array([-0.04, 0.06]) + np.linspace(0.0, 0.08, 20001)[:, None] * along
    low, high = np.array([0.08, 0.02]), np.array([0.10, 0.04])
    outside = np.maximum(np.maximum(low - points, points - high), 0.0)
    gap = np.linalg.norm(outside, axis=1).min() - 0.007
    assert chosen.scores["clearance"] == pytest.approx(min(gap, 0.05), abs=1e-6)
    alone = clench.solve(hand, ball, command)
    assert alone.choice["unused"] == ["clearance"]
