"""Draw hand, object and contacts from three sides."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from clench.apps.figures.drawing import style
from clench.apps.figures.drawing.camera import Camera, Picture, fitted_camera
from clench.apps.figures.drawing.contact_labels import mark_contacts, photograph
from clench.apps.figures.drawing.stage import Stage
from clench.apps.figures.drawing.viewpoints import focus_of, viewpoints
from clench.apps.figures.drawing.views import frame_axes, scale_bar, show
from clench.models.appearance import OBJECT_COLOR, OBSTACLE_COLOR, PALM_COLOR, SolidKind
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.solution import GraspSolution

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: How many sides are shown, the size of each view, and the room between them [px].
_SIDES: Final = 3
_VIEW: Final = (490, 500)
_GAP: Final = 20
#: Room above the views, and below them for lists of so many rows of contacts [px].
_TOP: Final = 76
_ROW: Final = 18
_LEAST_ROWS: Final = 5
_COLUMN: Final = 290
#: Share of a view that hand and object fill: beside them is room for numbers [-].
_FILLED: Final = 0.86


def draw_hand(hand: Hand, obj: GraspObject, solution: GraspSolution, path: Path) -> Path:
    """Write a figure of the closed hand on the object from three sides, with every contact and its normal.

    Hand and object fill the views; what carries the hand is left out. All views have one scale.
    """
    rows = max(-(-len(solution.contacts) // _contact_columns()), _LEAST_ROWS)
    width, height = _SIDES * (_VIEW[0] + _GAP) + _GAP, _TOP + _VIEW[1] + 58 + _ROW * rows
    figure = style.new_figure(width, height)
    points = np.array([c.position for c in solution.contacts]).reshape(-1, 3)
    lasting = np.array([not c.passed for c in solution.contacts], dtype=np.bool_)
    with Stage.of(hand, obj, solution) as stage:
        focus = focus_of(stage)
        directions = viewpoints(stage, focus, points[lasting], _SIDES)
        scale = min(fitted_camera(d, focus, _VIEW, filled=_FILLED).scale for d in directions)
        cameras = [fitted_camera(d, focus, _VIEW, scale) for d in directions]
        taken = [photograph(stage, camera, points) for camera in cameras]
        has_obstacles = any(solid.kind is SolidKind.OBSTACLE for solid in stage.solids)
        solids = [solid.kind for solid in stage.solids]
    hidden = np.array([hides for _, _, hides in taken]).reshape(_SIDES, -1)
    for k, (camera, (image, picture, hides)) in enumerate(zip(cameras, taken, strict=True)):
        left = _GAP + k * (_VIEW[0] + _GAP)
        axes = figure.add_axes((left / width, 1.0 - (_TOP + _VIEW[1]) / height, _VIEW[0] / width, _VIEW[1] / height))
        show(axes, image, _VIEW)
        numbered = np.flatnonzero(~hides | (hidden.all(axis=0) if k == 0 else False)).tolist()
        mark_contacts(axes, camera, solution.contacts, hides, numbered, _free(picture, solids, camera))
        frame_axes(axes, camera, _VIEW[1])
    scale_bar(figure.axes[0], scale, _VIEW)
    _explain(figure, solution, rows, has_obstacles)
    return style.save_figure(figure, path)


def _free(picture: Picture, kinds: list[SolidKind], camera: Camera) -> Any:
    """Return the pixels of a view that show neither hand nor object, and where no scale and no axes are, (H, W)."""
    covered = np.array([kind is not SolidKind.OBSTACLE for kind in kinds] + [False])
    free = ~covered[picture.solid[::2, ::2]]
    free[camera.height - 100 :, :100] = False
    free[camera.height - 50 :, camera.width - 180 :] = False
    return free


def _contact_columns() -> int:
    return (_SIDES * (_VIEW[0] + _GAP)) // _COLUMN - 2


def _explain(figure: Figure, solution: GraspSolution, rows: int, has_obstacles: bool) -> None:
    width, height = figure.get_size_inches() * style.DPI
    title = f"{solution.hand} and {solution.object}: the closed hand from three sides"
    style.write(figure, _GAP / width, 1.0 - 16 / height, title, fontsize=14, fontweight="bold", va="top")
    text = str(solution.reason.get("text", ""))
    answer = f"{solution.status.value.replace('_', ' ')}{': ' if text else ''}{text}"
    style.write(figure, _GAP / width, 1.0 - 44 / height, answer, fontsize=10, va="top", color=style.CHOSEN)
    top = _TOP + _VIEW[1] + 18
    style.write(figure, _GAP / width, 1.0 - top / height, "Contacts", fontsize=11, fontweight="bold", va="top")
    for k, c in enumerate(solution.contacts):
        column, row = divmod(k, rows)
        place = (_GAP + column * _COLUMN) / width, 1.0 - (top + 24 + row * _ROW) / height
        words = f"{k + 1}  {c.link}{' (opened again)' if c.passed else ''}"
        style.write(figure, *place, words, fontsize=10, va="top", color=style.CONTACT)
    if not solution.contacts:
        style.write(figure, _GAP / width, 1.0 - (top + 24) / height, "none", va="top")
    _legend(figure, (width - 2 * _COLUMN - _GAP) / width, (height - top + 4) / height, has_obstacles)


def _legend(figure: Figure, left: float, top: float, has_obstacles: bool) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [Patch(facecolor=PALM_COLOR, label="palm and what does not close")]
    for k, name in enumerate(("first", "second", "third")):
        color = style.mixed(style.joint_color(k), style.PAPER, 0.3)
        handles.append(Patch(facecolor=color, label=f"links after the {name} closing joint"))
    handles.append(Patch(facecolor=OBJECT_COLOR, label="object"))
    if has_obstacles:
        handles.append(Patch(facecolor=OBSTACLE_COLOR, label="obstacle"))
    handles += [
        Line2D([], [], color=style.CONTACT, marker="o", ls="", label="contact, and its number"),
        Line2D([], [], color=style.CONTACT, marker="o", mfc=style.PAPER, ls="", label="contact, hidden from this side"),
        Line2D([], [], color=style.CONTACT, marker=r"$\rightarrow$", ms=12, ls="", label="normal, out of the object"),
        Line2D([], [], color=style.FAINT, marker=r"$\rightarrow$", ms=12, ls="", label="axes of the world"),
    ]
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=(left, top), fontsize=9, frameon=False, ncols=2)
