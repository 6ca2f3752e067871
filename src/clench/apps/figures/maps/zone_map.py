"""Draw the opposition zones of a hand on the open hand: where its pads come to face each other, and how far apart."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from clench.apps.figures.drawing import style
from clench.apps.figures.drawing.camera import Camera, fitted_camera, halved
from clench.apps.figures.drawing.stage import Stage
from clench.apps.figures.drawing.views import GAP, VIEW, frame_axes, hand_sides, scale_bar, show, two_views
from clench.core.pose import FloatArray
from clench.models.appearance import SolidKind
from clench.models.hand.hand import Hand
from clench.solver.preshapes.preshapes import APERTURES, Preshape, opposition_zones

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_TEXT: Final = 300
#: The hand is drawn paler than it would be, so that zones on it show [-].
_PALE: Final = 0.55
#: Colours of apertures, from the narrowest to the widest (viridis).
_COLORS: Final = "viridis"


def draw_zones(hand: Hand, path: Path) -> Path:
    """Write a picture of the opposition zones of a hand's preshapes, from two sides, on the open hand.

    For every preshape and every step of aperture, the zone that opposes best is drawn. A line runs from pad to pad, and
    a dot marks its middle, coloured by the aperture.

    Args:
        hand: the hand. path: of the file.

    Raises:
        FileError: the file cannot be written, or no figure has its ending.
    """
    style.check_figure(path)
    shapes = opposition_zones(hand)
    zones = np.array([zone for shape in shapes for zone in _best(shape)]).reshape(-1, 7)
    ends = _ends(zones)
    figure, views = two_views(_TEXT)
    directions, above = hand_sides(hand)
    with Stage.open(hand) as stage:
        focus = np.concatenate([stage.points(SolidKind.HAND), ends.reshape(-1, 3)])
        scale = min(fitted_camera(d, focus, VIEW, above=above).scale for d in directions)
        for axes, direction in zip(views, directions, strict=True):
            camera = fitted_camera(direction, focus, VIEW, scale, above)
            image = halved(stage.picture(camera.doubled(), without=(SolidKind.FOREARM,)).outlined())
            show(axes, (1.0 - _PALE) * image + _PALE, VIEW)
            _draw(axes, zones, ends, camera)
            frame_axes(axes, camera)
    scale_bar(views[0], scale)
    _explain(figure, hand, shapes, len(zones))
    return style.save_figure(figure, path)


def _best(shape: Preshape) -> Iterator[FloatArray]:
    """Yield centre, axis and aperture of the zone that opposes best, for every step of aperture, shape (7,)."""
    step = np.searchsorted(APERTURES, shape.aperture, side="right")
    for k in np.unique(step):
        rows = np.flatnonzero(step == k)
        best = rows[shape.quality[rows].argmax()]
        yield np.array([*shape.center[best], *shape.axis[best], shape.aperture[best]])


def _ends(zones: FloatArray) -> FloatArray:
    """Return where the pads of zones are [m], shape (Z, 2, 3)."""
    half = 0.5 * zones[:, 6:] * zones[:, 3:6]
    return np.stack([zones[:, :3] - half, zones[:, :3] + half], axis=1)


def _draw(axes: Axes, zones: FloatArray, ends: FloatArray, camera: Camera) -> None:
    """Draw the zones, the farthest ones first."""
    from matplotlib import colormaps

    colors = colormaps[_COLORS](zones[:, 6] / APERTURES[-1])
    flat, middle = camera.project(ends)[..., :2], camera.project(zones[:, :3])
    for k in np.argsort(middle[:, 2]).tolist():
        axes.plot(*flat[k].T, "-", color=style.PAPER, lw=2.6, alpha=0.6, solid_capstyle="round")
        axes.plot(*flat[k].T, "-", color=colors[k], lw=1.2, alpha=0.9, solid_capstyle="round")
    for k in np.argsort(middle[:, 2]).tolist():
        axes.plot(*middle[k, :2], "o", ms=5.5, mfc=colors[k], mec=style.PAPER, mew=0.9)


def _explain(figure: Figure, hand: Hand, shapes: tuple[Preshape, ...], count: int) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.lines import Line2D

    width, height = figure.get_size_inches() * style.DPI
    left = (2 * VIEW[0] + 3 * GAP) / width
    title = f"{hand.name}: where its pads come to face each other"
    style.write(figure, GAP / width, 1.0 - 16 / height, title, fontsize=14, fontweight="bold", va="top")
    said = f"{count} zones of {len(shapes)} preshapes as the fingers close; the hand is drawn open"
    said = said if count else "no two pads face each other"
    style.write(figure, GAP / width, 1.0 - 44 / height, said, fontsize=10, va="top", color=style.CHOSEN)
    place = figure.add_axes((left, 260 / height, 16 / width, (height - 380) / height))
    bar = figure.colorbar(ScalarMappable(Normalize(0.0, 1e3 * APERTURES[-1]), _COLORS), cax=place)
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=9, color=style.FAINT)
    style.write(figure, left, (height - 108) / height, "distance of the pads [mm]", fontsize=10, va="bottom")
    handles = [
        Line2D([], [], color=style.FAINT, marker="o", mec=style.PAPER, lw=1.2, label="from pad to pad, and the middle"),
        Line2D([], [], color=style.FAINT, marker=r"$\rightarrow$", ms=12, ls="", label="axes of the palm's frame"),
    ]
    figure.legend(handles=handles, loc="lower left", bbox_to_anchor=(left - 0.008, 0.08), fontsize=9, frameon=False)
