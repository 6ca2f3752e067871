"""The simulated hand: reaches what was computed, and says so when it does not."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clench.core.exceptions import CommandError, HandError, ObjectError
from clench.core.pose import Pose
from clench.execution.executing import execute
from clench.execution.execution_report import ExecutionReport
from clench.execution.simulation import convex_pieces as convex_pieces_module
from clench.execution.simulation.convex_pieces import convex_pieces
from clench.execution.simulation.mujoco_scene import body_pose, build_scene
from clench.execution.simulation.simulated_hand import SimulatedHand, nearest
from clench.execution.trajectory import plan_trajectory
from clench.models.hand.hand import Hand
from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import Body, BodyRole, GraspObject
from clench.models.shapes import CollisionSource, Shape, ShapeKind
from clench.solver.solution import GraspSolution, SolutionStatus
from handmade import make_contact

BOX = TriangleMesh(
    [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)],
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ],
)  # fmt: skip


def scaled(mesh: TriangleMesh, sizes: tuple[float, float, float], at: tuple[float, float, float] = (0, 0, 0)):
    return TriangleMesh(mesh.vertices * sizes + np.array(at), mesh.triangles)


def mesh_object(*meshes: TriangleMesh, **changes: object) -> GraspObject:
    body = Body("part", (Shape(ShapeKind.MESH, mesh=TriangleMesh.joined(list(meshes))),))
    return replace(GraspObject("part", (body,)), **changes)


def angle_table() -> TriangleMesh:
    """An L of two boxes in one mesh: not convex."""
    return TriangleMesh.joined([scaled(BOX, (0.05, 0.05, 0.01)), scaled(BOX, (0.01, 0.05, 0.05), (0.04, 0, 0.06))])


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CLENCH_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path / "cache"


def carried_out(solution: GraspSolution, hand: Hand, obj: GraspObject) -> ExecutionReport:
    """Carry a solution out on another object than it was computed for, which `execute` refuses."""
    return SimulatedHand(hand, obj).execute(solution, plan_trajectory(solution, hand))


def test_a_pinch_is_reached(pincer: Hand, pinch: GraspSolution, ball: GraspObject, tmp_path: Path) -> None:
    report = execute(pinch, SimulatedHand(pincer, ball))
    assert report.success, report.reason
    assert report.largest_angle_error < 1e-3
    assert set(report.joints) == {"thumb", "index", "index_tip"}
    assert report.joints["thumb"].computed == pinch.joint_angles["thumb"]
    assert set(report.touched_links) == {"thumb_link", "index_distal"}
    for contact in report.contacts:
        assert contact.touches
        assert abs(contact.gap) < 1e-4
        assert contact.displacement < 1e-4
        np.testing.assert_allclose(contact.position, contact.computed, atol=1e-3)
    report.save(tmp_path / "report.json")
    document = json.loads((tmp_path / "report.json").read_text())
    assert document["schema"] == "clench.execution/1"
    assert document["joints"]["thumb"]["error"] == report.joints["thumb"].error
    assert len(document["contacts"]) == 2


def test_fingers_touch_at_the_same_moment(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    report = execute(pinch, SimulatedHand(pincer, ball))
    times = list(report.first_touch.values())
    assert None not in times
    assert max(times) - min(times) <= 0.005


def test_the_watcher_sees_the_motion(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    seen: list[tuple[float, np.ndarray]] = []
    report = execute(pinch, SimulatedHand(pincer, ball, on_step=lambda t, q: seen.append((t, q))), speed=0.5)
    assert len(seen) > 10
    np.testing.assert_allclose(seen[0][1], 0.0, atol=1e-9)
    assert seen[-1][1][0] == pytest.approx(report.joints["thumb"].reached)
    history = report.history
    assert history is not None
    np.testing.assert_array_equal(history.times, [t for t, _ in seen[:-1]])
    np.testing.assert_array_equal(history.measured, [q for _, q in seen[:-1]])
    np.testing.assert_array_equal(history.commanded[-1], list(pinch.joint_angles.values()))
    assert np.abs(history.commanded - history.measured).max() < 0.1


def test_an_object_in_the_way_is_not_success(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    wall = Body("wall", (Shape(ShapeKind.BOX, (0.004, 0.03, 0.03), Pose([0.03, 0, 0.01])),), BodyRole.OBSTACLE)
    report = carried_out(pinch, pincer, ball.with_body(wall))
    assert not report.success
    assert "joint 'thumb' is" in report.reason
    assert report.joints["thumb"].error < -0.02


def test_a_missing_object_is_not_success(pincer: Hand, pinch: GraspSolution) -> None:
    dot = GraspObject("ball", (Body("ball", (Shape(ShapeKind.SPHERE, (0.001, 0, 0)),)),))
    report = carried_out(pinch, pincer, dot)
    assert not report.success
    assert report.reason.startswith("Finger 'thumb' does not touch")
    assert report.first_touch == {"thumb": None, "index": None}
    assert report.largest_angle_error < 1e-3
    assert report.contacts[0].gap == pytest.approx(BALL_TO_DOT, abs=1e-3)


BALL_TO_DOT = 0.02 - 0.001


def test_another_geometry_is_refused(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    larger = GraspObject("ball", (Body("ball", (Shape(ShapeKind.SPHERE, (0.021, 0, 0)),)),))
    with pytest.raises(CommandError, match=r"geometry_hash: .* another geometry of object 'ball'; .* scale"):
        execute(pinch, SimulatedHand(pincer, larger), force=True)
    bent = replace(pincer, joints=(replace(pincer.joints[0], upper=1.4), *pincer.joints[1:]))
    with pytest.raises(CommandError, match=r"geometry_hash: .* another geometry of hand 'pincer'; .* hand file"):
        execute(pinch, SimulatedHand(bent, ball))


def test_passed_contacts_are_not_asked_for(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    passed = make_contact(finger="index", link="index_proximal", passed=True, gap=0.01)
    report = execute(replace(pinch, contacts=(*pinch.contacts, passed)), SimulatedHand(pincer, ball))
    assert report.success
    assert len(report.contacts) == 2


def test_invalid_solutions_are_not_carried_out(pincer: Hand, pinch: GraspSolution, ball: GraspObject) -> None:
    hand = SimulatedHand(pincer, ball)
    report = execute(replace(pinch, max_penetration=0.01), hand)
    assert not report.success
    assert report.reason.startswith("Not carried out: The hand penetrates the object by 0.01 m")
    assert report.joints == {}
    forced = execute(replace(pinch, max_penetration=0.01), hand, force=True)
    assert forced.success, forced.reason
    report = execute(replace(pinch, status=SolutionStatus.BLOCKED), hand)
    assert report.reason == "Not carried out: its status is 'blocked'."
    with pytest.raises(CommandError, match="The solution is for hand 'other', the actuator moves 'pincer'"):
        execute(replace(pinch, hand="other"), hand)


def test_the_palm_is_where_the_command_says(pincer: Hand, ball: GraspObject, pinch: GraspSolution) -> None:
    import mujoco

    q = np.array([0.3, 0.2, 0.4])
    scene = build_scene(pincer, ball, pinch.hand_pose, q)
    data = mujoco.MjData(scene.model)
    data.qpos[scene.qpos] = q
    mujoco.mj_forward(scene.model, data)
    expected = pinch.hand_pose.matrix @ pincer.link_poses(q)
    for link, body in enumerate(scene.link_bodies):
        np.testing.assert_allclose(body_pose(data, body), expected[link], atol=1e-12)


def test_drives_of_the_model_are_replaced(pincer: Hand, ball: GraspObject, pinch: GraspSolution) -> None:
    limited = replace(pincer, joints=(replace(pincer.joints[0], effort=0.3), *pincer.joints[1:]))
    model = build_scene(limited, ball, pinch.hand_pose, np.zeros(3)).model
    assert (model.nu, model.neq, model.nsensor) == (3, 0, 0)
    np.testing.assert_array_equal(model.opt.gravity, 0.0)
    assert not model.dof_frictionloss.any()
    assert not model.jnt_stiffness.any()
    np.testing.assert_array_equal(model.actuator_forcerange[0], [-0.3, 0.3])
    assert model.actuator_forcelimited.tolist() == [1, 0, 0]


def test_allowed_pairs_do_not_collide(pincer: Hand, ball: GraspObject, pinch: GraspSolution) -> None:
    import mujoco

    far = ball.posed(Pose([5.0, 0.0, 0.0]))
    overlapping = replace(pincer, spec_xml=pincer.spec_xml.replace('pos="0 0 -0.015"', 'pos="0 0 0"'))
    for pairs, expected in ((pincer.allowed_pairs, 0), ((), 2)):
        scene = build_scene(replace(overlapping, allowed_pairs=pairs), far, pinch.hand_pose, np.zeros(3))
        data = mujoco.MjData(scene.model)
        mujoco.mj_forward(scene.model, data)
        touching = {tuple(sorted(c.geom)) for c in data.contact}
        assert len(touching) == expected


@pytest.mark.parametrize(
    ("kind", "size", "gap"),
    [
        (ShapeKind.SPHERE, (0.02, 0, 0), 0.028),
        (ShapeKind.CAPSULE, (0.01, 0.02, 0), 0.018),
        (ShapeKind.CYLINDER, (0.03, 0.04, 0), 0.008),
        (ShapeKind.BOX, (0.03, 0.03, 0.01), 0.038),
        (ShapeKind.ELLIPSOID, (0.01, 0.01, 0.03), 0.018),
    ],
)
def test_primitives_are_themselves(
    pincer: Hand, pinch: GraspSolution, kind: ShapeKind, size: tuple[float, float, float], gap: float
) -> None:
    """The shape stands 0.048 m above a thumb that lies flat, so the gap is what its height leaves."""
    import mujoco

    obj = GraspObject("o", (Body("o", (Shape(kind, size),)),), pose=Pose([0.0, 0.0, 0.056]))
    scene = build_scene(pincer, obj, Pose.identity(), np.array([np.pi / 2, 0.0, 0.0]))
    data = mujoco.MjData(scene.model)
    data.qpos[scene.qpos] = [np.pi / 2, -1.0, 0.0]
    mujoco.mj_forward(scene.model, data)
    distance, _ = nearest(scene, data, 1, np.inf)
    assert distance == pytest.approx(gap, abs=2e-6)
    assert scene.approximated == ()


def test_meshes_become_convex_pieces(pincer: Hand, pinch: GraspSolution, own_cache: Path) -> None:
    convex = build_scene(pincer, mesh_object(scaled(BOX, (0.02, 0.02, 0.02))), pinch.hand_pose, np.zeros(3))
    assert (len(convex.object_geoms), convex.approximated) == (1, ())
    assert not own_cache.exists()
    bent = build_scene(pincer, mesh_object(angle_table()), pinch.hand_pose, np.zeros(3))
    assert len(bent.object_geoms) >= 2
    assert bent.approximated == ("part",)
    (file,) = own_cache.rglob("*.npz")
    with np.load(file) as kept:
        volume = sum(np.prod(np.ptp(kept[name], axis=0)) for name in kept.files)
    assert volume == pytest.approx(0.1 * 0.1 * 0.02 + 0.02 * 0.1 * 0.1, rel=0.15)
    hull = mesh_object(angle_table(), collision_source=CollisionSource.ENGINE)
    assert len(build_scene(pincer, hull, pinch.hand_pose, np.zeros(3)).object_geoms) == 1
    given = replace(
        mesh_object(angle_table()), bodies=(replace(mesh_object(angle_table()).bodies[0], pieces=(BOX, BOX, BOX)),)
    )
    assert len(build_scene(pincer, given, pinch.hand_pose, np.zeros(3)).object_geoms) == 3


def quick_decomposition(calls: list[int]):
    """Stand in for CoACD, which takes seconds: the two boxes of the L."""

    def run(*_: object) -> tuple[np.ndarray, ...]:
        calls.append(1)
        return angle_table().vertices[:8], angle_table().vertices[8:]

    return run


def test_pieces_come_from_the_cache_unless_it_is_damaged(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[int] = []
    monkeypatch.setattr(convex_pieces_module, "decompose", quick_decomposition(calls))
    mesh = angle_table()
    pieces = convex_pieces(mesh, "part")
    again = convex_pieces(mesh, "part")
    assert calls == [1]
    assert len(pieces) == 2
    assert all(np.array_equal(a, b) for a, b in zip(pieces, again, strict=True))
    (file,) = own_cache.rglob("*.npz")
    for damage in (b"", file.read_bytes()[:200], b"PK\x03\x04 nonsense"):
        file.write_bytes(damage)
        calls.clear()
        assert len(convex_pieces(mesh, "part")) == len(pieces)
        assert calls == [1]
    convex_pieces(TriangleMesh(mesh.vertices * 2.0, mesh.triangles), "part")
    assert len(calls) == 2


def test_a_cache_that_cannot_be_written_costs_nothing_but_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(convex_pieces_module, "decompose", quick_decomposition([]))
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("CLENCH_CACHE_DIR", str(tmp_path / "file"))
    assert len(convex_pieces(angle_table(), "part")) == 2


def test_what_cannot_be_simulated(pincer: Hand, ball: GraspObject, pinch: GraspSolution) -> None:
    flat = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [1, 3, 2]])
    with pytest.raises(ObjectError, match="Body 'part' is flat"):
        build_scene(pincer, mesh_object(flat), pinch.hand_pose, np.zeros(3))
    with pytest.raises(HandError, match="Hand 'pincer' has no model that can be simulated"):
        build_scene(replace(pincer, spec_xml=""), ball, pinch.hand_pose, np.zeros(3))
    joints = (*pincer.joints[:2], replace(pincer.joints[2], name="extra"))
    with pytest.raises(HandError, match="Joint 'extra' of hand 'pincer' is missing"):
        build_scene(replace(pincer, joints=joints), ball, pinch.hand_pose, np.zeros(3))
    links = (replace(pincer.links[0], name="nowhere"), *pincer.links[1:])
    with pytest.raises(HandError, match="Palm 'nowhere' of hand 'pincer' is missing"):
        build_scene(replace(pincer, links=links), ball, pinch.hand_pose, np.zeros(3))
