"""The shared parts of figures of a hand from two sides: layout, camera, light, axes and scale."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from clench.core.pose import FloatArray

from . import style
from .raster import Camera, Image, Picture, borders, look_along, shade
from .surfaces import Surface

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Size of a view in pixels.
VIEW: Final = (590, 620)
#: Room between views [px].
GAP: Final = 20
_TOP: Final = 70
_BOTTOM: Final = 60


def palm_views(normal: FloatArray, stretch: FloatArray) -> tuple[list[FloatArray], FloatArray]:
    """Return the viewing direction of a hand, oblique to its palm and its side, and the up direction.

    Args:
        normal: of the palm, unit, shape (3,). stretch: along the fingers, shape (3,).
    """
    above = stretch - normal * (stretch @ normal)
    if np.linalg.norm(above) < 1e-6:
        above = np.eye(3)[int(np.argmin(np.abs(normal)))]
    above = above / np.linalg.norm(above)
    side = np.cross(above, normal)
    return [normal + 0.25 * side + 0.2 * above, side + 0.35 * normal + 0.2 * above], above


def two_views(text: int, below: int = 0) -> tuple[Figure, list[Axes]]:
    """Return a figure with two square views, room for text to the right of them, and room below, in pixels."""
    width, height = 2 * VIEW[0] + text + 4 * GAP, VIEW[1] + _TOP + _BOTTOM + below
    figure = style.new_figure(width, height)
    views = [
        figure.add_axes(
            (
                (GAP + k * (VIEW[0] + GAP)) / width,
                (_BOTTOM + below) / height,
                VIEW[0] / width,
                VIEW[1] / height,
            )
        )
        for k in range(2)
    ]
    return figure, views


def fitted_camera(
    towards: FloatArray,
    focus: FloatArray,
    size: tuple[int, int],
    scale: float | None = None,
    above: FloatArray | None = None,
) -> Camera:
    """Return a camera that shows all points of the focus, as large as the picture allows or at a given scale.

    Args:
        towards: from the scene to the viewer. focus: shape (N, 3) [m]. size: in pixels. scale: pixels per metre.
        above: the up direction of the picture; the world's z axis by default.
    """
    right, up, back = look_along(towards, np.array([0.0, 0.0, 1.0]) if above is None else above)
    across = np.column_stack([focus @ right, focus @ up])
    low, high = across.min(axis=0), across.max(axis=0)
    fitting = float((0.9 * np.array(size) / np.maximum(high - low, 1e-6)).min())
    middle = 0.5 * (low + high)
    center = right * middle[0] + up * middle[1]
    return Camera(right, up, back, center, scale or fitting, *size)


def lit(picture: Picture, surface: Surface, camera: Camera) -> Image:
    """Return a surface shaded, with dark lines around its bodies."""
    image = shade(picture, surface.normals, surface.colors, camera)
    edge = borders(picture, surface.groups, 4e-3) & (picture.triangle >= 0)
    image[edge] *= np.float32(0.45)
    return image


def frame_axes(axes: Axes, camera: Camera, height: int = VIEW[1]) -> None:
    """Draw the axes of the scene's frame in the lower left corner of a view of the given height."""
    origin = np.array([46.0, height - 46.0])
    for name, axis in zip("xyz", np.eye(3), strict=True):
        step = 32.0 * np.array([axis @ camera.right, -(axis @ camera.up)])
        if np.linalg.norm(step) < 14.0:
            continue  # it points at the viewer
        arrow = {"arrowstyle": "-|>", "color": style.FAINT, "lw": 1.2, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", tuple(origin + step), tuple(origin), arrowprops=arrow)
        place = origin + 1.3 * step
        style.write(axes, place[0], place[1], name, fontsize=9, color=style.FAINT, ha="center", va="center")


def scale_bar(axes: Axes, scale: float, size: tuple[int, int] = VIEW) -> None:
    """Draw a bar of a round number of millimetres in the lower right corner of a view.

    Args:
        axes: of the view. scale: pixels per metre. size: of the view in pixels.
    """
    length = next(mm for mm in (200, 100, 50, 20, 10, 5, 2, 1) if mm * 1e-3 * scale < 0.3 * size[0] or mm == 1)
    right, row = size[0] - 20.0, size[1] - 18.0
    left = right - length * 1e-3 * scale
    axes.plot([left, right], [row, row], "-", color=style.INK, lw=2.5, solid_capstyle="butt")
    style.write(axes, 0.5 * (left + right), row - 8.0, f"{length} mm", fontsize=9, ha="center")


def frame_panel(axes: Axes) -> None:
    """Replace the ticks and spines of a panel by a thin border."""
    from matplotlib.patches import Rectangle

    axes.set_axis_off()
    border = Rectangle((0, 0), 1, 1, transform=axes.transAxes, fill=False, edgecolor="#cccccc", linewidth=1.0)
    border.set_clip_on(False)
    axes.add_artist(border)
