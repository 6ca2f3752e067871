"""Draw planned grasps side by side: each closed hand without its forearm, from a side that shows its contacts."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.apps.figures.drawing import style
from clench.apps.figures.drawing.camera import Camera, Image, fitted_camera
from clench.apps.figures.drawing.contact_labels import dot, photograph
from clench.apps.figures.drawing.stage import Stage, solution_poses, solution_solids
from clench.apps.figures.drawing.viewpoints import focus_of, viewpoints
from clench.apps.figures.drawing.views import frame_panel, scale_bar, show
from clench.core.pose import FloatArray
from clench.models.appearance import OBJECT_COLOR, OBSTACLE_COLOR, PALM_COLOR
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject

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
    panels = _photographs(hand, obj, shown)
    for k, (grasp, panel) in enumerate(zip(shown, panels, strict=True)):
        left = _GAP + (k % columns) * (_PANEL + _GAP)
        top = top_of_all + (k // columns) * (_PANEL + _CAPTION + _GAP)
        axes = figure.add_axes((left / width, 1.0 - (top + _PANEL) / height, _PANEL / width, _PANEL / height))
        _draw_panel(axes, panel)
        _caption(axes, k + 1, grasp, None if held is None else held[k])
    _explain(figure, hand, obj, (len(shown), len(plan)), text)
    if shown:
        scale_bar(figure.axes[0], panels[0].camera.scale, (_PANEL, _PANEL))
    return style.save_figure(figure, path)


@dataclass(frozen=True, eq=False)
class _Panel:
    """The picture of one grasp: its image, the camera, and the contacts that last, with those that are hidden."""

    image: Image
    camera: Camera
    points: FloatArray
    hidden: NDArray[np.bool_]


def _photographs(hand: Hand, obj: GraspObject, grasps: Sequence[PlannedGrasp]) -> list[_Panel]:
    """Return the pictures of grasps, all at one scale, each from the side that shows its contacts best."""
    if not grasps:
        return []
    solutions = [grasp.solution for grasp in grasps]
    solids = solution_solids(hand, obj, solutions[0])
    poses = [solution_poses(hand, solids, solution) for solution in solutions]
    contacts = [[c.position for c in solution.contacts if not c.passed] for solution in solutions]
    points = [np.array(places).reshape(-1, 3) for places in contacts]
    with Stage(solids, poses[0]) as stage:
        views = []
        for posed, touched in zip(poses, points, strict=True):
            stage.pose(posed)
            focus = focus_of(stage)
            views.append((viewpoints(stage, focus, touched, 1)[0], focus))
        scale = min(fitted_camera(towards, focus, (_PANEL, _PANEL)).scale for towards, focus in views)
        panels = []
        for posed, touched, (towards, focus) in zip(poses, points, views, strict=True):
            stage.pose(posed)
            camera = fitted_camera(towards, focus, (_PANEL, _PANEL), scale)
            image, _, hidden = photograph(stage, camera, touched)
            panels.append(_Panel(image, camera, touched, hidden))
    return panels


def _draw_panel(axes: Axes, panel: _Panel) -> None:
    show(axes, panel.image, (_PANEL, _PANEL))
    for (x, y), hidden in zip(panel.camera.project(panel.points)[:, :2], panel.hidden, strict=True):
        dot(axes, float(x), float(y), bool(hidden), 6.5)
    frame_panel(axes)


def _caption(axes: Axes, number: int, grasp: PlannedGrasp, held: bool | None) -> None:
    """Write number, kind, preshape and epsilon below a panel, and whether the grasp held."""

    def line(x: float, y: float, text: str, **options: Any) -> None:
        style.write(axes, x, y, text, va="top", clip_on=False, **options)

    line(0.0, _PANEL + 7.0, f"{number}", fontsize=12.5, fontweight="bold")
    indent = 24.0 if number < 10 else 34.0
    line(indent, _PANEL + 7.0, grasp.kind.value, fontsize=12.5)
    score = "" if grasp.displaced is None else f"    when displaced {grasp.displaced:z.3f}"
    line(indent, _PANEL + 27.0, f"epsilon {grasp.epsilon:z.3f}{score}", fontsize=9.5)
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
        _legend(figure, width, height, any(body.role is BodyRole.OBSTACLE for body in obj.bodies))


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
