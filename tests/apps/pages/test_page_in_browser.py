"""Pages in a real browser, opened from disk without a network: they draw, they play, and they say what they should."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import clench
from clench.apps.pages.page import hand_page_html, page_html
from clench.solver.solution import GraspSolution

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
#: Without a screen and without a graphics card; nothing of the browser's own asks for the network.
ARGUMENTS = [
    *("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run"),
    "--disable-quic",
]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    api = pytest.importorskip("playwright.sync_api")
    if CHROMIUM is None:
        pytest.skip("no chromium here")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def hand() -> clench.Hand:
    return clench.Hand.load("robonaut2")


@pytest.fixture(scope="module")
def ball() -> clench.GraspObject:
    return clench.GraspObject.load("ball")


@pytest.fixture(scope="module")
def solution(hand: clench.Hand, ball: clench.GraspObject) -> GraspSolution:
    for pose in clench.approach_poses(hand, ball, 8, 0):
        found = clench.solve(hand, ball, clench.GraspCommand(hand_pose=pose, preshape="open", planes=1))
        if found.contacts:
            return found
    raise AssertionError("no approach pose gives a contact")


class Opened:
    """A page that was opened from disk, with what went wrong in it."""

    def __init__(self, browser: Any, file: Path, theme: str = "light") -> None:
        self.context = browser.new_context(offline=True, color_scheme=theme, viewport={"width": 900, "height": 640})
        self.page = self.context.new_page()
        self.wrong: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda m: self.wrong.append(m.text) if m.type in ("error", "warning") else None)
        self.page.on("pageerror", lambda e: self.wrong.append(str(e)))
        self.page.on("request", lambda r: self.asked.append(r.url))
        self.page.goto(file.as_uri())
        self.settle()

    def settle(self) -> None:
        self.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def pixels(self) -> list[int]:
        """Return the picture of the canvas, every 97th byte."""
        found: list[int] = self.page.evaluate(
            """() => {
                const canvas = document.querySelector('#stage canvas'), flat = document.createElement('canvas');
                flat.width = canvas.width; flat.height = canvas.height;
                flat.getContext('2d').drawImage(canvas, 0, 0);
                const data = flat.getContext('2d').getImageData(0, 0, flat.width, flat.height).data;
                return Array.from(data.filter((_, k) => k % 97 === 0));
            }"""
        )
        return found

    def changed(self, before: list[int]) -> float:
        after = self.pixels()
        return sum(a != b for a, b in zip(before, after, strict=True)) / len(after)


@pytest.fixture
def opened(
    browser: Any, tmp_path: Path, hand: clench.Hand, ball: clench.GraspObject, solution: GraspSolution
) -> Opened:
    file = tmp_path / "grasp.html"
    clench.write_page(file, hand, ball, solution)
    return Opened(browser, file)


def test_the_hand_closes_as_the_page_plays(opened: Opened) -> None:
    closed = opened.pixels()
    assert sum(value > 0 for value in closed) > 0.05 * len(closed), "something is drawn"
    opened.page.select_option("#speed", "1")
    opened.page.click("#play")
    opened.page.wait_for_function("() => document.getElementById('scrub').value < 900")
    opened.page.wait_for_function("() => document.getElementById('play').textContent === 'Pause'")
    assert opened.changed(closed) > 0.005
    opened.page.wait_for_function("() => document.getElementById('scrub').value === '1000'")
    opened.settle()
    assert opened.changed(closed) == 0.0
    assert opened.page.text_content("#play") == "Play"
    assert opened.wrong == []
    assert all(url.startswith(("file:", "blob:")) for url in opened.asked)


def test_numbers_are_in_the_page_and_point_at_the_scene(opened: Opened, solution: GraspSolution) -> None:
    said = opened.page.inner_text("#facts")
    assert solution.reason["text"] in said
    assert f"{solution.contacts[0].gap:.1e}" in said
    labels = opened.page.locator("#labels span")
    told = ", ".join(labels.all_text_contents()).split(", ")
    assert sorted(map(int, told)) == [k + 1 for k in range(len(solution.contacts))]
    before = opened.pixels()
    opened.page.hover("tr[data-contact='0']")
    opened.settle()
    assert opened.changed(before) > 0.0
    assert opened.page.locator("#labels span.marked").count() == 1


def test_dragging_turns_the_scene_and_a_double_click_turns_it_back(opened: Opened) -> None:
    before = opened.pixels()
    canvas = opened.page.locator("#stage canvas").bounding_box()
    x, y = canvas["x"] + canvas["width"] / 2, canvas["y"] + canvas["height"] / 2
    opened.page.mouse.move(x, y)
    opened.page.mouse.down()
    opened.page.mouse.move(x + 120, y + 20, steps=4)
    opened.page.mouse.up()
    opened.settle()
    assert opened.changed(before) > 0.02
    opened.page.mouse.wheel(0, -400)
    opened.settle()
    zoomed = opened.pixels()
    opened.page.mouse.dblclick(x, y)
    opened.settle()
    assert opened.changed(zoomed) > 0.02
    assert opened.changed(before) == 0.0


def test_what_the_controls_switch(opened: Opened) -> None:
    for name in ("#marks", "#numbers"):
        opened.page.uncheck(name)
    opened.settle()
    assert opened.page.locator("#labels span").count() == 0
    before = opened.pixels()
    opened.page.check("#marks")
    opened.settle()
    assert opened.changed(before) > 0.0
    before = opened.pixels()
    opened.page.locator("#opacity").fill("100")
    opened.settle()
    assert opened.changed(before) > 0.01
    paper = "() => getComputedStyle(document.body).backgroundColor"
    light = opened.page.evaluate(paper)
    opened.page.click("#theme")
    assert opened.page.evaluate(paper) != light
    assert not opened.page.is_visible("#forearm"), "this hand has none"


def test_the_grasps_of_a_plan_are_clicked_through(browser: Any, tmp_path: Path, hand: clench.Hand) -> None:
    ball = clench.GraspObject.load("ball")
    plan = clench.plan_grasps(hand, ball, 3, effort=16, most=64, path=False)
    clench.write_page(tmp_path / "grasps.html", hand, ball, plan)
    opened = Opened(browser, tmp_path / "grasps.html", "dark")
    assert opened.page.locator("#strip button").count() == len(plan)
    first = opened.pixels()
    opened.page.click("#strip button:nth-child(2)")
    opened.settle()
    assert opened.changed(first) > 0.02
    assert f"{plan[1].epsilon:.4f}" in opened.page.inner_text("#facts")
    opened.page.locator("#stage canvas").focus()
    opened.page.keyboard.press("ArrowLeft")
    opened.settle()
    assert opened.changed(first) == 0.0
    assert opened.wrong == []


def test_a_hand_by_a_wicked_name_does_no_harm(
    browser: Any, tmp_path: Path, hand: clench.Hand, ball: clench.GraspObject, solution: GraspSolution
) -> None:
    name = "<script>document.title='broken'</script><img src=x onerror=\"document.title='broken'\">"
    evil = replace(solution, hand=name, reason={"code": "x", "text": f"</script>{name}"})
    (tmp_path / "evil.html").write_text(page_html(hand, ball, evil), encoding="utf-8")
    opened = Opened(browser, tmp_path / "evil.html")
    assert opened.page.title() == f"{name} on {solution.object}"
    assert name in opened.page.inner_text("h1")
    assert opened.page.locator("img").count() == 0
    assert opened.wrong == []


def test_a_hand_alone_closes_and_opens(browser: Any, tmp_path: Path, hand: clench.Hand) -> None:
    (tmp_path / "hand.html").write_text(hand_page_html(hand), encoding="utf-8")
    opened = Opened(browser, tmp_path / "hand.html")
    before = opened.pixels()
    opened.page.locator("#scrub").fill("500")
    opened.settle()
    assert opened.changed(before) > 0.01
    assert not opened.page.is_visible("#opacity")
    assert opened.wrong == []
