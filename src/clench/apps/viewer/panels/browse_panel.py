"""The panel to look through many grasps: filters, steps, a strip of small grasps, and marks that pick."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

import clench
from clench.apps.viewer.grasps.listed_grasp import ANY, HELD, SHOWN, GraspFilter, ListedGrasp, words_of
from clench.apps.viewer.grasps.planned_list import plan_list
from clench.apps.viewer.scene.camera_place import strip_place
from clench.apps.viewer.scene.film_strip import FilmStrip, GraspMarks
from clench.apps.viewer.session.live_session import LiveSession
from clench.core.exceptions import ClenchError
from clench.core.pose import FloatArray, Pose

from .user_events import when_set

if TYPE_CHECKING:
    import viser

#: Small grasps in the strip at a time.
PAGE: Final = 7
_MOST_POINTS: Final = 4000
#: The strip goes to its new place when the camera has not moved for so long [s].
_CAMERA_RESTS: Final = 0.4


class BrowsePanel:
    """Look through grasps of files, or of a search that is started here.

    Args:
        server: of viser. session: where a picked grasp is shown. grasps: what to begin with.
    """

    def __init__(self, server: viser.ViserServer, session: LiveSession, grasps: list[ListedGrasp]) -> None:
        self._server, self._session = server, session
        self._grasps, self._chosen, self._at = grasps, list[int](), 0
        self._strip = FilmStrip(server, lambda place: self.go(self._page_begin() + place))
        self._marks = GraspMarks(server, self._pick)
        self._searching, self._drawing = threading.Lock(), threading.Lock()
        gui = server.gui
        self._said = gui.add_markdown("")
        self._steps = gui.add_button_group("Grasp", ("◀ 10", "◀", "▶", "▶ 10"))
        self._place = gui.add_slider("Place", 1, 2, 1, 1)
        with gui.add_folder("Filters"):
            self._status = gui.add_dropdown("Status", (ANY,))
            self._kind = gui.add_dropdown("Kind", (ANY,))
            self._held = gui.add_dropdown("Held", (ANY, *HELD))
            self._shown = gui.add_dropdown("Show", SHOWN)
            self._reason = gui.add_dropdown("Rejected for", (ANY,))
            self._score = gui.add_multi_slider("Score", 0.0, 1.0, 0.001, (0.0, 1.0))
        self._count = gui.add_slider("How many", 5, 200, 5, 20)
        search = gui.add_button("Plan grasps to look through")
        self._steps.on_click(lambda event: self._step(event.target.value))
        when_set(self._place, lambda place: self.go(int(place) - 1))
        for widget in (self._status, self._kind, self._held, self._shown, self._reason, self._score):
            when_set(widget, lambda _: self._filter())
        search.on_click(lambda _: self._search())
        self._resting = threading.Timer(0.0, self._draw_strip)
        server.on_client_connect(self._follow)
        self.take(grasps)

    def take(self, grasps: list[ListedGrasp]) -> None:
        """Show other grasps."""
        self._grasps = grasps
        for widget, words in (
            (self._status, words_of(g.status for g in grasps)),
            (self._kind, words_of(g.kind for g in grasps)),
            (self._reason, words_of(g.rejected for g in grasps)),
        ):
            widget.options = words
        scores = [g.score for g in grasps if g.score is not None]
        low, high = (min(scores), max(scores)) if scores else (0.0, 1.0)
        self._score.min, self._score.max = float(np.floor(1e3 * low) / 1e3), float(np.ceil(1e3 * high) / 1e3 + 1e-3)
        self._score.value = (self._score.min, self._score.max)
        self._filter()

    def _follow(self, client: Any) -> None:
        """Keep the strip at the lower edge of a new tab's view, whenever its camera comes to rest."""

        def moved(_: Any) -> None:
            self._resting.cancel()
            if self._chosen:
                self._resting = threading.Timer(_CAMERA_RESTS, self._draw_strip)
                self._resting.daemon = True
                self._resting.start()

        client.camera.on_update(moved)
        moved(client.camera)

    def go(self, place: int) -> None:
        """Show the grasp at a place of the chosen ones."""
        if not self._chosen:
            return
        self._at = min(max(place, 0), len(self._chosen) - 1)
        grasp = self._grasps[self._chosen[self._at]]
        self._say(grasp)
        self._place.value = self._at + 1
        try:
            command = grasp.command()
        except ClenchError as error:
            self._said.content = f"{grasp.text}: {error}"
            return
        self._session.change(lambda s: replace(s, hand=grasp.hand, object=grasp.object, command=command))
        self._session.adopt()
        self._draw_strip()

    def _say(self, grasp: ListedGrasp) -> None:
        self._said.content = f"**{self._at + 1} of {len(self._chosen)}** ({len(self._grasps)} in all)  \n{grasp.text}"

    def _filter(self) -> None:
        low, high = self._score.value
        wanted = GraspFilter(
            self._status.value,
            self._kind.value,
            self._held.value,
            self._shown.value,
            self._reason.value,
            (float(low), float(high)),
        )
        self._chosen = wanted.chosen(self._grasps)
        self._at = 0
        self._place.max = max(len(self._chosen), 2)
        if not self._grasps:
            self._said.content = "No grasps are open. Plan some, or give `clench view` a file."
        elif not self._chosen:
            self._said.content = f"None of {len(self._grasps)} grasps passes the filters."
        self._draw_marks()
        self.go(0)

    def _step(self, words: str) -> None:
        self.go(self._at + {"◀ 10": -10, "◀": -1, "▶": 1, "▶ 10": 10}[words])

    def _pick(self, number: int) -> None:
        if number in self._chosen:
            self.go(self._chosen.index(number))

    def _page_begin(self) -> int:
        return self._at // PAGE * PAGE

    def _draw_strip(self) -> None:
        """Draw the grasps of the page that the chosen one is on; of another hand or object none."""
        with self._drawing:
            self._draw_page()

    def _draw_page(self) -> None:
        if not self._chosen:
            return
        begin = self._page_begin()
        here = self._grasps[self._chosen[self._at]]
        page = [self._grasps[k] for k in self._chosen[begin : begin + PAGE]]
        hand, obj = self._session.shelf.hand(here.hand), self._session.shelf.object(here.object)
        shown: list[tuple[FloatArray, Pose]] = []
        for grasp in page:
            if (grasp.hand, grasp.object) != (here.hand, here.object) or grasp.posture is None:
                shown = []
                break
            shown.append((grasp.posture(), grasp.T_object_palm))
        clients = list(self._server.get_clients().values())
        place = strip_place(clients[-1].camera if clients else None, hand, obj, PAGE)
        self._strip.show(hand, obj, shown, self._at - begin, place)

    def _draw_marks(self) -> None:
        if not self._chosen:
            self._marks.hide()
            return
        here = self._grasps[self._chosen[0]]
        numbers = [k for k in self._chosen if self._grasps[k].object == here.object][:_MOST_POINTS]
        some = [self._grasps[k] for k in numbers]
        places = np.array([g.T_object_palm.position for g in some]).reshape(-1, 3)
        scores = np.array([np.nan if g.score is None else g.score for g in some])
        self._marks.show(numbers, places, scores, np.array([bool(g.rejected) for g in some]))

    def _search(self) -> None:
        """Plan grasps of the hand and the object that are shown; proposals that came to nothing are listed, too."""
        if not self._searching.acquire(blocking=False):
            return
        try:
            self._said.content = "Planning …"
            count = int(self._count.value)
            found = plan_list(self._session, count, lambda n: self._tell_progress(n, count))
            self.take(found)
        except clench.ClenchError as error:
            self._said.content = f"Not planned: {error}"
        finally:
            self._searching.release()

    def _tell_progress(self, found: int, count: int) -> None:
        self._said.content = f"Planning … {found} of {count} grasps"
