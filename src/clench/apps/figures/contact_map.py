"""Draw where the grasps of a plan touch an object: a heat map on its surface, seen from all around."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.solver.solution import Contact

from . import style
from .hand_view import is_hidden
from .raster import Camera, Image, Picture, borders, halved, rasterise, shade
from .surfaces import OBJECT_GROUP, Surface, placed_object
from .views import fitted_camera, frame_axes, frame_panel, scale_bar

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
    surface = placed_object(obj, obj.pose.matrix)
    names = {body.name for body in obj.bodies if body.role is BodyRole.GRASPABLE}
    kept = [OBJECT_GROUP + k for k, body in enumerate(obj.bodies) if body.name in names]
    surface = surface.taken(np.isin(surface.groups, kept))
    touches = [_Touches.of(grasp.solution.contacts, names, hand) for grasp in plan]
    width, height = 3 * _PANEL + 4 * _GAP, _TOP + 2 * _PANEL + _GAP + _BOTTOM
    figure = style.new_figure(width, height)
    focus = surface.corners.reshape(-1, 3)
    scale = _FILLED * min(fitted_camera(d, focus, (_PANEL, _PANEL)).scale for d in _sides())
    cameras = [fitted_camera(d, focus, (2 * _PANEL, 2 * _PANEL), 2.0 * scale) for d in _sides()]
    pictures = [rasterise(surface.corners, camera) for camera in cameras]
    heats = [_heat(p, surface, camera, touches) for p, camera in zip(pictures, cameras, strict=True)]
    most, colors = max(float(heat.max()) for heat in heats) or 1.0, _colors()
    for k, (camera, picture, heat) in enumerate(zip(cameras, pictures, heats, strict=True)):
        left, top = _GAP + (k % 3) * (_PANEL + _GAP), _TOP + (k // 3) * (_PANEL + _GAP)
        axes = figure.add_axes((left / width, 1.0 - (top + _PANEL) / height, _PANEL / width, _PANEL / height))
        image = _painted(picture, surface, camera, colors(heat / most)[..., :3])
        axes.imshow(halved(image), extent=(0, _PANEL, _PANEL, 0), interpolation="nearest")
        _dots(axes, touches, picture, camera)
        frame_axes(axes, camera, _PANEL)
        axes.set_xlim(0, _PANEL)
        axes.set_ylim(_PANEL, 0)
        frame_panel(axes)
    scale_bar(figure.axes[0], scale, (_PANEL, _PANEL))
    _explain(figure, hand, obj, len(plan))
    if touches:
        _color_bar(figure, colors, most)
    return style.save_figure(figure, path)


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


def _heat(picture: Picture, surface: Surface, camera: Camera, touches: Sequence[_Touches]) -> FloatArray:
    """Return, per pixel, the share of grasps that touch near the visible point, shape (H, W)."""
    seen = picture.triangle[::2, ::2] >= 0
    row, column = np.nonzero(seen)
    x, y = 2.0 * column + 0.5 - 0.5 * camera.width, 0.5 * camera.height - (2.0 * row + 0.5)
    across = (np.outer(x, camera.right) + np.outer(y, camera.up)) / camera.scale
    points = camera.center + across + np.outer(picture.nearness[::2, ::2][seen], camera.towards)
    normals = surface.normals[picture.triangle[::2, ::2][seen]]
    normals = np.where((normals @ camera.towards)[:, None] < 0.0, -normals, normals)
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
    heat = np.zeros(seen.shape)
    heat[seen] = share
    return heat.repeat(2, axis=0).repeat(2, axis=1)


def _painted(picture: Picture, surface: Surface, camera: Camera, colors: FloatArray) -> Image:
    """Return the lit object in colours of its pixels, shape (H, W, 3), with dark lines around it."""
    white = np.ones_like(surface.colors)
    image = np.float32(1.0 - _EVEN) * shade(picture, surface.normals, white, camera) + np.float32(_EVEN)
    seen = picture.triangle >= 0
    image[seen] *= colors[seen].astype(np.float32)
    image[borders(picture, surface.groups, 4e-3) & seen] *= np.float32(0.45)
    return image


def _dots(axes: Axes, touches: Sequence[_Touches], picture: Picture, camera: Camera) -> None:
    """Mark the visible contacts, with another mark for thumbs."""
    for of_thumb, mark in ((False, _FINGER), (True, _THUMB)):
        points = np.concatenate([np.empty((0, 3)), *(t.point[t.of_thumb == of_thumb] for t in touches)])
        shown = points[~is_hidden(picture.nearness, camera, points)]
        axes.plot(*(0.5 * camera.project(shown)[:, :2]).T, ls="", **mark)


def _explain(figure: Figure, hand: Hand, obj: GraspObject, count: int) -> None:
    from matplotlib.lines import Line2D

    width, height = figure.get_size_inches() * style.DPI
    grasps = f"{count} planned grasp{'' if count == 1 else 's'} touch{'es' if count == 1 else ''}"
    title = f"{hand.name} and {obj.name}: where {grasps} the object" if count else f"{obj.name}: no grasp was planned"
    style.write(figure, _GAP / width, 1.0 - 14 / height, title, fontsize=14, fontweight="bold", va="top")
    said = "From above and from below. All views have one scale."
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
