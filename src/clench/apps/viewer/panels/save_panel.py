"""The panel that hands out files: the browser downloads them, so that the page names no place on the server's disk."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import clench
from clench.apps.viewer.motion.motion_track import Frame
from clench.apps.viewer.session.live_session import LiveSession
from clench.apps.viewer.session.scene_code import scene_code
from clench.core.exceptions import ClenchError
from clench.core.files.json_files import encode_document
from clench.models.command_file import command_to_dict

from .play_panel import PlayPanel

if TYPE_CHECKING:
    import viser

#: Size of pictures and videos in pixels (height, width), and pictures per second of a video.
_PICTURE: Final = (900, 1200)
_VIDEO: Final = (360, 480)
_RATE: Final = 12.5
_LONGEST: Final = 10.0
_PATIENCE: Final = 60.0


class SavePanel:
    """Hand out the solution, the command, Python code, a picture and a video.

    Args:
        server: viser's server. session: the session to save. play: has the motion of videos. show: draws one frame.
        back: draws the answer again. paper: returns the colour behind pictures.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        session: LiveSession,
        play: PlayPanel,
        show: Callable[[Frame], None],
        back: Callable[[], None],
        paper: Callable[[], tuple[int, int, int]],
    ) -> None:
        self._server, self._session, self._play = server, session, play
        self._show, self._back, self._paper = show, back, paper
        gui = server.gui
        gui.add_markdown("Files go to the downloads of this browser.")
        for words, make in (
            ("Solution (.json)", self._solution),
            ("Command (.json)", self._command),
            ("Python (.py)", self._python),
            ("Picture (.png)", self._picture),
            ("Video of the motion (.gif)", self._video),
        ):
            button = gui.add_button(words, color="gray")
            button.on_click(lambda event, make=make: self._hand_out(event, make))
        self._said = gui.add_markdown("")

    def _hand_out(self, event: Any, make: Callable[[Any], tuple[str, bytes] | None]) -> None:
        try:
            made = make(event.client)
        except (ClenchError, TimeoutError) as error:
            self._said.content = f"Not saved: {error}"
            return
        if made is None:
            self._said.content = "Not saved: there is no answer yet."
            return
        event.client.send_file_download(*made, save_immediately=True)
        self._said.content = f"Saved {made[0]}."

    def _solution(self, _: Any) -> tuple[str, bytes] | None:
        settled = self._session.settled
        if settled is None:
            return None
        quick, shelf = settled.quick, self._session.shelf
        state = quick.state
        whole = clench.execution.complete(
            settled.solution, quick.hand, quick.obj, mass=state.mass, friction=state.friction
        )
        hand, thing = shelf.hand_models.get(state.hand, state.hand), shelf.object_models.get(state.object, state.object)
        return "solution.json", encode_document(
            replace(whole, hand_model=hand, object_model=thing).to_dict(), "solution"
        )

    def _command(self, _: Any) -> tuple[str, bytes]:
        return "command.json", encode_document(command_to_dict(self._session.state.command), "command")

    def _python(self, _: Any) -> tuple[str, bytes]:
        state, shelf = self._session.state, self._session.shelf
        hand = shelf.hand_code.get(state.hand, f"clench.Hand.load({state.hand!r})")
        thing = shelf.object_code.get(state.object, (f"obj = clench.GraspObject.load({state.object!r})",))
        return "scene.py", scene_code(state, hand, thing).encode()

    def _picture(self, client: Any) -> tuple[str, bytes]:
        content = io.BytesIO()
        self._taken(client, _PICTURE).save(content, "PNG", optimize=True)
        return "grasp.png", content.getvalue()

    def _video(self, client: Any) -> tuple[str, bytes] | None:
        track = self._play.track()
        if track is None:
            return None
        self._play.player.pause()
        shown = min(track.duration, _LONGEST)
        pictures = []
        try:
            for k in range(int(shown * _RATE) + 1):
                self._said.content = f"Taking picture {k + 1} of {int(shown * _RATE) + 1} …"
                self._show(track.at(k / _RATE))
                pictures.append(self._taken(client, _VIDEO))
        finally:
            self._back()
        first, *others = [picture.quantize(128) for picture in pictures]
        content = io.BytesIO()
        first.save(content, "GIF", save_all=True, append_images=others, duration=round(1e3 / _RATE), loop=0)
        return "grasp.gif", content.getvalue()

    def _taken(self, client: Any, size: tuple[int, int]) -> Any:
        """Return the picture of a tab's view, on the colour of its page."""
        from PIL import Image

        pixels = client.get_render(*size, transport_format="png", timeout=_PATIENCE)
        seen = Image.fromarray(pixels, "RGBA")
        paper = Image.new("RGBA", seen.size, (*self._paper(), 255))
        return Image.alpha_composite(paper, seen).convert("RGB")
