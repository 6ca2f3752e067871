"""Draw the preshapes of a hand side by side, each with the axis along which its pads oppose best."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from clench.closing.motion import open_posture
from clench.core.pose import FloatArray, Pose
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.shapes import CollisionSource

from . import style
from .raster import Camera, halved, rasterise
from .surfaces import COARSE, Surface, posed_surface
from .views import GAP, fitted_camera, lit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from clench.solver.preshapes.preshapes import Preshape

#: Size of one picture, and room for its text [px].
_TILE: Final = (220, 220)
_TEXT: Final = 38
_HEAD: Final = 40
_PER_ROW: Final = 7


def sheet_height(count: int) -> int:
    """Return the height that so many preshapes take [px]."""
    return _HEAD + -(-count // _PER_ROW) * (_TILE[1] + _TEXT) + GAP if count else 0


def draw_preshapes(
    figure: Figure,
    hand: Hand,
    preshapes: Sequence[Preshape],
    source: CollisionSource,
    directions: Sequence[FloatArray],
    above: FloatArray,
) -> None:
    """Draw preshapes in rows at the bottom of a figure, which has `sheet_height` for them.

    Args:
        figure: to draw in. hand: the hand. preshapes: to draw. source: geometry to draw.
        directions: from the hand to the viewer; every preshape is seen from where its axis shows best.
        above: the up direction.
    """
    if not preshapes:
        return
    width, height = figure.get_size_inches() * style.DPI
    top = float(sheet_height(len(preshapes)))
    title = "preshapes, before the fingers close: the axis along which the pads oppose best on the way"
    style.write(figure, GAP / width, (top - 8) / height, title, fontsize=12, fontweight="bold", va="top")
    own = [hand.palm, *(i for finger in hand.fingers for i in finger.links)]
    surfaces = [
        posed_surface(
            hand, open_posture(hand, GraspCommand(Pose.identity(), preshape=shape.angles)), source, np.eye(4), COARSE
        )
        for shape in preshapes
    ]
    focus = np.concatenate([s.corners[np.isin(s.groups, own)].reshape(-1, 3) for s in surfaces])
    if not len(focus):
        return
    scale = min(fitted_camera(d, focus, _TILE, above=above).scale for d in directions)
    for number, (shape, surface) in enumerate(zip(preshapes, surfaces, strict=True)):
        row, column = divmod(number, _PER_ROW)
        left = GAP + column * (_TILE[0] + GAP)
        bottom = top - _HEAD - row * (_TILE[1] + _TEXT) - _TILE[1]
        axes = figure.add_axes((left / width, bottom / height, _TILE[0] / width, _TILE[1] / height))
        camera = fitted_camera(_best_view(shape, directions), focus, _TILE, scale, above)
        _draw_tile(axes, shape, surface, camera)
        style.write(figure, left / width, (bottom - 2) / height, _caption(shape), fontsize=8, va="top")


def best_zone(shape: Preshape) -> int | None:
    """Return the number of the zone whose pads oppose best; None without zones."""
    return int(shape.quality.argmax()) if len(shape.quality) else None


def _best_view(shape: Preshape, directions: Sequence[FloatArray]) -> FloatArray:
    """Return the direction to which the axis of a preshape is most across."""
    zone = best_zone(shape)
    if zone is None:
        return directions[0]
    return min(directions, key=lambda d: abs(float(d @ shape.axis[zone])) / float(np.linalg.norm(d)))


def _draw_tile(axes: Axes, shape: Preshape, surface: Surface, camera: Camera) -> None:
    double = Camera(
        camera.right, camera.up, camera.towards, camera.center, 2.0 * camera.scale, 2 * camera.width, 2 * camera.height
    )
    image = halved(lit(rasterise(surface.corners, double), surface, double))
    axes.imshow(image, extent=(0, _TILE[0], _TILE[1], 0), interpolation="nearest")
    zone = best_zone(shape)
    if zone is not None:
        half = 0.5 * shape.aperture[zone] * shape.axis[zone]
        ends = camera.project(np.array([shape.center[zone] - half, shape.center[zone] + half]))[:, :2]
        axes.plot(*ends.T, "-", color=style.PAPER, lw=4.5, solid_capstyle="round")
        axes.plot(*ends.T, "-o", color=style.CONTACT, lw=2.2, ms=5)
    axes.set_xlim(0, _TILE[0])
    axes.set_ylim(_TILE[1], 0)
    axes.set_axis_off()


def _caption(shape: Preshape) -> str:
    if best_zone(shape) is None:
        return f"{shape.name}\nno two sides oppose"
    low, high = shape.aperture.min() * 1e3, shape.aperture.max() * 1e3
    return f"{shape.name}\n{low:.0f} to {high:.0f} mm, opposition {shape.quality.max():.2f}"
