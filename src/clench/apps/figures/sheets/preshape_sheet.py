"""Draw the preshapes of a hand side by side, each with the axis along which its pads oppose best."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from clench.apps.figures.drawing import style
from clench.apps.figures.drawing.camera import Camera, fitted_camera, halved
from clench.apps.figures.drawing.stage import Stage
from clench.apps.figures.drawing.views import GAP, show
from clench.closing.motion import open_posture
from clench.core.pose import FloatArray, Pose
from clench.models.appearance import Solid, hand_solids
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.shapes import CollisionSource

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from clench.solver.preshapes.preshapes import Preshape

#: Size of one picture, and room for its text [px].
_TILE: Final = (220, 220)
_TEXT: Final = 38
_HEAD: Final = 40
_PER_ROW: Final = 7
#: Round shapes are off by at most this in so small pictures [m].
_COARSE: Final = 5e-4


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
    solids = hand_solids(hand, source, _COARSE)
    poses = [_posed(hand, solids, shape) for shape in preshapes]
    own = [hand.palm, *(i for finger in hand.fingers for i in finger.links)]
    kept = [k for k, solid in enumerate(solids) if solid.index in own]
    points = [p[k][:3, :3] @ solids[k].mesh.vertices.T + p[k][:3, 3:] for p in poses for k in kept]
    if not points:
        return
    focus = np.concatenate([corners.T for corners in points])
    scale = min(fitted_camera(d, focus, _TILE, above=above).scale for d in directions)
    with Stage(solids, poses[0]) as stage:
        for number, (shape, posed) in enumerate(zip(preshapes, poses, strict=True)):
            stage.pose(posed)
            row, column = divmod(number, _PER_ROW)
            left = GAP + column * (_TILE[0] + GAP)
            bottom = top - _HEAD - row * (_TILE[1] + _TEXT) - _TILE[1]
            axes = figure.add_axes((left / width, bottom / height, _TILE[0] / width, _TILE[1] / height))
            camera = fitted_camera(_best_view(shape, directions), focus, _TILE, scale, above)
            show(axes, halved(stage.picture(camera.doubled()).outlined()), _TILE)
            _draw_axis(axes, shape, camera)
            style.write(figure, left / width, (bottom - 2) / height, _caption(shape), fontsize=8, va="top")


def _posed(hand: Hand, solids: Sequence[Solid], shape: Preshape) -> FloatArray:
    """Return where solids are in the palm's frame at a preshape, shape (N, 4, 4)."""
    poses = hand.link_poses(open_posture(hand, GraspCommand(Pose.identity(), preshape=shape.angles)))
    found: FloatArray = poses[[solid.index for solid in solids]]
    return found


def best_zone(shape: Preshape) -> int | None:
    """Return the number of the zone whose pads oppose best; None without zones."""
    return int(shape.quality.argmax()) if len(shape.quality) else None


def _best_view(shape: Preshape, directions: Sequence[FloatArray]) -> FloatArray:
    """Return the direction to which the axis of a preshape is most across."""
    zone = best_zone(shape)
    if zone is None:
        return directions[0]
    return min(directions, key=lambda d: abs(float(d @ shape.axis[zone])) / float(np.linalg.norm(d)))


def _draw_axis(axes: Axes, shape: Preshape, camera: Camera) -> None:
    zone = best_zone(shape)
    if zone is not None:
        half = 0.5 * shape.aperture[zone] * shape.axis[zone]
        ends = camera.project(np.array([shape.center[zone] - half, shape.center[zone] + half]))[:, :2]
        axes.plot(*ends.T, "-", color=style.PAPER, lw=4.5, solid_capstyle="round")
        axes.plot(*ends.T, "-o", color=style.CONTACT, lw=2.2, ms=5)


def _caption(shape: Preshape) -> str:
    if best_zone(shape) is None:
        return f"{shape.name}\nno two sides oppose"
    low, high = shape.aperture.min() * 1e3, shape.aperture.max() * 1e3
    return f"{shape.name}\n{low:z.0f} to {high:z.0f} mm, opposition {shape.quality.max():z.2f}"
