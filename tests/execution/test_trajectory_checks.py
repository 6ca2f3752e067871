"""Edited trajectories: refused when they are read, or before the hand that they are for moves."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fake_driver import FakeDriver

from clench.core.exceptions import CommandError, FileError
from clench.execution.hardware.hardware_hand import HardwareHand
from clench.execution.next_steps import Phase
from clench.execution.simulation.simulated_hand import SimulatedHand
from clench.execution.trajectory import Trajectory, plan_trajectory
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.solution import GraspSolution

pytestmark = pytest.mark.usefixtures("clock")


def moved(trajectory: Trajectory, point: int, joint: int, angle: float) -> Trajectory:
    positions = trajectory.positions.copy()
    positions[point, joint] = angle
    return replace(trajectory, positions=positions)


EDITS: dict[str, tuple[Callable[[Trajectory], Trajectory], str]] = {
    "another hand": (lambda t: replace(t, hand="other"), r"it is for hand 'other' .* expected hand 'pincer'"),
    "a joint missing": (
        lambda t: replace(t, joints=t.joints[:2], positions=t.positions[:, :2], velocity_limits=t.velocity_limits[:2]),
        r"with joints thumb, index; expected",
    ),
    "another joint": (lambda t: replace(t, joints=("thumb", "index", "toe")), r"toe; expected"),
    "another order": (lambda t: replace(t, joints=t.joints[::-1]), r"with joints index_tip, index, thumb; expected"),
    "beyond a limit": (lambda t: moved(t, 2, 0, 1.6), r"way-point 2 would tell joint 'thumb' 1\.6 rad, outside its"),
    "below a limit": (lambda t: moved(t, 0, 1, -0.01), r"way-point 0 would tell joint 'index' -0\.01 rad"),
    "no number": (lambda t: moved(t, 1, 1, np.nan), r"way-point 1 would tell joint 'index' nan rad"),
    "another touch": (lambda t: moved(t, -1, 0, 0.1), r"it ends with joint 'thumb' at 0\.1 rad; the touch"),
    "beyond a limit after the touch": (
        lambda t: replace(t, after=(Phase("squeeze", np.array([0.0, 1.0]), np.full((2, 3), 1.3), None),)),
        r"would tell joint 'index' 1\.3 rad, outside its limits \[0, 1\.2\] rad",
    ),
}


@pytest.mark.parametrize("name", EDITS)
def test_no_hand_moves_along_an_edited_trajectory(
    pincer: Hand, pinch: GraspSolution, ball: GraspObject, name: str
) -> None:
    edit, message = EDITS[name]
    edited = edit(plan_trajectory(pinch, pincer))
    driver, steps = FakeDriver({"thumb": 0.0, "index": 0.0}), []
    with pytest.raises(CommandError, match="trajectory: .*" + message):
        HardwareHand(pincer, driver).execute(pinch, edited)
    assert (driver.commands, driver.connected) == ([], False)
    with pytest.raises(CommandError, match="trajectory: .*" + message):
        SimulatedHand(pincer, ball, on_step=lambda *of: steps.append(of)).execute(pinch, edited)
    assert steps == []


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda d: d.update(joints=["thumb", "index", "thumb"]), r"joints: 'thumb' is named twice"),
        (lambda d: d["points"][3].update(time=d["points"][2]["time"] + 1e-4), r"points\[3\]\.positions\[\d\]: joint '"),
        (lambda d: d["points"][-1]["positions"].__setitem__(0, 1.4), r"joint 'thumb' would move at .* its limit is 3"),
        (lambda d: d.update(velocity_limits=[1e-3] * 3), r"joint '\w+' would move at .* its limit is 0\.001 rad/s"),
        (lambda d: d["points"][1].update(positions=[0.0] * 100_000), r"points\[1\]\.positions: expected 3 angles"),
        (lambda d: d["points"][1].update(time=-1.0), r"points\[1\]\.time: expected a number from 0"),
        (lambda d: d["points"][1].update(positions=[None] * 3), r"positions\[0\]: expected float, got null"),
    ],
    ids=["twice", "hurried", "jump", "slow limits", "many angles", "back in time", "no numbers"],
)
def test_an_edited_file_is_refused(
    pincer: Hand, pinch: GraspSolution, tmp_path: Path, edit: Callable[[dict], None], message: str
) -> None:
    document = plan_trajectory(pinch, pincer).to_dict()
    edit(document)
    (tmp_path / "t.json").write_text(json.dumps(document))
    with pytest.raises(FileError, match=r"t\.json: .*" + message):
        Trajectory.load(tmp_path / "t.json")
