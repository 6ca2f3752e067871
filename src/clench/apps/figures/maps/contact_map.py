"""Draw where the grasps of a plan touch an object: a heat map on its surface, seen from all around."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.apps.figures.drawing import style
from clench.apps.figures.drawing.camera import Camera, Image, Picture, fitted_camera, halved
from clench.apps.figures.drawing.stage import Stage
from clench.apps.figures.drawing.views import frame_axes, frame_panel, scale_bar, show
from clench.core.pose import FloatArray
from clench.models.appearance import SolidKind, object_solids
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.solver.solution import Contact

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure

    from clench.planner.grasp_plan import GraspPlan

#: Size of a panel, of the room between panels, and of the text around them, in pixels.
_PANEL: Final = 400
_GAP: Final = 22
_TOP: Final = 78
_BOTTOM: Final = 96
#: Share of a panel that the object fills, so that axes and scale stay clear of it [-].
_FILLED: Final = 0.86
#: Reduction of the object's light and shade, so that the heat shows [-].
_EVEN: Final = 0.5
#: A contact warms the surface around it: standard deviation [m], and where that ends [m].
_SPREAD: Final = 8e-3
_END: Final = 3.0 * _SPREAD
#: Colours of the share of grasps, from none upwards.
_HEAT: Final = ("#ece5d6", "#f3c98b", style.CONTACT, "#6e1a00")
#: Marks of contacts.
_FINGER: Final[dict[str, Any]] = {"marker": "o", "ms": 4.5, "mfc": style.INK, "mec": style.PAPER, "mew": 0.8}
_THUMB: Final[dict[str, Any]] = {"marker": "s", "ms": 5.5, "mfc": style.JOINT_COLORS[0], "mec": style.PAPER, "mew": 0.8}


def draw_contacts(plan: GraspPlan, hand: Hand, obj: GraspObject, path: Path) -> Path:
    """Write the object from six sides, coloured by the share of the grasps that touch near each place.

    Every contact counts fully at its place, and less around it: exp(-d²/2s²) with s = 8 mm. Among several contacts of a
    grasp, the nearest counts. The other side of a thin wall stays cold.

    Args:
        plan: the grasps. hand, obj: the hand and object of the plan. path: of the file.

    Raises:
        FileError: the file cannot be written, or no figure has its ending.
    """
    style.check_figure(path)
    names = {body.name for body in obj.bodies if body.role is BodyRole.GRASPABLE}
    touches = [_Touches.of(grasp.solution.contacts, names, hand) for grasp in plan]
    width, height = 3 * _PANEL + 4 * _GAP, _TOP + 2 * _PANEL + _GAP + _BOTTOM
    figure = style.new_figure(width, height)
    cameras, pictures = _photographs(obj)
    heats = [_heat(picture, camera, touches) for picture, camera in zip(pictures, cameras, strict=True)]
    most, colors = max(float(heat.max()) for heat in heats) or 1.0, _colors()
    for k, (camera, picture, heat) in enumerate(zip(cameras, pictures, heats, strict=True)):
        left, top = _GAP + (k % 3) * (_PANEL + _GAP), _TOP + (k // 3) * (_PANEL + _GAP)
        axes = figure.add_axes((left / width, 1.0 - (top + _PANEL) / height, _PANEL / width, _PANEL / height))
        show(axes, halved(_painted(picture, colors(heat / most)[..., :3])), (_PANEL, _PANEL))
        _dots(axes, touches, picture, camera)
        frame_axes(axes, camera, _PANEL)
        frame_panel(axes)
    scale_bar(figure.axes[0], 0.5 * cameras[0].scale, (_PANEL, _PANEL))
    _explain(figure, hand, obj, len(plan))
    if touches:
        _color_bar(figure, colors, most)
    return style.save_figure(figure, path)


def _photographs(obj: GraspObject) -> tuple[list[Camera], list[Picture]]:
    """Return pictures of the object in white from six sides, all at one scale, with the cameras that took them."""
    solids = [replace(s, color="#ffffff") for s in object_solids(obj, "raw") if s.kind is SolidKind.OBJECT]
    with Stage(solids, np.tile(obj.pose.matrix, (len(solids), 1, 1))) as stage:
        focus = stage.points(SolidKind.OBJECT)
        scale = _FILLED * min(fitted_camera(d, focus, (_PANEL, _PANEL)).scale for d in _sides())
        cameras = [fitted_camera(d, focus, (2 * _PANEL, 2 * _PANEL), 2.0 * scale) for d in _sides()]
        return cameras, [stage.picture(camera) for camera in cameras]


@dataclass(frozen=True, eq=False)
class _Touches:
    """The contacts of one grasp: places [m] and normals out of the object, (C, 3) each, and which are of thumbs."""

    point: FloatArray
    normal: FloatArray
    of_thumb: NDArray[np.bool_]

    @classmethod
    def of(cls, contacts: Sequence[Contact], bodies: set[str], hand: Hand) -> _Touches:
        """Take the contacts that last and are on bodies of these names."""
        kept = [c for c in contacts if not c.passed and c.body in bodies]
        thumbs = {finger.name for finger in hand.fingers if finger.is_thumb}
        return cls(
            np.array([c.position for c in kept]).reshape(-1, 3),
            np.array([c.normal for c in kept]).reshape(-1, 3),
            np.array([c.finger in thumbs for c in kept], dtype=np.bool_),
        )


def _sides() -> FloatArray:
    """Return directions to six viewers, three from above and three from below, shape (6, 3).

    No two axes of the world fall together: every direction is 15 degrees or more off their planes.
    """
    azimuth = 0.262 + np.arange(6) * (2.0 * np.pi / 3.0) + np.repeat([0.0, np.pi / 3.0], 3)
    height = np.repeat([0.55, -0.55], 3)
    level = np.sqrt(1.0 - height**2)
    return np.column_stack([level * np.cos(azimuth), level * np.sin(azimuth), height])


def _heat(picture: Picture, camera: Camera, touches: Sequence[_Touches]) -> FloatArray:
    """Return the share of grasps that touch near the visible point of each pixel, shape (H, W)."""
    row, column = np.nonzero(picture.solid[::2, ::2] >= 0)
    row, column = 2 * row, 2 * column
    nearness = picture.nearness[row, column]
    x, y = column + 0.5 - 0.5 * camera.width, 0.5 * camera.height - (row + 0.5)
    across = (np.outer(x, camera.right) + np.outer(y, camera.up)) / camera.scale
    points = camera.center + across + np.outer(nearness, camera.towards)
    normals = _normals(picture, camera)[row, column]
    share = np.zeros(len(points))
    for grasp in touches:
        warmest = np.zeros(len(points))
        for point, normal in zip(grasp.point, grasp.normal, strict=True):
            away = points - point
            squared = np.einsum("nk,nk->n", away, away)
            near = np.flatnonzero(squared < _END**2)
            same_side = np.clip(0.5 + normals[near] @ normal, 0.0, 1.0)
            warmest[near] = np.maximum(warmest[near], same_side * np.exp(-0.5 * squared[near] / _SPREAD**2))
        share += warmest / len(touches)
    heat = np.zeros((camera.height // 2, camera.width // 2))
    heat[row // 2, column // 2] = share
    return heat.repeat(2, axis=0).repeat(2, axis=1)


def _normals(picture: Picture, camera: Camera) -> FloatArray:
    """Return the normal of the visible surface at each pixel, towards the viewer, shape (H, W, 3).

    Of the two neighbours of a pixel in a direction the one at which the depth changes less counts: at the border of a
    surface the other one is behind it.
    """
    depth = np.where(picture.solid >= 0, picture.nearness, -1e3)
    slopes = []
    for axis in (0, 1):
        step = np.diff(depth, axis=axis)
        before, after = np.insert(step, 0, np.inf, axis=axis), np.insert(step, step.shape[axis], np.inf, axis=axis)
        slopes.append(camera.scale * np.where(np.abs(before) < np.abs(after), before, after))
    down, right = np.clip(slopes, -1e3, 1e3)
    normals = camera.towards - right[..., None] * camera.right + down[..., None] * camera.up
    unit: FloatArray = normals / np.linalg.norm(normals, axis=2, keepdims=True)
    return unit


def _painted(picture: Picture, colors: FloatArray) -> Image:
    """Return the lit object in colours of its pixels, shape (H, W, 3), with dark lines around it."""
    image = np.float32(1.0 - _EVEN) * picture.outlined() + np.float32(_EVEN)
    seen = picture.solid >= 0
    image[seen] *= colors[seen].astype(np.float32)
    return image


def _dots(axes: Axes, touches: Sequence[_Touches], picture: Picture, camera: Camera) -> None:
    """Mark the visible contacts, with another mark for thumbs."""
    for of_thumb, mark in ((False, _FINGER), (True, _THUMB)):
        of_kind = [t.point[(t.of_thumb == of_thumb) & _visible(t, picture, camera)] for t in touches]
        shown = np.concatenate([np.empty((0, 3)), *of_kind])
        axes.plot(*(0.5 * camera.project(shown)[:, :2]).T, ls="", **mark)


def _visible(touches: _Touches, picture: Picture, camera: Camera) -> NDArray[np.bool_]:
    """Tell which contacts a camera sees, shape (C,).

    A wall may be thinner than the picture's depth is exact. So a contact must also be on a side that faces the camera.
    """
    faces: NDArray[np.bool_] = touches.normal @ camera.towards > 0.0
    return faces & ~picture.hides(camera, touches.point)


def _explain(figure: Figure, hand: Hand, obj: GraspObject, count: int) -> None:
    from matplotlib.lines import Line2D

    width, height = figure.get_size_inches() * style.DPI
    grasps = f"{count} planned grasp{'' if count == 1 else 's'} touch{'es' if count == 1 else ''}"
    title = f"{hand.name} and {obj.name}: where {grasps} the object" if count else f"{obj.name}: no grasp was planned"
    style.write(figure, _GAP / width, 1.0 - 14 / height, title, fontsize=14, fontweight="bold", va="top")
    said = "From above and from below, at one scale. Each view marks the contacts on the sides that it shows."
    style.write(figure, _GAP / width, 1.0 - 42 / height, said, fontsize=10, va="top", color=style.CHOSEN)
    has_thumb = any(finger.is_thumb for finger in hand.fingers)
    handles = [Line2D([], [], ls="", label="contact of a finger", **_FINGER)]
    handles += [Line2D([], [], ls="", label="contact of a thumb", **_THUMB)] if has_thumb else []
    handles.append(Line2D([], [], color=style.FAINT, marker=r"$\rightarrow$", ms=12, ls="", label="axes of the world"))
    figure.legend(
        handles=handles,
        loc="lower right",
        bbox_to_anchor=(1.0 - _GAP / width, 30 / height),
        fontsize=9,
        frameon=False,
        ncols=len(handles),
    )


def _color_bar(figure: Figure, colors: Colormap, most: float) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    width, height = figure.get_size_inches() * style.DPI
    place = figure.add_axes((_GAP / width, 50 / height, 1.5 * _PANEL / width, 14 / height))
    bar = figure.colorbar(ScalarMappable(Normalize(0.0, 100.0 * most), colors), cax=place, orientation="horizontal")
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=9, color=style.FAINT)
    bar.set_label("share of the grasps that touch within about 1 cm [%]", fontsize=9.5)


def _colors() -> Colormap:
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("heat", _HEAT)
