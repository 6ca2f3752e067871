"""Mark contacts in a view: dots, normals, and numbers beside hand and object, which they do not cover."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray
from clench.models.appearance import SolidKind
from clench.solver.solution import Contact

from . import style
from .camera import Camera, Image, Picture, halved
from .stage import Stage

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: How much of the hand shows through an object that hides contacts [-].
_THROUGH: Final = 0.5
#: Length of a normal [m].
_ARROW: Final = 0.016
#: Half the height of a label and half the width of one digit, with some room, and the width of a comma [px].
_HALF_HEIGHT: Final = 12
_DIGIT: Final = 8
#: Places for labels lie on a grid of this width [px].
_STEP: Final = 4
#: Labels stay so far from the border of a view [px].
_MARGIN: Final = 4
#: A label farther from its contact than this is better put where it covers something [px].
_FARTHEST: Final = 260.0
#: Contacts nearer to each other than this share a label [m].
_TOGETHER: Final = 1e-3


def photograph(stage: Stage, camera: Camera, points: FloatArray) -> tuple[Image, Picture, NDArray[np.bool_]]:
    """Return the smooth image of a view, the solids of its pixels, and which contacts are hidden.

    An object that hides contacts is translucent where the hand is behind it.

    Args:
        stage: the scene; the forearm is left out. camera: the view. points: contacts, shape (C, 3).
    """
    double = camera.doubled()
    front = stage.picture(double, without=(SolidKind.FOREARM,))
    hidden = front.hides(double, points, 4)
    image = front.outlined()
    if hidden.any():
        behind = stage.picture(double, without=(SolidKind.FOREARM, SolidKind.OBJECT))
        in_reach = hidden & ~behind.hides(double, points, 4)
        if in_reach.any():
            kinds = [solid.kind for solid in stage.solids]
            grasped = np.array([kind is SolidKind.OBJECT for kind in kinds] + [False])[front.solid]
            covered = grasped & np.array([kind is SolidKind.HAND for kind in kinds] + [False])[behind.solid]
            share = np.float32(_THROUGH)
            image[covered] = (1.0 - share) * image[covered] + share * behind.outlined()[covered]
    return halved(image), front, hidden


def mark_contacts(
    axes: Axes,
    camera: Camera,
    contacts: Sequence[Contact],
    hidden: NDArray[np.bool_],
    numbered: Sequence[int],
    free: NDArray[np.bool_],
) -> None:
    """Mark contacts with dots (rings where hidden) and their normals with arrows, and number some of them.

    Args:
        axes: of the view, in pixels. camera: the view. contacts: all. hidden: which are hidden, shape (C,).
        numbered: those that get a number in this view. free: pixels that labels may cover, shape (H, W).
    """
    if not contacts:
        return
    points = np.array([c.position for c in contacts])
    p = camera.project(points)[:, :2]
    tips = camera.project(points + _ARROW * np.array([c.normal for c in contacts]))[:, :2]
    groups = [shared for shared in _together(points) if set(shared) & set(numbered)]
    places = _places(p[[shared[0] for shared in groups]], [_half_width(shared) for shared in groups], free)
    for (x, y), shared in zip(places, groups, strict=True):
        start = p[shared[0]]
        for color, width, order in ((style.PAPER, 2.6, 5.4), (style.INK, 0.9, 5.5)):
            axes.plot([start[0], x], [start[1], y], "-", color=color, lw=width, zorder=order, solid_capstyle="butt")
        style.number_label(axes, (float(x), float(y)), [k + 1 for k in shared])
    for k, (x, y) in enumerate(p):
        alpha = 0.6 if hidden[k] else 1.0
        arrow = {"arrowstyle": "-|>", "color": style.CONTACT, "lw": 1.8, "alpha": alpha, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", tuple(tips[k]), (x, y), arrowprops=arrow, zorder=6)
        dot(axes, float(x), float(y), bool(hidden[k]))


def dot(axes: Axes, x: float, y: float, hidden: bool, size: float = 7.5) -> None:
    """Mark a contact in a view: a dot, or a ring where it is hidden."""
    look: dict[str, Any] = {"mfc": style.PAPER, "mec": style.CONTACT, "mew": 1.8}
    if not hidden:
        look = {"mfc": style.CONTACT, "mec": style.PAPER, "mew": 1.3}
    axes.plot(x, y, "o", ms=size, zorder=7, **look)


def _together(points: FloatArray) -> list[list[int]]:
    """Group points that are closer than a millimetre to the first of their group."""
    groups: list[list[int]] = []
    for k, point in enumerate(points):
        near = (g for g in groups if np.linalg.norm(points[g[0]] - point) < _TOGETHER)
        group = next(near, None)
        if group is None:
            groups.append([k])
        else:
            group.append(k)
    return groups


def _half_width(numbers: Sequence[int]) -> int:
    """Return half the width of the label of contacts [px]."""
    return 6 + _DIGIT * len(", ".join(str(k + 1) for k in numbers)) // 2


def _places(points: FloatArray, half_widths: Sequence[int], free: NDArray[np.bool_]) -> FloatArray:
    """Return where labels go: the nearest place at which each covers nothing but free pixels, shape (N, 2).

    Without such a place a label goes where it covers least.

    Args:
        points: that are labelled [px], shape (N, 2). half_widths: of the labels [px]. free: shape (H, W).
    """
    from scipy.ndimage import uniform_filter

    taken = ~free
    places = np.empty((len(points), 2))
    height, width = free.shape
    for k in np.argsort(points[:, 1], kind="stable") if len(points) else ():
        half = half_widths[k]
        covered = uniform_filter(taken.astype(np.float32), (2 * _HALF_HEIGHT + 1, 2 * half + 1), mode="nearest")
        rows = np.arange(_HALF_HEIGHT + _MARGIN, height - _HALF_HEIGHT - _MARGIN, _STEP)
        columns = np.arange(half + _MARGIN, width - half - _MARGIN, _STEP)
        away = np.hypot(rows[:, None] - points[k, 1], columns[None] - points[k, 0])
        cost = away + 3.0 * _FARTHEST * covered[np.ix_(rows, columns)] + np.where(away < 22.0, _FARTHEST, 0.0)
        row, column = np.unravel_index(int(np.argmin(cost)), cost.shape)
        places[k] = columns[column], rows[row]
        x, y = places[k].astype(int)
        taken[y - 2 * _HALF_HEIGHT : y + 2 * _HALF_HEIGHT, x - 2 * half : x + 2 * half] = True
    return places
