"""Pictures of plans: every file is written and is the same twice, and what they show lies where the grasps are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import clench
from chain_hands import one_link
from clench.apps.cli.main import main
from clench.apps.figures import draw_plan
from clench.apps.figures.drawing.camera import fitted_camera
from clench.apps.figures.drawing.stage import Stage, solution_poses, solution_solids
from clench.apps.figures.drawing.viewpoints import focus_of, viewpoints
from clench.apps.figures.maps.contact_map import (
    _heat,
    _normals,
    _photographs,
    _sides,
    _Touches,
    _visible,
    draw_contacts,
)
from clench.apps.figures.maps.zone_map import _best, _ends, draw_zones
from clench.apps.figures.sheets import grasp_sheet
from clench.apps.figures.sheets.grasp_sheet import MOST_GRASPS, draw_grasps
from clench.core.exceptions import FileError
from clench.models.appearance import SolidKind, carried_by_palm
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.objects.obstacles import table
from clench.planner.grasp_plan import GraspPlan
from clench.solver.preshapes.preshapes import opposition_zones

GREEN, ORANGE = [0x0B, 0x7A, 0x53], [0xD5, 0x5E, 0x00]


@pytest.fixture(scope="module")
def hand() -> Hand:
    return clench.Hand.load("robonaut2")


@pytest.fixture(scope="module")
def ball() -> GraspObject:
    return clench.GraspObject.load("ball")


@pytest.fixture(scope="module")
def plan(hand: Hand, ball: GraspObject) -> GraspPlan:
    return clench.plan_grasps(hand, ball, 3, effort=16, most=64, path=False)


def picture(path: Path) -> np.ndarray:
    from PIL import Image

    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def like(image: np.ndarray, color: list[int]) -> int:
    return int((np.abs(image - color).sum(axis=2) < 60).sum())


def panels(monkeypatch: pytest.MonkeyPatch, plan: GraspPlan, hand: Hand, ball: GraspObject, path: Path) -> list[str]:
    """Return the captions of the panels of a sheet."""
    captions: list[str] = []
    written = grasp_sheet._caption

    def note(axes, number, grasp, held) -> None:
        captions.append(f"{number} {grasp.kind} {held}")
        written(axes, number, grasp, held)

    monkeypatch.setattr(grasp_sheet, "_caption", note)
    draw_grasps(plan, hand, ball, path, [True] * len(plan))
    return captions


@pytest.mark.long
def test_a_plan_has_three_pictures_that_are_the_same_twice(plan, hand, ball, tmp_path) -> None:
    (tmp_path / "again").mkdir()
    files = draw_plan(plan, hand, ball, tmp_path)
    assert [file.name for file in files] == ["grasps.png", "contacts.png", "zones.png"]
    for file, again in zip(files, draw_plan(plan, hand, ball, tmp_path / "again"), strict=True):
        assert file.read_bytes() == again.read_bytes()


def test_every_grasp_has_a_panel_with_its_kind(monkeypatch, plan, hand, ball, tmp_path) -> None:
    captions = panels(monkeypatch, plan, hand, ball, tmp_path / "grasps.png")
    assert captions == [f"{k} {grasp.kind} True" for k, grasp in enumerate(plan, start=1)]


def test_a_sheet_has_the_best_grasps_of_many(monkeypatch, plan, hand, ball, tmp_path) -> None:
    many = replace(plan, grasps=tuple(plan[k % len(plan)] for k in range(MOST_GRASPS + 3)))
    drawn = grasp_sheet._photographs(hand, ball, list(plan)[:1])
    monkeypatch.setattr(grasp_sheet, "_photographs", lambda _hand, _obj, grasps: drawn * len(grasps))
    assert len(panels(monkeypatch, many, hand, ball, tmp_path / "grasps.png")) == MOST_GRASPS


def test_held_is_green_and_dropped_is_not(plan, hand, ball, tmp_path) -> None:
    held = picture(draw_grasps(plan, hand, ball, tmp_path / "held.png", [True] * len(plan)))
    dropped = picture(draw_grasps(plan, hand, ball, tmp_path / "dropped.png", [False] * len(plan)))
    assert like(held, GREEN) > like(dropped, GREEN)
    assert like(held, ORANGE) < like(dropped, ORANGE)


def test_without_grasps_the_sheet_says_why(plan, hand, ball, tmp_path) -> None:
    none = replace(plan, grasps=(), rejected={"no opposition": 60})
    files = draw_plan(none, hand, ball, tmp_path)
    assert like(picture(files[0]), GREEN) > 100
    assert like(picture(files[1]), ORANGE) == 0


def test_no_grasp_is_seen_from_under_a_table(hand, ball) -> None:
    scene = ball.with_body(table(-0.03))
    found = clench.plan_grasps(hand, scene, 2, effort=32, most=128, path=False)
    for grasp in found:
        with Stage.of(hand, scene, grasp.solution) as stage:
            points = np.array([c.position for c in grasp.solution.contacts])
            assert min(d[2] for d in viewpoints(stage, focus_of(stage), points, 3)) > 0.1


def test_the_sheet_leaves_out_what_carries_the_palm(plan, hand, ball) -> None:
    """Were a finger's first link the palm, the rest of that finger would stay, and nothing else."""
    finger = hand.fingers[1]
    arm = SimpleNamespace(links=hand.links, palm=finger.links[0])
    kept = np.flatnonzero(carried_by_palm(arm)).tolist()
    assert kept == sorted(finger.links)
    solids = solution_solids(hand, ball, plan[0].solution)
    solids = [replace(s, kind=SolidKind.FOREARM) if s.index == hand.palm and s.of_hand else s for s in solids]
    with Stage(solids, solution_poses(hand, solids, plan[0].solution)) as stage:
        camera = fitted_camera(np.array([1.0, 0.3, 0.4]), stage.points(*SolidKind), (60, 60))
        seen = set(np.unique(stage.sight(camera, without=(SolidKind.FOREARM,)).solid)) - {-1}
        assert {stage.solids[k].kind for k in seen} == {SolidKind.HAND, SolidKind.OBJECT}
        more = set(np.unique(stage.sight(camera).solid)) - {-1}
        assert SolidKind.FOREARM in {stage.solids[k].kind for k in more}


def test_the_heat_is_the_share_of_grasps_that_touch_there(ball) -> None:
    """Two of four grasps touch the ball's top, so it is half warm there, and cold at the bottom."""
    cameras, pictures = _photographs(ball)
    top = ball.pose.matrix[:3, 3] + [0.0, 0.0, np.ptp(ball.bodies[0].shapes[0].to_mesh().vertices[:, 2]) / 2]
    touch = _Touches(top[None], np.array([[0.0, 0.0, 1.0]]), np.array([False]))
    nothing = _Touches(np.empty((0, 3)), np.empty((0, 3)), np.empty(0, dtype=bool))
    heats = [_heat(p, c, [touch, touch, nothing, nothing]) for p, c in zip(pictures, cameras, strict=True)]
    column, row = cameras[0].project(top)[:2].astype(int)
    assert heats[0][row, column] == pytest.approx(0.5, abs=0.01)
    assert heats[0].max() <= 0.5
    for camera, heat in zip(cameras[3:], heats[3:], strict=True):
        assert camera.towards[2] < 0.0
        column, row = camera.project(2.0 * ball.pose.matrix[:3, 3] - top)[:2].astype(int)
        assert heat[row - 40 : row + 40, column - 40 : column + 40].max() == 0.0


@pytest.mark.parametrize("thickness", [0.0005, 0.001, 0.004])
def test_a_contact_behind_a_wall_is_not_marked_however_thin_the_wall_is(thickness: float) -> None:
    wall = GraspObject.load(f"box:x={thickness},y=0.08,z=0.08")
    middle = wall.pose.matrix[:3, 3]
    side = np.array([0.5 * thickness, 0.0, 0.0])
    places = np.array([middle + side, middle - side])
    touches = _Touches(places, np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]), np.array([False, True]))
    cameras, pictures = _photographs(wall)
    seen = [_visible(touches, p, c).tolist() for p, c in zip(pictures, cameras, strict=True)]
    assert seen == [[camera.towards[0] > 0.0, camera.towards[0] < 0.0] for camera in cameras]


def test_normals_of_what_is_seen_are_those_of_a_ball() -> None:
    cameras, pictures = _photographs(GraspObject.load("sphere:r=0.03"))
    row, column = np.nonzero(pictures[0].solid >= 0)
    at = (np.column_stack([column, row]) + 0.5 - 400.0) / cameras[0].scale
    inner = np.linalg.norm(at, axis=1) < 0.024
    normals = _normals(pictures[0], cameras[0])[row[inner], column[inner]]
    across = np.outer(at[inner, 0], cameras[0].right) - np.outer(at[inner, 1], cameras[0].up)
    depth = np.sqrt(0.03**2 - (at[inner] ** 2).sum(axis=1))
    expected = (across + np.outer(depth, cameras[0].towards)) / 0.03
    assert np.median((normals * expected).sum(axis=1)) > 0.999


def test_the_six_sides_show_every_axis_apart() -> None:
    sides = _sides()
    assert np.linalg.norm(sides, axis=1) == pytest.approx(np.ones(6))
    assert np.abs(sides[:, :2]).min() > 0.2
    assert np.sign(sides[:, 2]).tolist() == [1, 1, 1, -1, -1, -1]


def test_zones_end_at_the_pads(hand) -> None:
    shape = opposition_zones(hand)[1]
    zones = np.array(list(_best(shape)))
    ends = _ends(zones)
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) == pytest.approx(zones[:, 6])
    assert len(np.unique(np.round(zones[:, 6], 9))) == len(zones)
    assert zones[:, 6].min() >= shape.aperture.min()


def test_a_hand_without_zones_is_drawn_too(tmp_path) -> None:
    assert picture(draw_zones(one_link(), tmp_path / "zones.png")).min() < 100


@pytest.mark.parametrize("draw", ["grasps", "contacts", "zones"])
def test_files_that_cannot_be_written(draw, plan, hand, ball, tmp_path) -> None:
    def write(path: Path) -> Path:
        if draw == "zones":
            return draw_zones(hand, path)
        return {"grasps": draw_grasps, "contacts": draw_contacts}[draw](plan, hand, ball, path)

    with pytest.raises(FileError, match=r"no figure has the ending '\.txt'; expected \.png"):
        write(tmp_path / "picture.txt")
    with pytest.raises(FileError, match="no folder"):
        write(tmp_path / "nowhere" / "picture.png")
    assert not list(tmp_path.iterdir())


def test_the_command_writes_the_pictures(tmp_path, capsys) -> None:
    options = ["--count", "1", "--effort", "16", "--most", "64", "--without-path", "--out", str(tmp_path / "out")]
    assert main(["plan", "--hand", "robonaut2", "--object", "ball", *options]) == 0
    said = capsys.readouterr().out
    for name in ("grasps.png", "contacts.png", "zones.png"):
        assert name in said
        assert (tmp_path / "out" / name).stat().st_size > 1000
