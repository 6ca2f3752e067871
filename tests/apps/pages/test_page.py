"""Pages: everything is in one file, every number is in it, and no text from a file becomes HTML."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clench
from clench.apps.cli.commands.demo import MUG_POSE
from clench.apps.cli.main import main
from clench.apps.pages.packed_scene import Motion, packed_motion, packed_solid
from clench.apps.pages.page import hand_page_html, page_html
from clench.core.exceptions import CommandError, FileError
from clench.models.appearance import Solid, SolidKind
from clench.models.mesh import TriangleMesh
from clench.solver.solution import GraspSolution
from mug_grasp import MugGrasp

EVIL = "</script><script>document.title='broken'</script><img src=x onerror=alert(1)>&\u2028$title"


@pytest.fixture(scope="module")
def hand(mug_grasp: MugGrasp) -> clench.Hand:
    return mug_grasp.hand


@pytest.fixture(scope="module")
def mug(mug_grasp: MugGrasp) -> clench.GraspObject:
    return mug_grasp.mug


@pytest.fixture(scope="module")
def solution(mug_grasp: MugGrasp) -> GraspSolution:
    return clench.complete(mug_grasp.solution, mug_grasp.hand, mug_grasp.mug)


@pytest.fixture(scope="module")
def page(hand: clench.Hand, mug: clench.GraspObject, solution: GraspSolution) -> str:
    return page_html(hand, mug, solution)


def scene_of(page: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(re.search(r'id="scene">(.*?)</script>', page, re.DOTALL)[1])  # type: ignore[index]
    return found


class Reader(HTMLParser):
    """Collect the tags, the rows of tables and the words of a page, as a browser would read them."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.words: list[str] = []
        self.silent = 0
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs
        self.silent += tag in ("script", "style")

    def handle_endtag(self, tag: str) -> None:
        self.silent -= tag in ("script", "style")

    def handle_data(self, data: str) -> None:
        if not self.silent:
            self.words.append(data)


def test_status_reason_certificate_and_every_contact_are_in_the_page(page: str, solution: GraspSolution) -> None:
    said = " ".join(Reader(page).words)
    assert solution.reason["text"] in said
    assert solution.certificate is not None
    assert solution.certificate["text"] in said
    assert "✓ certified" in said
    assert f"{solution.quality['epsilon']:.4f}" in said  # type: ignore[index]
    for c in solution.contacts:
        assert f"{c.gap:.1e}" in said
        assert ", ".join(f"{1e3 * x:.1f}" for x in c.position) in said
    for name, angle in solution.joint_angles.items():
        assert name in said
        assert f"{np.rad2deg(angle):.2f}" in said
    assert page.count("<tr data-contact=") == len(solution.contacts)


def test_a_page_asks_for_nothing_and_is_small(page: str) -> None:
    assert len(page) < 1_000_000
    reader = Reader(page)
    assert not [v for k, v in reader.attributes if k in ("src", "href", "srcset", "action")]
    assert "link" not in reader.tags
    style, script = (re.search(rf"<{t}>(.*?)</{t}>", page, re.DOTALL)[1] for t in ("style", "script"))  # type: ignore[index]
    assert "url(" not in style
    assert "@import" not in style
    for word in ("fetch", "XMLHttpRequest", "WebSocket", "import(", "eval", "innerHTML", "http"):
        assert word not in script


def test_meshes_and_poses_come_back_as_they_were(page: str, hand: clench.Hand, solution: GraspSolution) -> None:
    scene = scene_of(page)
    assert {s["name"] for s in scene["solids"]} >= {"palm", "thumb_distal", "mug"}
    (grasp,) = scene["grasps"]
    assert len(grasp["tracks"]) == len(scene["solids"])
    k = next(k for k, s in enumerate(scene["solids"]) if s["name"] == "thumb_distal")
    track = np.frombuffer(base64.b64decode(grasp["tracks"][k]), "<f4").reshape(-1, 7)
    q = np.array([solution.joint_angles[name] for name in hand.joint_names])
    expected = solution.hand_pose.matrix @ hand.link_poses(q)[hand.link_index("thumb_distal")]
    np.testing.assert_allclose(clench.Pose(track[-1, :3], wxyz=track[-1, 3:]).matrix, expected, atol=1e-5)
    assert len(track) > 50
    assert np.abs(np.diff(track, axis=0)).max() < 0.1
    mug = next(s for s in scene["solids"] if s["kind"] == "object")
    corners = np.frombuffer(base64.b64decode(mug["vertices"]), "<u2").reshape(-1, 3) * mug["step"] + mug["low"]
    whole = clench.GraspObject.load("mug").bodies[0].shapes[0].to_mesh().vertices
    np.testing.assert_allclose(corners.min(axis=0), whole.min(axis=0), atol=1e-5)
    np.testing.assert_allclose(corners.max(axis=0), whole.max(axis=0), atol=1e-5)


def test_a_large_mesh_and_an_empty_one() -> None:
    rng = np.random.default_rng(0)
    many = TriangleMesh(rng.uniform(size=(80_000, 3)), np.arange(79_998).reshape(-1, 3))
    packed = packed_solid(Solid(SolidKind.OBJECT, "many", 0, "#ffffff", many))
    assert packed["wide"]
    indices = np.frombuffer(base64.b64decode(packed["triangles"]), "<u4")
    assert indices.max() > 65_535
    assert (
        packed_solid(Solid(SolidKind.OBJECT, "none", 0, "#ffffff", TriangleMesh(np.empty((0, 3)), [])))["vertices"]
        == ""
    )


def test_quaternions_of_a_track_stay_on_one_side() -> None:
    turns = np.linspace(0.0, 3.5 * np.pi, 40)
    poses = np.array([clench.Pose(rpy=[0.0, 0.0, t]).matrix for t in turns])[:, None]
    track = np.frombuffer(base64.b64decode(packed_motion(Motion(poses, 1.0))[0]), "<f4").reshape(-1, 7)
    assert ((track[1:, 3:] * track[:-1, 3:]).sum(axis=1) > 0.9).all()
    still = packed_motion(Motion(np.tile(np.eye(4), (5, 1, 1, 1)), 1.0))
    assert len(base64.b64decode(still[0])) == 28


def test_names_from_files_do_no_harm(hand: clench.Hand, mug: clench.GraspObject, solution: GraspSolution) -> None:
    bad = replace(solution.contacts[0], link=EVIL, finger=EVIL)
    fingers = {EVIL: replace(solution.fingers["thumb"], name=EVIL, reason=EVIL)}
    evil = replace(
        solution, hand=EVIL, object=EVIL, contacts=(bad,), reason={"code": "x", "text": EVIL}, fingers=fingers
    )
    links = tuple(replace(link, name=EVIL) if i == hand.palm else link for i, link in enumerate(hand.links))
    page = page_html(replace(hand, links=links), mug, evil)
    reader = Reader(page)
    assert reader.tags.count("script") == 2
    assert "img" not in reader.tags
    assert not [k for k, _ in reader.attributes if k.startswith("on")]
    assert page.count("onerror=alert(1)&gt;") >= 5, "the text is there, escaped"
    assert EVIL.replace("\u2028", "\\u2028") in {s["name"] for s in scene_of(page)["solids"]}
    assert "\u2028" not in page


def test_a_plan_has_an_article_for_every_grasp(hand: clench.Hand) -> None:
    ball = clench.GraspObject.load("ball")
    plan = clench.plan_grasps(hand, ball, 3, effort=16, most=64, path=False)
    page = page_html(hand, ball, plan)
    assert page.count("<article") == len(plan)
    assert page.count("<article hidden") == len(plan) - 1
    assert plan.text in page
    scene = scene_of(page)
    assert [g["caption"] for g in scene["grasps"]] == [f"epsilon {grasp.epsilon:.3f}" for grasp in plan]
    for view in (g["view"] for g in scene["grasps"]):
        assert view["towards"][2] > 0.0
        assert np.linalg.norm(view["towards"]) == pytest.approx(1.0)
    with pytest.raises(CommandError, match="expected at least one grasp to show"):
        page_html(hand, ball, replace(plan, grasps=()))


def test_a_solution_without_contact_and_a_hand_alone_have_pages(hand: clench.Hand) -> None:
    ball = clench.GraspObject.load("ball")
    far = clench.solve(
        hand, ball, clench.GraspCommand(hand_pose=clench.Pose([1.0, 0.0, 0.0]), preshape="open", planes=1)
    )
    page = page_html(hand, ball, far)
    assert "No link touches." in page
    assert "no contact" in page
    alone = hand_page_html(hand)
    assert "thumb_distal" in alone
    assert {s["kind"] for s in scene_of(alone)["solids"]} == {"hand"}
    track = scene_of(alone)["grasps"][0]["tracks"]
    assert max(len(t) for t in track) > 1000


def test_the_command_writes_the_page_and_refuses_other_endings(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--count", "1", "--effort", "16", "--most", "64", "--without-path"]
    file = tmp_path / "grasps.html"
    assert main(["plan", "--hand", "robonaut2", "--object", "ball", *options, "--html", str(file)]) == 0
    assert "grasps.html" in capsys.readouterr().out
    assert file.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    for command in (["plan", "--hand", "robonaut2", "--object", "ball"], ["demo", "--out", str(tmp_path / "new")]):
        assert main([*command, "--html", str(tmp_path / "page.txt")]) == 2
        assert "page.txt: expected a file name that ends with .html." in capsys.readouterr().err
        assert main([*command, "--html", str(tmp_path / "none" / "page.html")]) == 2
        assert "cannot be written" in capsys.readouterr().err
    assert not (tmp_path / "new").exists()
    with pytest.raises(FileError, match="cannot be written"):
        clench.write_page(tmp_path / "none" / "a.html", None, None, None)  # type: ignore[arg-type]


def test_solve_writes_a_page_into_the_folder_that_it_makes(tmp_path: Path) -> None:
    command = tmp_path / "command.json"
    pose = {"position": MUG_POSE.position.tolist(), "wxyz": MUG_POSE.wxyz.tolist()}
    command.write_text(json.dumps({"hand_pose": pose, "preshape": "open", "planes": 1, "fingers": ["thumb", "index"]}))
    page = tmp_path / "out" / "grasp.html"
    options = ["--hand", "robonaut2", "--object", "mug", "--command", str(command), "--out", str(page.parent)]
    assert main(["solve", *options, "--html", str(page)]) == 0
    assert "takes" in page.read_text(encoding="utf-8")
