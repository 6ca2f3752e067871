"""Draw hand, object and contacts from two sides."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.base.pose import FloatArray
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solve.solution import Contact, GraspSolution

from . import style
from .raster import Camera, Image, Picture, borders, halved, look_along, rasterise, shade
from .surfaces import COARSE, OBJECT_COLOR, PALM_COLOR, Surface, hand_surface, object_surface

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_VIEW: Final = (590, 620)
_TEXT: Final = 330
_GAP: Final = 20
_TOP: Final = 70
_BOTTOM: Final = 60
#: A contact farther than this behind the nearest surface is hidden [m].
_HIDDEN: Final = 2e-3
_ARROW: Final = 0.016
#: How much of the hand shows through the object in front of it [-].
_THROUGH: Final = 0.3


def draw_hand(hand: Hand, obj: GraspObject, solution: GraspSolution, path: Path) -> Path:
    """Write a figure of the closed hand on the object from two sides, with every contact and its normal."""
    body, things = hand_surface(hand, solution), object_surface(obj, solution)
    figure, views = _layout()
    coarse = (hand_surface(hand, solution, COARSE).corners, object_surface(obj, solution, COARSE).corners)
    focus = _focus(*coarse)
    directions = viewpoints(*coarse, focus, solution)
    scale = min(_camera(d, focus, _VIEW).scale for d in directions)
    for axes, direction in zip(views, directions, strict=True):
        image, nearness = render(body, things, _camera(direction, focus, (2 * _VIEW[0], 2 * _VIEW[1]), 2.0 * scale))
        axes.imshow(halved(image), extent=(0, _VIEW[0], _VIEW[1], 0), interpolation="nearest")
        camera = _camera(direction, focus, _VIEW, scale)
        _mark(axes, camera, nearness[::2, ::2], solution.contacts)
        _world_axes(axes, camera)
        axes.set_xlim(0, _VIEW[0])
        axes.set_ylim(_VIEW[1], 0)
        axes.set_axis_off()
    _scale_bar(views[0], scale)
    _explain(figure, hand, solution)
    return style.save_figure(figure, path)


def _focus(body: FloatArray, things: FloatArray) -> FloatArray:
    """Return the points that must be seen: the hand, and the object as far as it is near the hand, shape (N, 3)."""
    hand, others = body.reshape(-1, 3), things.reshape(-1, 3)
    if not len(hand) or not len(others):
        return hand if len(hand) else others
    low, high = hand.min(axis=0), hand.max(axis=0)
    reach = 0.5 * float((high - low).max())
    near = ((others >= low - reach) & (others <= high + reach)).all(axis=1)
    return np.concatenate([hand, others[near]])


def _camera(towards: FloatArray, focus: FloatArray, size: tuple[int, int], scale: float | None = None) -> Camera:
    """Return a camera that shows all points of the focus, as large as the picture allows or at a given scale."""
    right, up, back = look_along(towards, np.array([0.0, 0.0, 1.0]))
    across = np.column_stack([focus @ right, focus @ up])
    low, high = across.min(axis=0), across.max(axis=0)
    fitting = float((0.9 * np.array(size) / np.maximum(high - low, 1e-6)).min())
    middle = 0.5 * (low + high)
    center = right * middle[0] + up * middle[1]
    return Camera(right, up, back, center, scale or fitting, *size)


def viewpoints(body: FloatArray, things: FloatArray, focus: FloatArray, solution: GraspSolution) -> list[FloatArray]:
    """Choose two directions that show contacts and object well, at least 60 degrees from each other.

    Args:
        body, things: corners of hand and object [m], shape (T, 3, 3). focus: points that must be seen, shape (N, 3).
    """
    azimuth = 0.2 + np.arange(16) * (np.pi / 8.0)  # off the diagonals, where two world axes would coincide
    heights = np.array([0.3, 0.7, 0.0, -0.4])[np.arange(16) % 4]
    level = np.sqrt(1.0 - heights**2)
    directions = np.column_stack([level * np.cos(azimuth), level * np.sin(azimuth), heights])
    points = np.array([c.position for c in solution.contacts if not c.passed]).reshape(-1, 3)
    corners = np.concatenate([body, things])
    scores = np.array([_score(corners, len(body), _camera(d, focus, (140, 140)), points) for d in directions])
    first = int(np.argmax(scores))
    apart = directions @ directions[first] < 0.5
    second = int(np.argmax(np.where(apart, scores, -np.inf)))
    return [directions[first], directions[second]]


def _score(corners: FloatArray, hand: int, camera: Camera, points: FloatArray) -> float:
    """Return how well a view shows a grasp: share of contacts not hidden, their spread, share of the object in it."""
    picture = rasterise(corners, camera)
    seen = int(np.count_nonzero(picture.triangle >= 0))
    score = int(np.count_nonzero(picture.triangle >= hand)) / max(seen, 1)
    if len(points):
        score += float((~_hidden(picture.nearness, camera, points)).mean())
        score += float(np.ptp(camera.project(points)[:, :2], axis=0).sum()) / camera.width
    return score


def _hidden(nearness: FloatArray, camera: Camera, points: FloatArray) -> NDArray[np.bool_]:
    """Say which points lie behind what is seen at their pixel, shape (N,)."""
    p = camera.project(points)
    column = np.clip(p[:, 0].astype(np.int64), 0, camera.width - 1)
    row = np.clip(p[:, 1].astype(np.int64), 0, camera.height - 1)
    result: NDArray[np.bool_] = nearness[row, column] > p[:, 2] + _HIDDEN
    return result


def render(body: Surface, things: Surface, camera: Camera) -> tuple[Image, FloatArray]:
    """Return the picture, shape (H, W, 3), and the nearness of what is seen [m]; the hand shows through the object."""
    front, back = rasterise(things.corners, camera), rasterise(body.corners, camera)
    image = _lit(back, body, camera)
    over = _lit(front, things, camera)
    alone = (front.triangle >= 0) & (back.triangle < 0)
    covered = (front.nearness > back.nearness) & (back.triangle >= 0)
    image[alone] = over[alone]
    image[covered] = (1.0 - _THROUGH) * over[covered] + _THROUGH * image[covered]
    return image, np.maximum(front.nearness, back.nearness)


def _lit(picture: Picture, surface: Surface, camera: Camera) -> Image:
    image = shade(picture, surface.normals, surface.colors, camera)
    edge = borders(picture, surface.groups, 4e-3) & (picture.triangle >= 0)
    image[edge] *= np.float32(0.45)
    return image


def _layout() -> tuple[Figure, list[Axes]]:
    width, height = 2 * _VIEW[0] + _TEXT + 4 * _GAP, _VIEW[1] + _TOP + _BOTTOM
    figure = style.new_figure(width, height)
    views = [
        figure.add_axes(
            (
                (_GAP + k * (_VIEW[0] + _GAP)) / width,
                _BOTTOM / height,
                _VIEW[0] / width,
                _VIEW[1] / height,
            )
        )
        for k in range(2)
    ]
    return figure, views


def _mark(axes: Axes, camera: Camera, nearness: FloatArray, contacts: Sequence[Contact]) -> None:
    """Mark contacts with dots (rings where hidden), their normals with arrows, and number them."""
    if not contacts:
        return
    points = np.array([c.position for c in contacts])
    normals = np.array([c.normal for c in contacts])
    hidden = _hidden(nearness, camera, points)
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
    bounded: FloatArray = np.clip(places, margin, np.array(_VIEW) - margin)
    return bounded


def _world_axes(axes: Axes, camera: Camera) -> None:
    """Draw the directions of the world's axes in the lower left corner."""
    origin = np.array([46.0, _VIEW[1] - 46.0])
    for name, axis in zip("xyz", np.eye(3), strict=True):
        step = 32.0 * np.array([axis @ camera.right, -(axis @ camera.up)])
        if np.linalg.norm(step) < 14.0:
            continue  # it points at the viewer
        arrow = {"arrowstyle": "-|>", "color": style.FAINT, "lw": 1.2, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", tuple(origin + step), tuple(origin), arrowprops=arrow)
        place = origin + 1.3 * step
        style.write(axes, place[0], place[1], name, fontsize=9, color=style.FAINT, ha="center", va="center")


def _scale_bar(axes: Axes, scale: float) -> None:
    length = next(mm for mm in (200, 100, 50, 20, 10, 5, 2, 1) if mm * 1e-3 * scale < 0.3 * _VIEW[0] or mm == 1)
    right, row = _VIEW[0] - 20.0, _VIEW[1] - 18.0
    left = right - length * 1e-3 * scale
    axes.plot([left, right], [row, row], "-", color=style.INK, lw=2.5, solid_capstyle="butt")
    style.write(axes, 0.5 * (left + right), row - 8.0, f"{length} mm", fontsize=9, ha="center")


def _explain(figure: Figure, hand: Hand, solution: GraspSolution) -> None:
    width, height = figure.get_size_inches() * style.DPI
    left = (2 * _VIEW[0] + 3 * _GAP) / width
    title = f"{solution.hand} and {solution.object}: the closed hand from two sides"
    style.write(figure, _GAP / width, 1.0 - 16 / height, title, fontsize=14, fontweight="bold", va="top")
    text = str(solution.reason.get("text", ""))
    answer = f"{solution.status.value.replace('_', ' ')}{': ' if text else ''}{text}"
    style.write(figure, _GAP / width, 1.0 - 44 / height, answer, fontsize=10, va="top", color=style.CHOSEN)
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
