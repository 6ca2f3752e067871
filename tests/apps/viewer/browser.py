"""A real browser for the tests of the page: Debian's chromium, driven by playwright."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from clench.apps.viewer.serving import OpenPage, serve
from clench.apps.viewer.session.live_session import LiveSession

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = [
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--disable-quic",
]
SIZE = {"width": 800, "height": 440}
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no chromium: apt-get install chromium")


@contextmanager
def chromium() -> Iterator[Any]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        try:
            yield browser
        finally:
            browser.close()


@dataclass
class Tab:
    """One tab with the page. `open` is what serves it, `session` what it shows."""

    page: Any
    open: OpenPage
    session: LiveSession

    def wait_for(self, what: str, seconds: float = 20.0) -> None:
        """Wait until the card is in a state: moving, rest, busy, failed."""
        self.page.wait_for_selector(f"[data-clench={what}]", timeout=1e3 * seconds)

    def until(self, came: Callable[[], bool], seconds: float = 30.0) -> None:
        """Wait until what the page sent has come, and is answered.

        Raises:
            AssertionError: it did not come in time.
        """
        end = time.monotonic() + seconds
        while not came():
            assert time.monotonic() < end, "what the page sent did not come"
            self.page.wait_for_timeout(20)
        assert self.session.wait()

    def card(self) -> str:
        return self.page.locator("[data-clench]").inner_text()

    def pixel(self, point: Any) -> tuple[float, float]:
        """Return where a point of the world is on the screen, as the tab's own camera sees it."""
        clients = self.open.server.get_clients()
        camera = clients[max(clients)].camera
        w, x, y, z = camera.wxyz
        R = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        seen = R.T @ (np.asarray(point) - camera.position)
        box = self.page.locator("canvas").first.bounding_box()
        scale = 0.5 * box["height"] / np.tan(0.5 * camera.fov)
        return (
            float(box["x"] + 0.5 * box["width"] + scale * seen[0] / seen[2]),
            float(box["y"] + 0.5 * box["height"] + scale * seen[1] / seen[2]),
        )

    def drag(self, start: tuple[float, float], way: tuple[float, float], steps: int = 12) -> None:
        """Drag with the mouse, in small steps."""
        mouse = self.page.mouse
        mouse.move(*start)
        mouse.down()
        for k in range(1, steps + 1):
            mouse.move(start[0] + way[0] * k / steps, start[1] + way[1] * k / steps)
            self.page.wait_for_timeout(30)
        mouse.up()


@contextmanager
def opened(browser: Any, session: LiveSession) -> Iterator[Tab]:
    """Serve a session, and open it in a tab of a browser."""
    with serve(session, "localhost", 0) as page:
        tab = Tab(browser.new_page(viewport=SIZE), page, session)
        tab.page.goto(page.url)
        tab.wait_for("rest", 60.0)
        # The note that there is no graphics card covers the scene.
        for close in tab.page.locator(".mantine-Notification-closeButton").all():
            close.click()
        tab.page.wait_for_timeout(500)
        yield tab
        tab.page.close()
