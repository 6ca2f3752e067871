"""Scene files, read back by other libraries: every link and body stands where the solution has it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clench
from clench.apps.cli.main import main
from clench.core.exceptions import CommandError, FileError
from clench.core.pose import FloatArray
from clench.execution.formats.scene_files import grasp_line, posed_scene
from clench.execution.formats.scene_glb import Y_UP
from clench.models.objects.obstacles import table
from clench.solver.solution import GraspSolution
from mug_grasp import MugGrasp


@pytest.fixture(scope="module")
def hand(mug_grasp: MugGrasp) -> clench.Hand:
    return mug_grasp.hand


@pytest.fixture(scope="module")
def mug(mug_grasp: MugGrasp) -> clench.GraspObject:
    return mug_grasp.mug


@pytest.fixture(scope="module")
def solution(mug_grasp: MugGrasp) -> GraspSolution:
    return mug_grasp.solution


@pytest.fixture(scope="module")
def pxr() -> Any:
    return pytest.importorskip("pxr", reason="needs usd-core")


def link_corners(hand: clench.Hand, solution: GraspSolution, name: str) -> FloatArray:
    """Return the corners of a link's shapes in the world, by the hand's own kinematics."""
    q = np.array([solution.joint_angles[n] for n in hand.joint_names])
    i = hand.link_index(name)
    T = solution.hand_pose.matrix @ hand.link_poses(q)[i]
    corners = np.vstack([s.to_mesh(5e-5).vertices for s in hand.links[i].shapes[hand.default_source]])
    found: FloatArray = corners @ T[:3, :3].T + T[:3, 3]
    return found


def span(points: FloatArray) -> FloatArray:
    return np.array([points.min(axis=0), points.max(axis=0)])


def test_trimesh_reads_every_link_where_it_is(
    hand: clench.Hand, mug: clench.GraspObject, solution: GraspSolution, tmp_path: Path
) -> None:
    assert solution.contacts
    import trimesh

    file = clench.formats.export_scene(tmp_path / "grasp.glb", solution, hand, mug)
    scene = trimesh.load_scene(file)
    nodes = set(scene.graph.nodes_geometry)
    solid = {f"hand/{link.name}" for link in hand.links if link.shapes[hand.default_source]}
    marks = {f"contact_{k}" for k in range(1, len(solution.contacts) + 1)}
    assert nodes == solid | {"object/mug"} | marks

    def corners(node: str) -> FloatArray:
        T, geometry = scene.graph[node]
        found: FloatArray = trimesh.transform_points(scene.geometry[geometry].vertices, Y_UP.T @ T)
        return found

    for name in ("palm", "thumb_distal", "index_medial"):
        np.testing.assert_allclose(span(corners(f"hand/{name}")), span(link_corners(hand, solution, name)), atol=1e-6)
    whole = solution.object_pose.apply(mug.bodies[0].shapes[0].to_mesh().vertices)
    np.testing.assert_allclose(span(corners("object/mug")), span(whole), atol=1e-6)
    for k, contact in enumerate(solution.contacts, start=1):
        mark = corners(f"contact_{k}")
        assert np.linalg.norm(mark - contact.position, axis=1).min() < 1.6e-3
        tip = mark[((mark - contact.position) @ contact.normal).argmax()]
        np.testing.assert_allclose(tip, contact.position + 0.015 * contact.normal, atol=1e-6)
    assert scene.metadata["status"] == solution.status.value
    assert scene.geometry["object/mug"].visual.material.alphaMode == "BLEND"


@pytest.mark.parametrize("ending", [".usda", ".usdc", ".usd"])
def test_openusd_reads_hand_object_contacts_and_grasp_line(
    hand: clench.Hand, mug: clench.GraspObject, solution: GraspSolution, tmp_path: Path, pxr: Any, ending: str
) -> None:
    from pxr import Usd, UsdGeom

    file = clench.formats.export_scene(tmp_path / f"grasp{ending}", solution, hand, mug)
    stage = Usd.Stage.Open(str(file))
    assert UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert stage.GetDefaultPrim().GetPath() == "/World"

    def in_world(path: str) -> FloatArray:
        prim = stage.GetPrimAtPath(path)
        T = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default()))
        found: FloatArray = np.array(UsdGeom.PointBased(prim).GetPointsAttr().Get()) @ T[:3, :3] + T[3, :3]
        return found

    for name in ("palm", "thumb_distal"):
        np.testing.assert_allclose(
            span(in_world(f"/World/hand/{name}/mesh")), span(link_corners(hand, solution, name)), atol=1e-6
        )
    whole = solution.object_pose.apply(mug.bodies[0].shapes[0].to_mesh().vertices)
    np.testing.assert_allclose(span(in_world("/World/object/mug/mesh")), span(whole), atol=1e-6)
    contacts = UsdGeom.Points(stage.GetPrimAtPath("/World/contacts"))
    np.testing.assert_allclose(contacts.GetPointsAttr().Get(), [c.position for c in solution.contacts], atol=1e-6)
    links = UsdGeom.PrimvarsAPI(contacts).GetPrimvar("link").Get()
    assert list(links) == [c.link for c in solution.contacts]
    curves = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.BasisCurves)]
    assert [str(prim.GetPath()) for prim in curves] == ["/World/object/grasp_identifier"]
    line = in_world("/World/object/grasp_identifier")
    assert line.shape == (2, 3)
    assert UsdGeom.BasisCurves(curves[0]).GetTypeAttr().Get() == UsdGeom.Tokens.linear
    box = span(whole)
    middle = line.mean(axis=0)
    assert ((middle > box[0]) & (middle < box[1])).all(), "the line goes through the object"


def test_names_that_usd_does_not_allow_are_told_apart(
    hand: clench.Hand, mug: clench.GraspObject, solution: GraspSolution, tmp_path: Path, pxr: Any, mug_grasp: MugGrasp
) -> None:
    from pxr import Usd

    bodies = tuple(replace(table(-0.1 * k), name=name) for k, name in enumerate(("2 b", "2 b", "grasp_identifier"), 1))
    scene = replace(mug, bodies=(*mug.bodies, *bodies))
    found = clench.solve(hand, scene, mug_grasp.command)
    stage = Usd.Stage.Open(str(clench.formats.export_scene(tmp_path / "a.usda", found, hand, scene)))
    children = stage.GetPrimAtPath("/World/object").GetChildren()
    assert [(p.GetName(), p.GetDisplayName()) for p in children] == [
        ("mug", "mug"),
        ("__b", "2 b"),
        ("__b_1", "2 b"),
        ("grasp_identifier_1", "grasp_identifier"),
        ("grasp_identifier", ""),
    ]


def test_several_grasps_are_lines_on_one_object(hand: clench.Hand, tmp_path: Path, pxr: Any) -> None:
    from pxr import Usd, UsdGeom

    ball = clench.GraspObject.load("ball")
    plan = clench.plan_grasps(hand, ball, 3, effort=16, most=64, path=False)
    solutions = [grasp.solution for grasp in plan]
    stage = Usd.Stage.Open(str(clench.formats.export_scene(tmp_path / "a.usd", solutions, hand, ball)))
    curves = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.BasisCurves)]
    assert len(curves) == len(plan) > 1
    with pytest.raises(CommandError, match=r"glb: one file holds one grasp, got \d; .* or as USD"):
        clench.formats.export_scene(tmp_path / "a.glb", solutions, hand, ball)
    moved = replace(solutions[1], object_pose=clench.Pose([1.0, 0.0, 0.0]) @ solutions[1].object_pose)
    moved = replace(
        moved, contacts=tuple(replace(c, position=c.position + np.array([1.0, 0.0, 0.0])) for c in moved.contacts)
    )
    still = posed_scene([solutions[0], solutions[1]], hand, ball).grasp_lines
    np.testing.assert_allclose(posed_scene([solutions[0], moved], hand, ball).grasp_lines, still, atol=1e-12)


def test_the_grasp_line_joins_the_thumb_and_the_others(solution: GraspSolution) -> None:
    lasting = [c for c in solution.contacts if not c.passed]
    line = grasp_line(solution, {"thumb"})
    assert line is not None
    np.testing.assert_allclose(line[0], np.mean([c.position for c in lasting if c.finger == "thumb"], axis=0))
    without = grasp_line(solution, set())
    assert without is not None
    places = [c.position.tolist() for c in lasting]
    assert without[0].tolist() in places
    assert without[1].tolist() in places
    assert grasp_line(replace(solution, contacts=()), {"thumb"}) is None
    assert grasp_line(replace(solution, contacts=lasting[:1]), {"thumb"}) is None


def test_what_cannot_be_written(
    hand: clench.Hand,
    mug: clench.GraspObject,
    solution: GraspSolution,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with pytest.raises(FileError, match=r"the ending names no scene; expected \.glb, \.usd, \.usda, \.usdc"):
        clench.formats.export_scene(tmp_path / "a.obj", solution, hand, mug)
    with pytest.raises(FileError, match="no folder"):
        clench.formats.export_scene(tmp_path / "none" / "a.glb", solution, hand, mug)
    with pytest.raises(CommandError, match="at least one grasp"):
        clench.formats.export_scene(tmp_path / "a.glb", [], hand, mug)
    with pytest.raises(CommandError, match="another geometry of object"):
        clench.formats.export_scene(tmp_path / "a.glb", solution, hand, clench.GraspObject.load("ball"))
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    with pytest.raises(
        CommandError, match=r"usd: needs usd-core: pip install 'clench\[usd\]' .*, or choose a \.glb file"
    ):
        clench.formats.export_scene(tmp_path / "a.usd", solution, hand, mug)
    assert not list(tmp_path.iterdir())


def test_the_command_writes_scenes_by_their_ending(
    hand: clench.Hand,
    mug: clench.GraspObject,
    solution: GraspSolution,
    tmp_path: Path,
    capsys: Any,
    mug_grasp: MugGrasp,
) -> None:
    solution.save(tmp_path / "solution.json")
    source = str(tmp_path / "solution.json")
    assert main(["export", source, "--out", str(tmp_path / "a.glb")]) == 0
    assert "a.glb" in capsys.readouterr().out
    assert main(["export", source, "--out", str(tmp_path / "a.GLB"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["grasps"] == 1
    assert main(["export", source, "--out", str(tmp_path / "b.glb"), "--hold"]) == 2
    assert "leave out --root, --name, --hold" in capsys.readouterr().err
    with_table = mug.with_body(table(-0.1))
    clench.solve(hand, with_table, mug_grasp.command).save(tmp_path / "on_table.json")
    assert main(["export", str(tmp_path / "on_table.json"), "--out", str(tmp_path / "c.glb")]) == 0
    assert "Written without the object" in capsys.readouterr().out
    assert {p.name for p in tmp_path.glob("*.[gG]*")} == {"a.glb", "a.GLB", "c.glb"}
