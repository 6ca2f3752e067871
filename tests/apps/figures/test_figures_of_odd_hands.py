"""Pictures of hands that are built in unusual ways."""

from __future__ import annotations

from pathlib import Path

import pytest

import clench
from chain_hands import HandBuilder, along_x
from clench.apps.figures import draw_solution
from clench.core.pose import Pose


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("second", [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
def test_joints_in_one_place_are_drawn(second: list[float], tmp_path: Path) -> None:
    """There is no arm from one to the next."""
    shapes = [None, along_x(0.006, 0.05), along_x(0.006, 0.04)]
    axes = [[0.0, -1.0, 0.0], second, [0.0, -1.0, 0.0]]
    hand = HandBuilder().finger("index", shapes, [0.0, 0.05, 0.04], axes=axes, upper=1.5).hand()
    ball = clench.GraspObject.load("sphere:r=0.02", pose=Pose([0.05, 0.01, 0.05]))
    command = clench.GraspCommand(hand_pose=Pose.identity(), order=clench.ClosingOrder.TOGETHER, preshape="open")
    assert draw_solution(hand, ball, command, clench.solve(hand, ball, command), tmp_path)


def test_names_of_fingers_that_are_no_names_of_files_are_changed(tmp_path: Path) -> None:
    hand = HandBuilder().finger("r2/index: tip", [along_x(0.006, 0.05)], [0.05], upper=1.5).hand()
    ball = clench.GraspObject.load("sphere:r=0.02", pose=Pose([0.05, 0.01, 0.05]))
    command = clench.GraspCommand(hand_pose=Pose.identity(), planes=1, preshape="open")
    files = draw_solution(hand, ball, command, clench.solve(hand, ball, command), tmp_path / "new")
    assert [f.name for f in files] == ["r2_index_tip_plane.png", "r2_index_tip_candidates.png", "grasp.png"]
    assert sorted(tmp_path.rglob("*.png")) == sorted(files)
