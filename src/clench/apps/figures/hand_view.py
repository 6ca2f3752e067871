"""Draw hand, object and contacts from two sides."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.solution import Contact, GraspSolution

from . import style
from .raster import Camera, Image, halved, rasterise
from .surfaces import COARSE, OBJECT_COLOR, PALM_COLOR, Surface, hand_surface, object_surface
from .views import GAP, VIEW, fitted_camera, frame_axes, lit, scale_bar, two_views

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_TEXT: Final = 330
#: A contact farther than this behind the nearest surface is hidden [m].
_HIDDEN: Final = 2e-3
_ARROW: Final = 0.016
#: Opacity of the hand behind the object [-].
_THROUGH: Final = 0.3


def draw_hand(hand: Hand, obj: GraspObject, solution: GraspSolution, path: Path) -> Path:
    """Write a figure of the closed hand on the object from two sides, with every contact and its normal."""
    body, things = hand_surface(hand, solution), object_surface(obj, solution)
    figure, views = two_views(_TEXT)
    coarse = (hand_surface(hand, solution, COARSE).corners, object_surface(obj, solution, COARSE).corners)
    focus = focus_of(*coarse)
    directions = viewpoints(*coarse, focus, solution)
    scale = min(fitted_camera(d, focus, VIEW).scale for d in directions)
    for axes, direction in zip(views, directions, strict=True):
        double = fitted_camera(direction, focus, (2 * VIEW[0], 2 * VIEW[1]), 2.0 * scale)
        image, nearness = render(body, things, double)
        axes.imshow(halved(image), extent=(0, VIEW[0], VIEW[1], 0), interpolation="nearest")
        camera = fitted_camera(direction, focus, VIEW, scale)
        _mark(axes, camera, nearness[::2, ::2], solution.contacts)
        frame_axes(axes, camera)
        axes.set_xlim(0, VIEW[0])
        axes.set_ylim(VIEW[1], 0)
        axes.set_axis_off()
    scale_bar(views[0], scale)
    _explain(figure, hand, solution)
    return style.save_figure(figure, path)


def focus_of(body: FloatArray, things: FloatArray, near: float = 0.5) -> FloatArray:
    """Return the points that must be visible: the hand, and the part of the object near the hand, shape (N, 3).

    Args:
        body, things: corners of hand and object [m]. near: how far from the hand, as a share of its size [-].
    """
    hand, others = body.reshape(-1, 3), things.reshape(-1, 3)
    if not len(hand) or not len(others):
        return hand if len(hand) else others
    low, high = hand.min(axis=0), hand.max(axis=0)
    reach = near * float((high - low).max())
    seen = ((others >= low - reach) & (others <= high + reach)).all(axis=1)
    return np.concatenate([hand, others[seen]])


def viewpoints(body: FloatArray, things: FloatArray, focus: FloatArray, solution: GraspSolution) -> list[FloatArray]:
    """Choose two directions that show contacts and object well, at least 60 degrees from each other.

    Args:
        body, things: corners of hand and object [m], shape (T, 3, 3). focus: points that must be seen, shape (N, 3).
    """
    directions = around()
    points = np.array([c.position for c in solution.contacts if not c.passed]).reshape(-1, 3)
    corners = np.concatenate([body, things])
    scores = np.array([_score(corners, len(body), fitted_camera(d, focus, (140, 140)), points) for d in directions])
    first = int(np.argmax(scores))
    apart = directions @ directions[first] < 0.5
    second = int(np.argmax(np.where(apart, scores, -np.inf)))
    return [directions[first], directions[second]]


def around() -> FloatArray:
    """Return directions to viewers all around, from above and from below, unit vectors of shape (16, 3)."""
    azimuth = 0.2 + np.arange(16) * (np.pi / 8.0)  # off the diagonals, where two world axes would coincide
    heights = np.array([0.3, 0.7, 0.0, -0.4])[np.arange(16) % 4]
    level = np.sqrt(1.0 - heights**2)
    return np.column_stack([level * np.cos(azimuth), level * np.sin(azimuth), heights])


def _score(corners: FloatArray, hand: int, camera: Camera, points: FloatArray) -> float:
    """Return how well a view shows a grasp: share of contacts not hidden, their spread, share of the object in it."""
    picture = rasterise(corners, camera)
    seen = int(np.count_nonzero(picture.triangle >= 0))
    score = int(np.count_nonzero(picture.triangle >= hand)) / max(seen, 1)
    if len(points):
        score += float((~is_hidden(picture.nearness, camera, points)).mean())
        score += float(np.ptp(camera.project(points)[:, :2], axis=0).sum()) / camera.width
    return score


def is_hidden(nearness: FloatArray, camera: Camera, points: FloatArray) -> NDArray[np.bool_]:
    """Say which points lie behind the visible surface at their pixel, shape (N,)."""
    p = camera.project(points)
    column = np.clip(p[:, 0].astype(np.int64), 0, camera.width - 1)
    row = np.clip(p[:, 1].astype(np.int64), 0, camera.height - 1)
    result: NDArray[np.bool_] = nearness[row, column] > p[:, 2] + _HIDDEN
    return result


def render(body: Surface, things: Surface, camera: Camera, through: float = _THROUGH) -> tuple[Image, FloatArray]:
    """Return the picture, shape (H, W, 3), and the nearness of the visible surface [m].

    Args:
        body, things: hand and object. camera: see `Camera`. through: how much the hand shows through the object [-].
    """
    front, back = rasterise(things.corners, camera), rasterise(body.corners, camera)
    image = lit(back, body, camera)
    over = lit(front, things, camera)
    alone = (front.triangle >= 0) & (back.triangle < 0)
    covered = (front.nearness > back.nearness) & (back.triangle >= 0)
    image[alone] = over[alone]
    image[covered] = (1.0 - through) * over[covered] + through * image[covered]
    return image, np.maximum(front.nearness, back.nearness)


def _mark(axes: Axes, camera: Camera, nearness: FloatArray, contacts: Sequence[Contact]) -> None:
    """Mark contacts with dots (rings where hidden), their normals with arrows, and number them."""
    if not contacts:
        return
    points = np.array([c.position for c in contacts])
    normals = np.array([c.normal for c in contacts])
    hidden = is_hidden(nearness, camera, points)
    p = camera.project(points)[:, :2]
    tips = camera.project(points + _ARROW * normals)[:, :2]
    for k, (x, y) in enumerate(p):
        alpha = 0.55 if hidden[k] else 1.0
        arrow = {"arrowstyle": "-|>", "color": style.CONTACT, "lw": 1.8, "alpha": alpha, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", tuple(tips[k]), (x, y), arrowprops=arrow, zorder=5)
        face = style.PAPER if hidden[k] else style.CONTACT
        axes.plot(x, y, "o", ms=8, mfc=face, mec=style.CONTACT if hidden[k] else style.PAPER, mew=1.6, zorder=6)
    shared = _together(points)
    firsts = [numbers[0] for numbers in shared]
    for (x, y), numbers in zip(_labels(p[firsts], tips[firsts]), shared, strict=True):
        axes.plot([p[numbers[0], 0], x], [p[numbers[0], 1], y], "-", color=style.INK, lw=0.8, zorder=5.5)
        style.number_label(axes, (float(x), float(y)), [k + 1 for k in numbers])


def _together(points: FloatArray) -> list[list[int]]:
    """Group points that are closer than a millimetre to the first of their group."""
    groups: list[list[int]] = []
    for k, point in enumerate(points):
        near = (g for g in groups if np.linalg.norm(points[g[0]] - point) < 1e-3)
        group = next(near, None)
        if group is None:
            groups.append([k])
        else:
            group.append(k)
    return groups


def _labels(points: FloatArray, tips: FloatArray) -> FloatArray:
    """Place labels near their points and off the arrows, pushed apart until none overlap, shape (N, 2) in pixels."""
    middle = points.mean(axis=0)
    away = points - middle
    size = np.linalg.norm(away, axis=1, keepdims=True)
    spread = np.column_stack([np.cos(np.arange(len(points))), np.sin(np.arange(len(points)))])
    away = np.where(size > 1.0, away / np.maximum(size, 1.0), spread)
    places = points + 30.0 * away + 1e-3 * spread
    fixed = np.vstack([points, tips])
    for _ in range(80):
        push = np.zeros_like(places)
        for others, room in ((places, 34.0), (fixed, 18.0)):
            gap = places[:, None] - others[None]
            distance = np.linalg.norm(gap, axis=2)
            close = (distance < room) & (distance > 0.0)
            push += (np.where(close, (room - distance) / np.maximum(distance, 1e-9), 0.0)[..., None] * gap).sum(axis=1)
        if not push.any():
            break
        places = places + 0.4 * push
    margin = 14.0
    bounded: FloatArray = np.clip(places, margin, np.array(VIEW) - margin)
    return bounded


def _explain(figure: Figure, hand: Hand, solution: GraspSolution) -> None:
    width, height = figure.get_size_inches() * style.DPI
    left = (2 * VIEW[0] + 3 * GAP) / width
    title = f"{solution.hand} and {solution.object}: the closed hand from two sides"
    style.write(figure, GAP / width, 1.0 - 16 / height, title, fontsize=14, fontweight="bold", va="top")
    text = str(solution.reason.get("text", ""))
    answer = f"{solution.status.value.replace('_', ' ')}{': ' if text else ''}{text}"
    style.write(figure, GAP / width, 1.0 - 44 / height, answer, fontsize=10, va="top", color=style.CHOSEN)
    row = 70.0

    def line(words: str, step: float, **options: Any) -> None:
        nonlocal row
        style.write(figure, left, 1.0 - row / height, words, va="top", **options)
        row += step

    line("Contacts", 20.0, fontsize=11, fontweight="bold")
    step = min(17.0, (height - 250.0) / max(len(solution.contacts), 1))
    for k, c in enumerate(solution.contacts):
        passed = " (opened again)" if c.passed else ""
        line(f"{k + 1}  {c.link}{passed}", step, fontsize=min(10.0, 0.6 * step), color=style.CONTACT)
    if not solution.contacts:
        line("none", 17.0)
    _legend(figure, left - 0.004)


def _legend(figure: Figure, left: float) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    names = ("first closing joint", "second", "third")
    handles: list[Any] = [Patch(facecolor=PALM_COLOR, label="palm and what does not close")]
    for k, name in enumerate(names):
        color = style.mixed(style.joint_color(k), style.PAPER, 0.3)
        handles.append(Patch(facecolor=color, label=f"links after the {name}" + ("" if k == 0 else " closing joint")))
    handles += [
        Patch(facecolor=OBJECT_COLOR, label="object (the hand shows through)"),
        Line2D([], [], color=style.CONTACT, marker="o", ls="", label="contact, and its number"),
        Line2D([], [], color=style.CONTACT, marker="o", mfc=style.PAPER, ls="", label="contact, hidden from this side"),
        Line2D([], [], color=style.CONTACT, marker=r"$\rightarrow$", ms=12, ls="", label="normal, out of the object"),
        Line2D([], [], color=style.FAINT, marker=r"$\rightarrow$", ms=12, ls="", label="axes of the world frame"),
    ]
    figure.legend(handles=handles, loc="lower left", bbox_to_anchor=(left, 0.02), fontsize=9, frameon=False)
