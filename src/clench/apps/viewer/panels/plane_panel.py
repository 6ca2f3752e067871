"""The picture of the picked finger in its curl plane, drawn anew whenever nothing moves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.apps.viewer.session.settled_answer import SettledAnswer
from clench.core.exceptions import ClenchError
from clench.solver.orders import settled as with_choices

from .user_events import when_set

if TYPE_CHECKING:
    import viser

_SIZE: Final = (560, 470)
_NOTHING: Final = np.full((2, 2, 3), 255, dtype=np.uint8)


class PlanePanel:
    """Show the curl-plane figure of a finger.

    Args:
        server: of viser.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        gui = server.gui
        self._finger = gui.add_dropdown("Cut finger", ("–",), hint="Across the axes of its joints.")
        self._live = gui.add_checkbox("Draw the cut", False, hint="Anew at rest, in a fifth of a second.")
        self._text = gui.add_markdown("")
        self._image = gui.add_image(_NOTHING, format="png", visible=False)
        self._last: SettledAnswer | None = None
        when_set(self._finger, lambda _: self._draw())
        when_set(self._live, lambda _: self._draw())

    def pick(self, finger: str | None) -> None:
        """Show a finger that was clicked."""
        if finger is not None and finger in self._finger.options:
            self._finger.value = finger
            self._draw()

    def rested(self, answer: SettledAnswer) -> None:
        """Draw the newest answer."""
        self._last = answer
        names = tuple(answer.solution.fingers)
        if tuple(self._finger.options) != names:
            self._finger.options = names
        self._draw()

    def _draw(self) -> None:
        answer = self._last
        if not self._live.value:
            self._text.content, self._image.visible = "", False
        if answer is None or not self._live.value or self._finger.value not in answer.solution.fingers:
            return
        try:
            picture, words = plane_picture(answer, self._finger.value)
        except ClenchError as error:
            self._text.content = f"No figure: {error}"
            return
        self._text.content = words
        self._image.visible = picture is not None
        if picture is not None:
            self._image.image = picture


def plane_picture(answer: SettledAnswer, finger: str) -> tuple[NDArray[np.uint8] | None, str]:
    """Return the figure of a finger's most telling curl plane, shape (H, W, 3), and which one it is.

    Args:
        answer: at rest. finger: its name; one that has nothing to close has no figure.
    """
    from clench.apps.figures.drawing import style
    from clench.apps.figures.planes.curl_plane import draw_plane, frame_plane
    from clench.apps.figures.planes.finger_scenes import FingerScenes
    from clench.apps.figures.planes.plane_scene import bounds

    quick, solution = answer.quick, answer.solution
    result = solution.fingers[finger]
    best = result.best
    if best is None:
        return None, f"{finger}: {result.reason}"
    command = with_choices(quick.state.command, solution)
    scenes = FingerScenes(quick.hand, quick.obj, command, solution, finger, best)
    scene = scenes.scene(*scenes.touched_planes(1)[0])
    figure: Any = style.new_figure(*_SIZE)
    axes = figure.add_axes((0.09, 0.09, 0.88, 0.88))
    draw_plane(axes, scene)
    frame_plane(axes, *bounds([scene]))
    figure.canvas.draw()
    drawn: NDArray[np.uint8] = np.asarray(figure.canvas.buffer_rgba())[..., :3].copy()
    return drawn, f"**{finger}**, {scene.place}; millimetres. {result.reason}"
