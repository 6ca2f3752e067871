"""The page in a real browser: drag, set, see."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import SIZE, Tab, chromium, needs_chromium, opened

import clench
from clench.apps.viewer.opening import Given, open_session

pytestmark = needs_chromium


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as started:
        yield started


@pytest.fixture(scope="module")
def tab(browser: Any) -> Iterator[Tab]:
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    with opened(browser, open_session(Given(hand, mug, None, {}, None, 0.1, {"seed": 0}))) as made:
        yield made


def object_at(tab: Tab) -> np.ndarray:
    pose = tab.session.state.command.object_pose
    assert pose is not None
    return pose.position


def test_the_card_says_what_the_solution_says(tab: Tab) -> None:
    settled = tab.session.settled
    assert settled is not None
    card = tab.card()
    assert settled.solution.reason["text"] in card
    assert f"{settled.quality.epsilon.radius:.3f}" in card


def test_dragging_the_gizmo_moves_the_object_and_the_hand_follows(tab: Tab) -> None:
    before, answer, card = object_at(tab), tab.session.answer, tab.card()
    assert answer is not None
    length = tab.open.page.nodes.object_gizmo.scale
    tab.drag(tab.pixel(before + np.array([0.0, 0.0, 0.97 * length])), (0.0, -40.0))
    tab.until(lambda: object_at(tab)[2] > before[2] + 5e-3)
    moved = object_at(tab) - before
    assert abs(moved[:2]).max() < 1e-6, "the arrow moves along z alone"
    after = tab.session.answer
    assert after is not None
    assert after.joint_angles.tolist() != answer.joint_angles.tolist()
    assert len(after.positions) != len(answer.positions) or not np.allclose(after.positions, answer.positions)
    tab.wait_for("rest")
    assert tab.card() != card


def test_undo_puts_the_object_back(tab: Tab) -> None:
    before = object_at(tab)
    assert before[2] > 0.0
    tab.page.get_by_text("Undo", exact=True).click()
    tab.until(lambda: not object_at(tab).any())


def test_the_friction_slider_changes_the_margin(tab: Tab) -> None:
    before = tab.session.settled
    assert before is not None
    thumb = tab.page.get_by_role("slider").first
    thumb.focus()
    for _ in range(6):
        thumb.press("ArrowLeft")
    tab.until(lambda: tab.session.state.friction == pytest.approx(0.3))
    after = tab.session.settled
    assert after is not None
    assert after.quality.epsilon.radius < before.quality.epsilon.radius


def test_an_error_in_a_solve_is_said_and_the_page_goes_on(tab: Tab) -> None:
    good = tab.session.state
    tab.session.change(lambda state: state.with_angle("no such joint", 1.0))
    tab.wait_for("failed")
    assert "no such joint" in tab.card()
    tab.session.change(lambda _: good)
    tab.wait_for("rest")
    assert "no such joint" not in tab.card()


@pytest.mark.long
def test_two_tabs_show_the_same_and_one_may_be_closed(tab: Tab, browser: Any) -> None:
    other = browser.new_page(viewport=SIZE)
    other.goto(tab.open.url)
    other.wait_for_selector("[data-clench=rest]", timeout=60_000)
    assert len(tab.open.server.get_clients()) == 2
    assert other.locator("[data-clench]").inner_text() == tab.card()
    other.close()
    tab.until(lambda: len(tab.open.server.get_clients()) == 1)
    before = tab.card()
    pose = clench.Pose(object_at(tab) + np.array([0.0, 0.0, 0.004]))
    tab.session.change(lambda state: state.moved(object_pose=pose))
    tab.page.wait_for_function("text => document.querySelector('[data-clench=rest]')?.innerText !== text", arg=before)


def test_play_moves_the_hand_and_reset_brings_it_back(tab: Tab) -> None:
    tab.page.get_by_role("tab", name="Play").click()
    tab.page.get_by_text("Play", exact=True).last.click()
    tab.page.get_by_text("lift", exact=True).first.wait_for(timeout=30_000)
    player = tab.open.page.play_panel.player
    assert player.track is not None
    assert player.track.phases[-1][1] == "lift"
    assert tab.open.page.nodes.object_gizmo.position[2] > object_at(tab)[2]
    tab.page.get_by_text("Reset", exact=True).click()
    tab.until(lambda: np.allclose(tab.open.page.nodes.object_gizmo.position, object_at(tab)))


@pytest.mark.long
def test_saved_files_are_what_the_page_shows(tab: Tab, tmp_path: Path) -> None:
    from PIL import Image

    tab.page.get_by_role("tab", name="Save").click()
    for words in ("Solution (.json)", "Command (.json)", "Picture (.png)"):
        with tab.page.expect_download(timeout=60_000) as download:
            tab.page.get_by_text(words).click()
        download.value.save_as(tmp_path / download.value.suggested_filename)
    solution = clench.GraspSolution.load(tmp_path / "solution.json")
    assert tab.session.settled is not None
    assert solution.joint_angles == tab.session.settled.solution.joint_angles
    assert clench.load_command(tmp_path / "command.json") == tab.session.state.command
    picture = np.asarray(Image.open(tmp_path / "grasp.png"))
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 200


def test_dragging_a_finger_sets_its_preshape(tab: Tab) -> None:
    answer = tab.session.answer
    assert answer is not None
    hand = answer.hand
    palm = answer.state.command.hand_pose
    poses = palm.matrix @ hand.link_poses(answer.joint_angles)
    middle = np.array(tab.pixel(object_at(tab)))
    seen = []
    for link in (link for finger in hand.fingers for link in finger.links):
        for shape in hand.links[link].shapes.get(hand.default_source, ()):
            center = poses[link][:3, :3] @ shape.to_mesh().vertices.mean(axis=0) + poses[link][:3, 3]
            seen.append(tab.pixel(center))
    # The one that is farthest from the object on the screen is not behind it.
    outermost = max(seen, key=lambda pixel: float(np.linalg.norm(np.array(pixel) - middle)))
    before = tab.session.state
    tab.page.get_by_text("None", exact=True).click()
    tab.page.wait_for_timeout(300)
    tab.drag(outermost, (14.0, 10.0))
    tab.until(lambda: dict(tab.session.state.command.angles) != dict(before.command.angles))
    after = tab.session.state
    assert after.command.hand_pose == before.command.hand_pose
    assert after.command.object_pose == before.command.object_pose
