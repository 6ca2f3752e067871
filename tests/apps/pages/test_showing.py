"""Cards and pages in notebooks: for every kind of object, without OpenGL, and without a notebook."""

from __future__ import annotations

import base64
import io
import re
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import clench
from clench.apps.figures.drawing import stage as stages
from clench.core.exceptions import CommandError
from clench.core.rendering.opengl import OpenGLError
from clench.models import recent_scenes
from clench.models.objects.obstacles import table
from clench.planner.grasp_plan import GraspPlan
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
def plan(hand: clench.Hand) -> GraspPlan:
    return clench.plan_grasps(hand, clench.GraspObject.load("ball"), 4, effort=16, most=64, path=False)


def pictures(card: str) -> list[np.ndarray]:
    """Return the pictures of a card: red, green, blue and opacity, shape (H, W, 4)."""
    from PIL import Image

    found = re.findall(r"data:image/png;base64,([^\"]*)", card)
    return [np.asarray(Image.open(io.BytesIO(base64.b64decode(data)))) for data in found]


def test_a_solution_shows_itself_with_its_contacts(solution: GraspSolution) -> None:
    card = solution._repr_html_()
    assert card is not None
    for words in ("robonaut2 on mug", solution.reason["text"], "thumb_distal", ">grasp<"):
        assert words in card
    assert f"{len(solution.contacts)} contacts" in card
    (picture,) = pictures(card)
    opaque = picture[..., 3] > 128
    assert 0.1 < opaque.mean() < 0.9, "the ground is the notebook's"
    assert (np.abs(picture[..., :3].astype(int) - [0xD5, 0x5E, 0x00]).sum(axis=2) < 40).sum() > 20, (
        "contacts are marked"
    )


def test_hands_and_plans_show_themselves(hand: clench.Hand, plan: GraspPlan) -> None:
    card = hand._repr_html_()
    assert card is not None
    assert "thumb (4), index (4)" in card
    assert len(pictures(card)) == 1
    card = plan._repr_html_()
    assert card is not None
    assert plan.text in card
    assert len(pictures(card)) == min(len(plan), 3)
    one = plan[0]._repr_html_()
    assert one is not None
    assert f"epsilon {plan[0].epsilon:.3f}" in one
    assert len(pictures(one)) == 1
    assert pictures(str(replace(plan, grasps=())._repr_html_())) == []


def test_without_opengl_there_is_a_picture_and_no_warning(
    hand: clench.Hand, solution: GraspSolution, monkeypatch: pytest.MonkeyPatch, recwarn: pytest.WarningsRecorder
) -> None:
    def refuse(*_: object) -> None:
        raise OpenGLError("a test says so")

    monkeypatch.setattr(stages, "Offscreen", refuse)
    for value in (hand, solution):
        (picture,) = pictures(str(value._repr_html_()))
        assert 0.1 < (picture[..., 3] > 128).mean() < 0.9
    assert not recwarn.list


def test_a_table_is_known_after_a_solve_and_a_saved_solution_loads_its_models(
    hand: clench.Hand,
    mug: clench.GraspObject,
    solution: GraspSolution,
    monkeypatch: pytest.MonkeyPatch,
    mug_grasp: MugGrasp,
) -> None:
    beside = clench.solve(hand, mug.with_body(table(-0.01)), mug_grasp.command)
    assert len(pictures(str(beside._repr_html_()))) == 1
    monkeypatch.setattr(recent_scenes, "_scenes", type(recent_scenes._scenes)())
    assert len(pictures(str(solution._repr_html_()))) == 1
    card = str(beside._repr_html_())
    assert pictures(card) == []
    assert "no picture: hand and object are not known here" in card
    with pytest.raises(CommandError, match=r"expected show\(hand, object\)"):
        beside.show()


def test_only_the_latest_scenes_are_kept(hand: clench.Hand, mug: clench.GraspObject, monkeypatch: Any) -> None:
    monkeypatch.setattr(recent_scenes, "_scenes", type(recent_scenes._scenes)())
    for k in range(9):
        recent_scenes.remember_scene(f"{k}", hand, mug)
    assert recent_scenes.recent_scene("8") == (hand, mug)
    assert recent_scenes.recent_scene("0") is None
    assert len(recent_scenes._scenes) < 9


def test_a_script_opens_the_page_in_the_browser(
    solution: GraspSolution, hand: clench.Hand, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or len(opened) < 3)
    for shown in (solution.show(), hand.show(), hand.show()):
        assert shown is not None
        assert opened[0].startswith("file:")
        assert shown.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert [Path(address).name for address in opened] == ["page.html"] * 3
    assert capsys.readouterr().err.count("no browser was found; open ") == 1


def test_a_notebook_gets_the_page_as_output(plan: GraspPlan, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[str] = []
    display = SimpleNamespace(HTML=str, display=shown.append)
    notebook = SimpleNamespace(get_ipython=lambda: SimpleNamespace(kernel=object()), display=display)
    monkeypatch.setitem(sys.modules, "IPython", notebook)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    assert plan.show() is None
    frames: list[dict[str, str | None]] = []

    class Reader(HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            frames.append({"tag": tag, **dict(attrs)})

    Reader().feed(shown[0])
    (frame,) = frames
    assert frame["tag"] == "iframe"
    assert str(frame["srcdoc"]).count("<article") == len(plan)


def test_a_terminal_of_ipython_is_no_notebook(hand: clench.Hand, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: SimpleNamespace()))
    monkeypatch.setattr("webbrowser.open", lambda _: True)
    assert hand.show() is not None


def test_names_from_files_do_no_harm_in_cards(solution: GraspSolution, hand: clench.Hand) -> None:
    name = "<script>alert(1)</script>"
    contact = replace(solution.contacts[0], link=name)
    evil = replace(solution, hand=name, object=name, reason={"code": "x", "text": name}, contacts=(contact,))
    for card in (evil._repr_html_(), replace(hand, name=name)._repr_html_()):
        assert "<script" not in str(card)
        assert "&lt;script&gt;" in str(card)


def test_a_plan_without_grasps_cannot_be_shown(plan: GraspPlan) -> None:
    with pytest.raises(CommandError, match="expected at least one grasp to show"):
        replace(plan, grasps=()).show()
