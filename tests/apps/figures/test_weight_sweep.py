"""The figure of a weight that changes: its numbers rise with the weight, and what cannot be swept is refused."""

from pathlib import Path

import pytest

import clench
from clench.apps.figures.weight_sweep import draw_sweep, sweep_weight
from clench.core.exceptions import CommandError

COMMAND = clench.GraspCommand(
    hand_pose=clench.Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5]),
    planes=1,
    fingers=("index", "thumb"),
    yaw_grid=(0.0, 0.2),
    open_variants=(0.0, 0.3),
    criteria={"range_of_motion": 1.0},
    preshape="open",
)


def test_a_figure_of_the_sweep(tmp_path: Path) -> None:
    from matplotlib.image import imread

    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    weights = [0.1, 10.0]
    solutions = sweep_weight(hand, mug, COMMAND, "limit_distance", weights)
    left = [sum(f.candidates[f.chosen].scores["limit_distance"] for f in s.fingers.values()) for s in solutions]
    assert left[1] >= left[0]
    path = draw_sweep(hand, mug, solutions, ("limit_distance", "range_of_motion"), weights, tmp_path / "w.png")
    picture = imread(path)[:, :, :3]
    assert picture.shape[:2] == (560, 1560)
    for third in (picture[:, :520], picture[:, 540:1010], picture[:, 1050:1520]):
        assert third.std() > 0.05  # something is drawn there


@pytest.mark.parametrize(("criteria", "weights"), [("steady", [1.0, 2.0]), ({"range_of_motion": 1.0}, [1.0])])
def test_what_cannot_be_swept(criteria: object, weights: list[float]) -> None:
    command = clench.GraspCommand(hand_pose=clench.Pose.identity(), criteria=criteria, preshape="open")  # type: ignore[arg-type]
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    with pytest.raises(CommandError, match="weights by name, and at least two weights"):
        sweep_weight(hand, mug, command, "limit_distance", weights)
