"""What figures of a hand from several sides share: layout, axes and scale."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from clench.core.pose import FloatArray
from clench.models.hand.hand import Hand
from clench.models.hand.understanding.finger_geometry import finger_line

from . import style
from .camera import Camera, Image

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


def hand_sides(hand: Hand) -> tuple[list[FloatArray], FloatArray]:
    """Return viewpoint and upward direction for an open hand: a little aslant of its palm and of its side."""
    q = hand.open_angles()
    fingers = [finger for finger in hand.fingers if not finger.is_thumb] or list(hand.fingers)
    lines = [finger_line(hand, finger, q) for finger in fingers]
    stretch = np.mean([line.tip - line.anchors[0] for line in lines], axis=0)
    return palm_views(hand.palm_normal, stretch)


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


def show(axes: Axes, image: Image, size: tuple[int, int]) -> None:
    """Fill axes with an image; their coordinates are pixels of a view of this size, rows downwards."""
    width, height = size
    axes.imshow(image, extent=(0, width, height, 0), interpolation="nearest")
    axes.set_xlim(0, width)
    axes.set_ylim(height, 0)
    axes.set_axis_off()


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
