"""Hold tests of meshes that are not convex: solved again on the pieces that the simulation collides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clench
from clench.closing.collision.depths import hand_depths
from clench.closing.collision.packed_object import pack_object
from clench.execution.simulation import piece_hold, simulated_hand
from clench.execution.simulation.convex_pieces import in_pieces
from clench.execution.simulation.hold import Hold, HoldReport
from clench.execution.simulation.piece_hold import NO_GRASP_ON_PIECES, ON_PIECES, hold_as_collided
from clench.execution.trajectory import plan_trajectory
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource
from clench.solver.solution import GraspSolution


def waisted() -> GraspObject:
    """A body of revolution with a waist: pieces bridge it."""
    import trimesh

    heights = np.linspace(-0.05, 0.05, 21)
    profile = np.column_stack([0.022 + 4.0 * heights**2, heights])
    mesh = trimesh.creation.revolve(np.vstack([[0.0, -0.05], profile, [0.0, 0.05]]), sections=24)
    return GraspObject.from_meshes([(mesh.vertices, mesh.faces)], name="waisted")


@pytest.fixture(scope="module")
def grip() -> tuple[Hand, GraspObject, GraspSolution]:
    hand, obj = clench.Hand.load("robonaut2"), waisted()
    for pose in clench.approach_poses(hand, obj, 30, 1):
        solution = clench.solve(hand, obj, clench.GraspCommand(hand_pose=pose, preshape="open"))
        if solution.is_valid() and clench.plan_squeeze(solution, hand, obj, gravity=None).feasible:
            return hand, obj, solution
    raise AssertionError("no grip found")


def test_the_grasp_that_is_tested_fits_the_pieces(grip: tuple[Hand, GraspObject, GraspSolution]) -> None:
    hand, obj, solution = grip
    report = hold_as_collided(solution, hand, obj, Hold(duration=0.2), plan_trajectory(solution, hand, obj=obj))
    assert report.as_given is not None
    said = "The hold test executed the grasp solved again on the object's convex pieces: "
    assert report.reason.startswith((f"{said}held against ", f"{said}dropped when "))
    assert report.reason.count(". ") == 0
    document = report.to_dict()
    assert document["as_given"]["held"] == report.as_given.held
    assert document["as_given"]["as_given"] is None
    # As given, it overlaps the pieces or misses them; solved again, neither: nothing is pushed before it is squeezed.
    collided = in_pieces(obj)
    q = np.array(list(solution.joint_angles.values()))
    T = np.linalg.inv(solution.hand_pose.matrix)
    off = hand_depths(hand, q, pack_object(collided), T, CollisionSource.ENGINE)
    assert max((found.depth for found in off), default=0.0) > 1e-5 or not report.as_given.held
    assert report.closed.distance < 1e-4


def test_an_object_that_is_convex_is_tested_as_it_is() -> None:
    hand, ball = clench.Hand.load("robonaut2"), clench.GraspObject.load("ball")
    pose = clench.approach_poses(hand, ball, 5, 1)[4]
    solution = clench.solve(hand, ball, clench.GraspCommand(hand_pose=pose, preshape="open"))
    report = hold_as_collided(solution, hand, ball, Hold(duration=0.2), plan_trajectory(solution, hand, obj=ball))
    assert report.as_given is None


def test_the_touch_is_that_of_the_pieces_where_they_stop_the_hand(
    grip: tuple[Hand, GraspObject, GraspSolution],
) -> None:
    hand, obj, solution = grip
    steps = ({"thumb_proximal": 0.2},)
    times: list[float] = []
    simulated = clench.SimulatedHand(hand, obj, angle_tolerance=1e-4, on_step=lambda time, _: times.append(time))
    report = clench.execute(replace(solution, next_steps=steps), simulated, speed=0.5)
    said = "Executed the grasp solved again on the object's convex pieces: every joint is within "
    assert report.reason.startswith(said)
    first = "First, the simulation executed the grasp of the solution itself. Not reached: joint "
    assert [note for note in report.notes if note.startswith(first)]
    assert all(joint.error == pytest.approx(0.0, abs=1e-4) for joint in report.joints.values())
    assert len(report.next_steps) == 1
    # The observer sees one motion, at the speed that was asked for.
    assert times == sorted(times)
    given = plan_trajectory(solution, hand, obj=obj, speed=0.5)
    assert times[-1] > given.duration


def test_the_reason_says_that_there_is_no_grasp_on_the_pieces(
    grip: tuple[Hand, GraspObject, GraspSolution], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(simulated_hand, "solve_on_pieces", lambda *_: None)
    hand, obj, solution = grip
    report = clench.execute(solution, clench.SimulatedHand(hand, obj, angle_tolerance=1e-4))
    assert not report.success
    assert report.reason.startswith("Not reached: joint ")
    assert report.reason.endswith(NO_GRASP_ON_PIECES)


def test_the_hold_test_is_of_the_grasp_that_reached_the_touch(grip: tuple[Hand, GraspObject, GraspSolution]) -> None:
    hand, obj, solution = grip
    simulated = clench.SimulatedHand(hand, obj, angle_tolerance=1e-4, hold=Hold(duration=0.2))
    report = clench.execute(solution, simulated)
    assert report.hold is not None
    assert report.hold.as_given is None
    # Two sentences: what was executed, and what held.
    executed, held = report.reason.split(" touch. ")
    assert executed.startswith("Executed the grasp solved again on the object's convex pieces: ")
    assert held == report.hold.reason
    assert held.startswith(("Held against ", "Dropped when "))


def test_the_hold_test_of_the_solution_itself_is_a_note(grip: tuple[Hand, GraspObject, GraspSolution]) -> None:
    hand, obj, solution = grip
    report = clench.execute(solution, clench.SimulatedHand(hand, obj, angle_tolerance=1.0, hold=Hold(duration=0.2)))
    assert report.hold is not None
    assert report.hold.as_given is not None
    given = report.hold.as_given.reason
    assert f"The hold test also executed the grasp of the solution itself. {given}" in report.notes
    assert report.reason.endswith(report.hold.reason)


def test_a_grasp_on_the_pieces_that_cannot_be_tested_is_told(
    grip: tuple[Hand, GraspObject, GraspSolution], monkeypatch: pytest.MonkeyPatch
) -> None:
    hand, obj, solution = grip
    untested = HoldReport(False, "Not tested: the hand would be 2 mm deep in the table.", Hold(), "", True, {})
    monkeypatch.setattr(piece_hold, "hold_and_pull", lambda *_, **__: untested)
    report = hold_as_collided(solution, hand, obj, Hold(), plan_trajectory(solution, hand, obj=obj))
    assert report.reason == f"{untested.reason} This is about {ON_PIECES}."
