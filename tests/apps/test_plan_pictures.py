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
from clench.apps.figures import draw_plan, grasp_sheet
from clench.apps.figures.contact_map import _heat, _sides, _Touches, draw_contacts
from clench.apps.figures.grasp_sheet import MOST_GRASPS, draw_grasps
from clench.apps.figures.raster import rasterise
from clench.apps.figures.surfaces import hand_surface, placed_object, without_forearm
from clench.apps.figures.views import fitted_camera
from clench.apps.figures.zone_map import _best, _ends, draw_zones
from clench.core.errors import FileError
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
    monkeypatch.setattr(grasp_sheet, "_draw_panel", lambda *_: None)
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


def test_a_table_does_not_hide_the_grasps(hand, ball, tmp_path) -> None:
    """A table is opaque where viewpoints are chosen: no grasp is seen from below."""
    scene = ball.with_body(table(-0.03))
    found = clench.plan_grasps(hand, scene, 2, effort=32, most=128, path=False)
    for grasp in found:
        assert grasp_sheet._Scene(hand, scene, grasp.solution).towards[2] >= 0.0
    assert draw_grasps(found, hand, scene, tmp_path / "grasps.png").exists()


def test_the_sheet_leaves_out_what_carries_the_palm(plan, hand) -> None:
    """Were a finger's first link the palm, the rest of that finger would stay, and nothing else."""
    whole = hand_surface(hand, plan[0].solution)
    finger = hand.fingers[1]
    arm = SimpleNamespace(links=hand.links, palm=finger.links[0])
    kept = set(without_forearm(arm, whole).groups.tolist())
    assert kept == set(finger.links) & set(whole.groups.tolist())
    assert set(without_forearm(hand, whole).groups.tolist()) > kept


def test_the_heat_is_the_share_of_grasps_that_touch_there(hand, ball) -> None:
    """Two of four grasps touch the ball's top, so it is half warm there, and cold at the bottom."""
    surface = placed_object(ball, ball.pose.matrix)
    top = surface.corners.reshape(-1, 3)[surface.corners.reshape(-1, 3)[:, 2].argmax()]
    touch = _Touches(top[None], np.array([[0.0, 0.0, 1.0]]), np.array([False]))
    nothing = _Touches(np.empty((0, 3)), np.empty((0, 3)), np.empty(0, dtype=bool))
    heats = []
    for direction in ([0.1, 0.0, 1.0], [0.1, 0.0, -1.0]):
        camera = fitted_camera(np.array(direction), surface.corners.reshape(-1, 3), (200, 200))
        seen = rasterise(surface.corners, camera)
        heats.append(_heat(seen, surface, camera, [touch, touch, nothing, nothing]))
        if direction[2] > 0.0:
            column, row = camera.project(top)[:2].astype(int)
            assert heats[0][row, column] == pytest.approx(0.5, abs=0.01)
    assert heats[0].max() <= 0.5
    assert heats[1].max() == 0.0


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
