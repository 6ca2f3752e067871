"""Paths to the touch are free: fingers wait for each other, and what has no free path is refused."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from facing_fingers import crossing, facing_fingers

import clench
from clench.closing.collision.path_check import find_path_overlap
from clench.core.exceptions import MotionError
from clench.execution.executing import execute
from clench.execution.execution_report import ExecutionReport
from clench.execution.trajectory import Trajectory, plan_trajectory
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole
from clench.models.shapes import CollisionSource, Shape, ShapeKind
from clench.solver.solution import GraspSolution

X, Y, Z = np.eye(3)
ENGINE = CollisionSource.ENGINE
DATA = Path(__file__).parents[3] / "shared" / "data" / "hands"
REAL = ("leap_hand_urdf/leap_hand_right.urdf", "wonik_allegro_mjcf/right_hand.xml", "shadow_hand_mjcf/right_hand.xml")


def test_one_finger_waits_where_both_would_meet(tmp_path: Path) -> None:
    hand = facing_fingers()
    trajectory = plan_trajectory(crossing(hand, -1.0, 1.0), hand)
    assert find_path_overlap(hand, trajectory.positions, ENGINE) is None
    at_once = np.linspace([-1.0, -1.0], [1.0, 1.0], 9)
    assert find_path_overlap(hand, at_once, ENGINE) is not None
    assert trajectory.turns == (("a",), ("b",))
    assert not trajectory.touches_at_once
    waits, pushes = trajectory.notes
    assert "'a', then 'b'" in waits
    assert "fingers may touch one after another" in pushes
    moved = np.abs(np.diff(trajectory.positions, axis=0)) > 1e-12
    assert not (moved[:, 0] & moved[:, 1]).any()
    trajectory.save(tmp_path / "t.json")
    assert Trajectory.load(tmp_path / "t.json").turns == trajectory.turns


def test_fingers_that_do_not_meet_move_at_once() -> None:
    hand = facing_fingers()
    trajectory = plan_trajectory(crossing(hand, 0.6, 1.2), hand)
    assert trajectory.turns == (("a", "b"),)
    assert len(trajectory.notes) == 1
    assert "The path has no pregrasp" in trajectory.notes[0]


def test_without_a_free_path_there_is_no_trajectory() -> None:
    hand = facing_fingers()
    solution = crossing(hand, -1.0, 0.0)
    with pytest.raises(
        MotionError, match=r"'b_link_0' would overlap 'a_link_0' by at least .* mm .* s after the start"
    ):
        plan_trajectory(solution, hand)
    forced = plan_trajectory(solution, hand, force=True)
    np.testing.assert_array_equal(forced.positions[-1], [0.0, 0.0])


def test_execution_is_refused_and_says_why() -> None:
    hand, sent = facing_fingers(), []

    class Mover:
        name, obj = "mover", None

        def __init__(self) -> None:
            self.hand = hand

        def execute(self, solution: GraspSolution, trajectory: Trajectory) -> ExecutionReport:
            sent.append(trajectory)
            return ExecutionReport(self.name, success=True, reason="done")

    report = execute(crossing(hand, -1.0, 0.0), Mover())
    assert not report.success
    assert report.reason.startswith("Not carried out: No free path to the touch was found for hand 'chain'")
    assert not sent
    assert execute(crossing(hand, -1.0, 0.0), Mover(), force=True).success
    waited = execute(crossing(hand, -1.0, 1.0), Mover())
    assert len(sent) == 2
    assert any("wait for each other" in note for note in waited.notes)


@pytest.mark.shared
@pytest.mark.skipif(not DATA.is_dir(), reason="needs ../shared/data")
@pytest.mark.parametrize("model", REAL)
def test_links_of_makers_hands_stay_apart_by_mujocos_hulls(model: str) -> None:
    """MuJoCo measures the depth of every pair of hulls at steps of 0.02 rad of trajectories of certified grasps."""
    hand = clench.Hand.load(DATA / model)
    judge, count = HullJudge(hand), 0
    obj = clench.GraspObject.load("cylinder:r=0.03,h=0.12")
    for grasp in clench.plan_grasps(hand, obj, 3, most=96):
        assert grasp.trajectory is not None
        assert judge.deepest(grasp.trajectory.positions) <= 1e-5
        count += 1
    assert count >= 2


class HullJudge:
    """Measure with MuJoCo how deep links of a hand overlap that must not."""

    def __init__(self, hand: Hand) -> None:
        import mujoco

        self.mujoco, self.model = mujoco, mujoco.MjSpec.from_string(hand.spec_xml, assets=dict(hand.assets)).compile()
        self.data = mujoco.MjData(self.model)
        names = {link.name: i for i, link in enumerate(hand.links)}
        link = [names.get(self.model.body(int(b)).name, -1) for b in self.model.geom_bodyid]
        solid = [g for g in range(self.model.ngeom) if self.model.geom_contype[g] and link[g] in hand.solid_links]
        allowed = set(hand.allowed_pairs_for(ENGINE))
        self.pairs = [
            (a, b)
            for a in solid
            for b in solid
            if a < b and link[a] != link[b] and (min(link[a], link[b]), max(link[a], link[b])) not in allowed
        ]
        self.qpos = [int(self.model.joint(j.name).qposadr[0]) for j in hand.joints]

    def deepest(self, path: np.ndarray) -> float:
        """Return the largest depth on a path [m]."""
        worst = 0.0
        for a, b in itertools.pairwise(path):
            steps = max(1, int(np.ceil(np.abs(b - a).max() / 0.02)))
            for k in range(1, steps + 1):
                self.data.qpos[self.qpos] = a + (k / steps) * (b - a)
                self.mujoco.mj_kinematics(self.model, self.data)
                for g, h in self.pairs:
                    if (
                        np.linalg.norm(self.data.geom_xpos[g] - self.data.geom_xpos[h])
                        < self.model.geom_rbound[[g, h]].sum()
                    ):
                        worst = max(worst, -self.mujoco.mj_geomDistance(self.model, self.data, g, h, 0.001, None))
        return worst


def test_a_hand_that_begins_in_the_object_has_no_free_path() -> None:
    """Neither for a blocked hand, nor in an obstacle that was not there when the grasp was computed."""
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    command = clench.GraspCommand(hand_pose=clench.Pose([0.0, 0.0, 0.0], wxyz=[0.5, 0.5, 0.5, 0.5]), preshape="open")
    blocked = clench.solve(hand, mug, command)
    assert blocked.status == "blocked"
    with pytest.raises(MotionError, match=r"'\w+' overlaps 'mug' by \d.* mm before anything moves\.$"):
        clench.plan_trajectory(blocked, hand, obj=mug)
    # Asked to, it plans a path all the same.
    assert len(clench.plan_trajectory(blocked, hand, obj=mug, force=True).times) > 0
    free = clench.solve(hand, mug, replace(command, hand_pose=clench.approach_poses(hand, mug, 1, 0)[0]))
    clench.plan_trajectory(free, hand, obj=mug)
    palm = (np.linalg.inv(mug.pose.matrix) @ free.hand_pose.matrix)[:3, 3]
    box = clench.GraspObject.from_shape(Shape(ShapeKind.BOX, (0.01, 0.01, 0.01), clench.Pose(palm)), name="box")
    beside = mug.with_body(replace(box.bodies[0], role=BodyRole.OBSTACLE))
    with pytest.raises(MotionError, match=r"overlaps 'box' by .* before anything moves"):
        clench.plan_trajectory(free, hand, obj=beside)
