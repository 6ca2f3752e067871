"""Draw planned grasps side by side: each closed hand without its forearm, from a side that shows its contacts."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from clench.core.pose import FloatArray
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.solver.solution import GraspSolution

from . import style
from .hand_view import around, focus_of, is_hidden, render
from .raster import Camera, halved, rasterise
from .surfaces import (
    OBJECT_COLOR,
    OBJECT_GROUP,
    OBSTACLE_COLOR,
    PALM_COLOR,
    hand_surface,
    object_surface,
    without_forearm,
)
from .views import fitted_camera, frame_panel, scale_bar

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from clench.planner.grasp_plan import GraspPlan, PlannedGrasp

#: Grasps on a sheet at most: the best ones.
MOST_GRASPS: Final = 20
#: Size of a panel, of the room between panels, and of the text around them, in pixels.
_PANEL: Final = 290
_GAP: Final = 22
_CAPTION: Final = 46
_TOP: Final = 48
_LINE: Final = 18
_BOTTOM: Final = 44
_COLUMNS: Final = 5
#: Width of a letter of the text, at most [px].
_LETTER: Final = 8
#: Width of the figure at least, for the text above and below the panels, and of a legend in one row, in pixels.
_NARROWEST: Final = 960
_LEGEND: Final = 1400
#: Opacity of the hand behind the object [-].
_THROUGH: Final = 0.42
#: Width of a grid [m] to which surfaces are coarsened while a viewpoint is chosen, and pixels on a side.
_GRID: Final = 3e-3
_SMALL: Final = 90
#: The object is shown as far from the hand as this share of its size [-].
_NEAR: Final = 0.25
#: A contact is hidden when all of the surface within so many pixels of its mark lies before it.
_MARK: Final = 3
#: Weight of a contact behind the object, next to a visible one; a contact behind hand or obstacles counts nothing.
_BEHIND_OBJECT: Final = 0.6


def draw_grasps(plan: GraspPlan, hand: Hand, obj: GraspObject, path: Path, held: Sequence[bool] | None = None) -> Path:
    """Write a sheet of the best grasps of a plan, at most `MOST_GRASPS`, all at one scale.

    Args:
        plan: the grasps. hand, obj: the hand and object of the plan. path: of the file.
        held: whether each grasp held the object when it was tried; None: not tried.

    Raises:
        FileError: the file cannot be written, or no figure has its ending.
    """
    style.check_figure(path)
    shown = list(plan)[:MOST_GRASPS]
    columns = min(_COLUMNS, max(len(shown), 1))
    if len(shown) in (6, 8):  # two even rows
        columns = len(shown) // 2
    rows = math.ceil(len(shown) / columns)
    width = max(_GAP + columns * (_PANEL + _GAP), _NARROWEST)
    text = textwrap.wrap(plan.text, width // _LETTER)
    top_of_all = _TOP + _LINE * len(text)
    height = top_of_all + rows * (_PANEL + _CAPTION + _GAP) + (_BOTTOM if width >= _LEGEND else _BOTTOM + _LINE)
    figure = style.new_figure(width, height)
    scenes = [_Scene(hand, obj, grasp.solution) for grasp in shown]
    scale = min((scene.scale for scene in scenes), default=1.0)
    for k, (grasp, scene) in enumerate(zip(shown, scenes, strict=True)):
        left = _GAP + (k % columns) * (_PANEL + _GAP)
        top = top_of_all + (k // columns) * (_PANEL + _CAPTION + _GAP)
        axes = figure.add_axes((left / width, 1.0 - (top + _PANEL) / height, _PANEL / width, _PANEL / height))
        _draw_panel(axes, scene, scale)
        _caption(axes, k + 1, grasp, None if held is None else held[k])
    _explain(figure, hand, obj, (len(shown), len(plan)), text)
    if shown:
        scale_bar(figure.axes[0], scale, (_PANEL, _PANEL))
    return style.save_figure(figure, path)


class _Scene:
    """Hand and object of one grasp, and the camera that shows its contacts best."""

    def __init__(self, hand: Hand, obj: GraspObject, solution: GraspSolution) -> None:
        self.body = without_forearm(hand, hand_surface(hand, solution))
        self.things = object_surface(obj, solution)
        self.points = np.array([c.position for c in solution.contacts if not c.passed]).reshape(-1, 3)
        in_the_way = np.isin(self.things.groups, _obstacles(obj))
        body, grasped = self.body.coarse(_GRID), self.things.taken(~in_the_way).coarse(_GRID)
        self.focus = focus_of(body, grasped, _NEAR)
        opaque = np.concatenate([body, self.things.taken(in_the_way).corners])
        cameras = [fitted_camera(d, self.focus, (_SMALL, _SMALL)) for d in around()]
        best = int(np.argmax([self._score(opaque, grasped, camera) for camera in cameras]))
        self.towards = around()[best]
        self.scale = fitted_camera(self.towards, self.focus, (_PANEL, _PANEL)).scale

    def _score(self, opaque: FloatArray, grasped: FloatArray, camera: Camera) -> float:
        """Return how well a view shows the contacts: seen, and spread over the picture."""
        if not len(self.points):
            return 0.0
        away = is_hidden(rasterise(opaque, camera).nearness, camera, self.points)
        behind = is_hidden(rasterise(grasped, camera).nearness, camera, self.points)
        seen = np.where(away, 0.0, np.where(behind, _BEHIND_OBJECT, 1.0))
        spread = float(np.ptp(camera.project(self.points)[:, :2], axis=0).sum()) / camera.width
        return float(seen.mean()) + 0.5 * spread


def _obstacles(obj: GraspObject) -> list[int]:
    """Return the groups of the triangles of obstacles."""
    return [OBJECT_GROUP + k for k, body in enumerate(obj.bodies) if body.role is BodyRole.OBSTACLE]


def _draw_panel(axes: Axes, scene: _Scene, scale: float) -> None:
    from scipy.ndimage import minimum_filter

    double = fitted_camera(scene.towards, scene.focus, (2 * _PANEL, 2 * _PANEL), 2.0 * scale)
    image, nearness = render(scene.body, scene.things, double, _THROUGH)
    axes.imshow(halved(image), extent=(0, _PANEL, _PANEL, 0), interpolation="nearest")
    farthest = minimum_filter(nearness, 4 * _MARK + 1, mode="nearest")
    hidden = is_hidden(farthest, double, scene.points)
    for (x, y), behind in zip(0.5 * double.project(scene.points)[:, :2], hidden, strict=True):
        face, edge = (style.PAPER, style.CONTACT) if behind else (style.CONTACT, style.PAPER)
        axes.plot(x, y, "o", ms=6.5, mfc=face, mec=edge, mew=1.5, zorder=6)
    axes.set_xlim(0, _PANEL)
    axes.set_ylim(_PANEL, 0)
    frame_panel(axes)


def _caption(axes: Axes, number: int, grasp: PlannedGrasp, held: bool | None) -> None:
    """Write number, kind, preshape and epsilon below a panel, and whether the grasp held."""

    def line(x: float, y: float, text: str, **options: Any) -> None:
        style.write(axes, x, y, text, va="top", clip_on=False, **options)

    line(0.0, _PANEL + 7.0, f"{number}", fontsize=12.5, fontweight="bold")
    indent = 24.0 if number < 10 else 34.0
    line(indent, _PANEL + 7.0, grasp.kind.value, fontsize=12.5)
    score = "" if grasp.displaced is None else f"    when displaced {grasp.displaced:.3f}"
    line(indent, _PANEL + 27.0, f"epsilon {grasp.epsilon:.3f}{score}", fontsize=9.5)
    if grasp.displaced is None:
        line(_PANEL, _PANEL + 27.0, grasp.preshape, fontsize=9.5, color=style.FAINT, ha="right")
    if held is not None:
        text, color = ("\u2713 held", style.CHOSEN) if held else ("\u2717 dropped", style.CONTACT)
        line(_PANEL, _PANEL + 7.0, text, fontsize=11, color=color, fontweight="bold", ha="right")


def _explain(figure: Figure, hand: Hand, obj: GraspObject, counts: tuple[int, int], text: list[str]) -> None:
    width, height = figure.get_size_inches() * style.DPI
    shown, found = counts
    plural = "" if found == 1 else "s"
    said = f"the best {shown} of {found} planned grasps" if shown < found else f"{found or 'no'} planned grasp{plural}"
    title = f"{hand.name} and {obj.name}: {said}{', the best first' if shown > 1 else ''}"
    style.write(figure, _GAP / width, 1.0 - 14 / height, title, fontsize=14, fontweight="bold", va="top")
    style.write(figure, _GAP / width, 1.0 - 38 / height, "\n".join(text), fontsize=10, va="top", color=style.CHOSEN)
    if shown:
        _legend(figure, width, height, bool(_obstacles(obj)))


def _legend(figure: Figure, width: float, height: float, has_obstacles: bool) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [Patch(facecolor=PALM_COLOR, label="palm and what does not close")]
    for k, name in enumerate(("first", "second", "third")):
        color = style.mixed(style.joint_color(k), style.PAPER, 0.3)
        handles.append(Patch(facecolor=color, label=f"after the {name} closing joint"))
    handles.append(Patch(facecolor=OBJECT_COLOR, label="object"))
    if has_obstacles:
        handles.append(Patch(facecolor=OBSTACLE_COLOR, label="obstacle"))
    handles.append(Line2D([], [], color=style.CONTACT, marker="o", ls="", label="contact"))
    hidden = Line2D([], [], color=style.CONTACT, marker="o", mfc=style.PAPER, ls="", label="hidden contact")
    handles.append(hidden)
    figure.legend(
        handles=handles,
        loc="lower left",
        bbox_to_anchor=((_GAP - 8) / width, 4 / height),
        ncols=len(handles) if width >= _LEGEND else math.ceil(len(handles) / 2),
        fontsize=9,
        frameon=False,
        handlelength=1.4,
        columnspacing=1.3,
    )
