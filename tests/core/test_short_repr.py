"""Every public object prints in one to five lines, whatever it holds."""

from __future__ import annotations

import enum
import inspect
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clench
from clench.core.showing.short_repr import short_repr

POSE = clench.Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5])


def is_made(kind: Any) -> bool:
    """Whether users make or are given instances: not of errors, of enumerations and of what is only implemented."""
    if not inspect.isclass(kind) or issubclass(kind, Exception | enum.Enum):
        return False
    return not getattr(kind, "_is_protocol", False)


@pytest.fixture(scope="module")
def instances(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """One instance of every public class, filled by ordinary use, by the name of the class."""
    folder = tmp_path_factory.mktemp("reprs")
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    command = clench.GraspCommand(POSE)
    solution = clench.complete(clench.solve(hand, mug, command), hand, mug)
    finger = solution.fingers["thumb"]
    batch = clench.solve_batch(hand, mug, [POSE, POSE])
    simulated = clench.SimulatedHand(hand, mug, hold=clench.Hold())
    report = clench.execute(solution, simulated)
    made = [hand, mug, mug.bodies[0], POSE, command, solution, finger, finger.candidates[0], solution.contacts[0]]
    made += [batch, batch.contacts, clench.grasp_quality(solution, hand, mug), clench.plan_squeeze(solution, hand, mug)]
    made += [clench.pose_error(hand, mug, command), clench.sensitivity(solution, hand, mug)]
    made += [clench.Tracker(hand, mug, command), clench.plan_trajectory(solution, hand, obj=mug), report]
    made += [report.hold, report.history, simulated, simulated.hold, clench.Record(folder / "record.db")]
    made += [clench.ReadySignal(hand, folder / "record.db", f"file:{folder / 'ready'}"), clench.Film()]
    made += [clench.JointMap(), clench.Ros2Driver(), clench.OrcaDriver(mock=True), clench.DriverLimits()]
    made += [clench.HardwareHand(hand, clench.Ros2Driver()), clench.HandState(dict(solution.joint_angles))]
    made += [clench.JointPath(hand.joint_names, np.ones(50), np.ones((50, len(hand.joints))), 0.1)]
    made += [clench.GraspPosture("grasp_0", POSE, joint_angles=dict(solution.joint_angles))]
    finding = clench.Finding(next(iter(clench.FindingCode)), "what was found " * 50, joints=hand.joint_names)
    made += [finding]
    weights = folder / "weights.toml"
    weights.write_text("[weights]\nrange_of_motion = 1.0\n")
    made += [clench.load_calibration(weights)]
    search = clench.iter_grasps(hand, mug, 1, most=64, path=False)
    made += [*search, search, search.plan(), clench.stable_poses(mug)[0], clench.Region.sphere([0, 0, 0], 0.1)]
    return {type(each).__name__: each for each in made}


def test_every_public_object_prints_in_one_to_five_lines(instances: dict[str, Any]) -> None:
    spaces = [clench, *(getattr(clench, name) for name in clench._NAMESPACES)]
    expected = {name for space in spaces for name in space.__all__ if is_made(getattr(space, name))}
    assert expected == set(instances)
    for name, each in instances.items():
        text = repr(each)
        assert text.startswith(f"{name}("), text
        assert 1 <= len(text.splitlines()) <= 5, text
        assert len(text) <= 600, text
        assert "object at 0x" not in text


def test_parts_of_public_objects_print_shortly(instances: dict[str, Any]) -> None:
    hand, mug, solution = instances["Hand"], instances["GraspObject"], instances["GraspSolution"]
    shape = mug.bodies[0].shapes[0]
    parts = [hand.joints[0], hand.links[1], hand.fingers[0], shape, shape.mesh, instances["GraspBatch"].question]
    parts += [instances["SqueezePlan"].found, instances["SqueezePlan"].grasp, instances["PoseErrorReport"].corners[0]]
    parts += [instances["ExecutionReport"].contacts[0], *instances["HoldReport"].pulls.values(), solution.hand_pose]
    for each in parts:
        assert 1 <= len(repr(each).splitlines()) <= 5, repr(each)


def test_what_matters_is_in_the_text(instances: dict[str, Any]) -> None:
    assert "robonaut2" in repr(instances["Hand"])
    assert "'thumb'" in repr(instances["Hand"])
    solution = " ".join(repr(instances["GraspSolution"]).split())
    assert "hand='robonaut2', object='mug', status='grasp', certified=True" in solution
    assert "'thumb': 'touch'" in solution
    assert "poses=2" in repr(instances["GraspBatch"])
    assert "'grasp': 2" in repr(instances["GraspBatch"])
    # What is as by default is left out of what users ask for.
    assert repr(instances["GraspCommand"]) == f"GraspCommand(hand_pose={POSE!r})"
    assert repr(clench.Hold()) == "Hold()"
    assert repr(clench.Hold(mass=0.3)) == "Hold(mass=0.3)"


@dataclass
class Heap:
    """Whatever fields may hold."""

    numbers: Any
    text: Any = ""
    none: float | None = 1.0
    files: Any = field(default_factory=dict)

    __repr__ = short_repr


@pytest.mark.parametrize(
    ("heap", "text"),
    [
        (Heap(np.arange(7.0)), "Heap(numbers=array(7,))"),
        (Heap(np.float64(0.123456789), "x"), "Heap(numbers=0.1235, text='x')"),
        (Heap([1, 2.0, None, True], none=None), "Heap(numbers=[1, 2, None, True], none=None)"),
        (Heap(tuple(range(7))), "Heap(numbers=[7 int])"),
        (Heap((np.ones(3), "a")), "Heap(numbers=[2 ndarray or str])"),
        (Heap(b"123", files={"a": b"1"}), "Heap(numbers=<3 bytes>, files={1 items})"),
        (Heap(Path("a")), "Heap(numbers='a')"),
        (Heap(object()), "Heap(numbers=object(...))"),
        (Heap(clench.JointRole.CLOSING, "a\nb"), r"Heap(numbers='closing', text='a\nb')"),
    ],
    ids=str,
)
def test_values_of_all_kinds_are_shown_briefly(heap: Heap, text: str) -> None:
    assert repr(heap) == text


def test_very_long_values_end_in_dots() -> None:
    heap = Heap(["word " * 100] * 6, "y" * 10_000, files={f"{k}" * 100: k for k in range(6)})
    lines = repr(heap).splitlines()
    assert len(lines) == 5
    assert max(map(len, lines)) <= 120
    assert lines[-1].endswith(" ...)")
