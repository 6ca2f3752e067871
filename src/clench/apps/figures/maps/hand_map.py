"""Draw the interpretation of a hand: joint axes, roles, closing directions and curl planes, from two sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from clench.apps.figures.drawing import style
from clench.apps.figures.drawing.camera import Camera, Image, fitted_camera, halved
from clench.apps.figures.drawing.stage import Stage
from clench.apps.figures.drawing.views import GAP, VIEW, frame_axes, palm_views, scale_bar, show, two_views
from clench.apps.figures.sheets.preshape_sheet import draw_preshapes, sheet_height
from clench.closing.finger_plan import closing_joints, plan_finger
from clench.core.pose import FloatArray
from clench.models.appearance import PALM_COLOR
from clench.models.hand.hand import Finger, Hand, JointRole
from clench.models.hand.understanding.finger_geometry import finger_line
from clench.models.shapes import CollisionSource

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from clench.solver.preshapes.preshapes import Preshape

_TEXT: Final = 450
#: Half the length at which an axis is drawn, as a share of the hand's size [-].
_AXIS: Final = 0.045
#: Drawn length of the palm's normal, as a share of the hand's size [-].
_NORMAL: Final = 0.18
_STEPS: Final = 24
_PLANES: Final = 3
#: The hand is drawn paler than it would be, so that lines on it show [-].
_PALE: Final = 0.35


@dataclass(frozen=True, eq=False)
class FingerMap:
    """The drawn geometry of a finger, in the palm frame [m].

    Args:
        finger: which. axes: of every own joint, from and to, shape (n, 2, 3). base: the first closing joint, (3,).
        paths: of the tip while all closing joints close in step, one per curl plane, shape (P, S, 3).
    """

    finger: Finger
    axes: FloatArray
    base: FloatArray
    paths: FloatArray


def draw_hand_map(
    hand: Hand, path: Path, source: CollisionSource | None = None, preshapes: Sequence[Preshape] = ()
) -> Path:
    """Write a picture of the open hand with its joint axes, roles, closing directions and curl planes.

    Args:
        hand: see `Hand.load`. path: PNG file. source: geometry to draw; None is the hand's default.
        preshapes: are drawn below, each with the axis along which its pads oppose best.

    Raises:
        FileError: the file cannot be written.
    """
    chosen = hand.default_source if source is None else CollisionSource(source)
    with Stage.open(hand, chosen) as stage:
        corners = _own_points(hand, stage)
        size = float(np.ptp(corners, axis=0).max()) if len(corners) else 0.1
        maps = [_map_finger(hand, finger, chosen, _AXIS * size) for finger in hand.fingers]
        lines = [points.reshape(-1, 3) for m in maps for points in (m.paths, m.axes)]
        focus = np.concatenate([corners, *lines])
        below = sheet_height(len(preshapes))
        figure, views = two_views(_TEXT, below)
        directions, above = _directions(hand, maps)
        scale = min(fitted_camera(d, focus, VIEW, above=above).scale for d in directions)
        for axes, direction in zip(views, directions, strict=True):
            camera = fitted_camera(direction, focus, VIEW, scale, above)
            image = halved(stage.picture(camera.doubled()).outlined())
            _draw_view(axes, hand, maps, image, camera, _NORMAL * size)
    for m in maps:
        _name_finger(views[0], m, fitted_camera(directions[0], focus, VIEW, scale, above))
    scale_bar(views[0], scale)
    _explain(figure, hand, maps, below)
    draw_preshapes(figure, hand, preshapes, chosen, directions, above)
    return style.save_figure(figure, path)


def _own_points(hand: Hand, stage: Stage) -> FloatArray:
    """Return points of palm and fingers, shape (N, 3): an arm may leave the picture."""
    own = [hand.palm, *(i for finger in hand.fingers for i in finger.links)]
    return stage.points_of([k for k, solid in enumerate(stage.solids) if solid.index in own])


def _map_finger(hand: Hand, finger: Finger, source: CollisionSource, half: float) -> FingerMap:
    q = hand.open_angles()
    line = finger_line(hand, finger, q)
    axes = np.stack([line.anchors - half * line.axes, line.anchors + half * line.axes], axis=1)
    closing = closing_joints(hand, finger)
    base = line.anchors[finger.joints.index(closing[0]) if closing else 0]
    tips = []
    for share in np.linspace(0.0, 1.0, _STEPS):
        at = q.copy()
        for j in closing:
            joint = hand.joints[j]
            at[j] += share * ((joint.upper if joint.direction > 0 else joint.lower) - at[j])
        tips.append(finger_line(hand, finger, hand.coupled(at)).tip)
    path = np.array(tips)
    return FingerMap(finger, axes, base, _in_planes(hand, finger, source, path) if closing else path[None])


def _in_planes(hand: Hand, finger: Finger, source: CollisionSource, path: FloatArray) -> FloatArray:
    """Return the tip's path carried over to every curl plane, shape (P, S, 3); with several axis groups the path
    alone.
    """
    axis_groups = plan_finger(hand, finger, hand.open_angles(), _PLANES, source).axis_groups
    if len(axis_groups) > 1:
        return path[None]
    T = axis_groups[0].T_palm_axis_group
    own = (path - T[:3, 3]) @ T[:3, 1]
    return np.stack([path + (offset - own)[:, None] * T[:3, 1] for offset in axis_groups[0].offsets])


def _directions(hand: Hand, maps: list[FingerMap]) -> tuple[list[FloatArray], FloatArray]:
    """Return the viewing direction of the hand, oblique to its palm and its side, and the up direction."""
    fingers = [m for m in maps if not m.finger.is_thumb] or maps
    stretch = np.mean([m.paths[:, 0].mean(axis=0) - m.base for m in fingers], axis=0)
    return palm_views(hand.palm_normal, stretch)


def _draw_view(axes: Axes, hand: Hand, maps: list[FingerMap], image: Image, camera: Camera, normal: float) -> None:
    show(axes, (1.0 - _PALE) * image + _PALE, VIEW)
    for m in maps:
        _draw_finger(axes, hand, m, camera)
    start, end = camera.project(np.array([hand.palm_center, hand.palm_center + normal * hand.palm_normal]))[:, :2]
    arrow = {"arrowstyle": "-|>", "color": style.CHOSEN, "lw": 2.2, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", tuple(end), tuple(start), arrowprops=arrow, zorder=7)
    axes.plot(*start, "o", ms=5, color=style.CHOSEN, zorder=7)
    frame_axes(axes, camera)


def _draw_finger(axes: Axes, hand: Hand, m: FingerMap, camera: Camera) -> None:
    """Draw the middle curl plane as a faint sheet, the tip's path in every plane, its arrow, and the joint axes."""
    closing = [j for j in m.finger.joints if hand.joints[j].role is JointRole.CLOSING]
    moving = bool(closing) and float(np.ptp(m.paths, axis=1).max()) > 0.0
    if moving:
        for path in m.paths:
            axes.plot(*camera.project(path)[:, :2].T, "-", color=style.CONTACT, lw=0.7, alpha=0.7, zorder=4)
        middle = camera.project(_middle(m))[:, :2]
        sheet = np.vstack([camera.project(m.base)[:2], middle])
        axes.fill(*sheet.T, color=style.CONTACT, alpha=0.12, lw=0, zorder=3)
        axes.plot(*middle.T, "-", color=style.CONTACT, lw=2.0, zorder=5)
        arrow = {"arrowstyle": "-|>", "color": style.CONTACT, "lw": 2.0, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", tuple(middle[-1]), tuple(middle[-3]), arrowprops=arrow, zorder=5)
    for j, ends in zip(m.finger.joints, m.axes, strict=True):
        (x0, y0), (x1, y1) = camera.project(ends)[:, :2]
        if j in closing:
            color = style.joint_color(closing.index(j))
            axes.plot([x0, x1], [y0, y1], "-", color=style.PAPER, lw=6, zorder=6, solid_capstyle="round")
            axes.plot([x0, x1], [y0, y1], "-", color=color, lw=3.5, zorder=6.1, solid_capstyle="round")
        else:
            axes.plot([x0, x1], [y0, y1], "--", color=style.INK, lw=1.8, zorder=6)


def _name_finger(axes: Axes, m: FingerMap, camera: Camera) -> None:
    x, y = camera.project(_middle(m)[0])[:2]
    label = style.write(
        axes, x, y - 8.0, _title(m.finger), fontsize=10, fontweight="bold", ha="center", va="bottom", zorder=8
    )
    label.set_path_effects(style.halo())


def _explain(figure: Figure, hand: Hand, maps: list[FingerMap], below: int) -> None:
    width, height = figure.get_size_inches() * style.DPI
    left = (2 * VIEW[0] + 3 * GAP) / width
    palm = hand.links[hand.palm].name
    title = f"{hand.name}: what was understood of the open hand, in the frame of its palm '{palm}'"
    style.write(figure, GAP / width, 1.0 - 16 / height, title, fontsize=14, fontweight="bold", va="top")
    rows = [(m.finger, j) for m in maps for j in m.finger.joints]
    step = min(16.0, (height - below - 330.0) / max(len(rows) + len(maps), 1))
    row = 60.0
    for m in maps:
        closing = [j for j in m.finger.joints if hand.joints[j].role is JointRole.CLOSING]
        style.write(
            figure, left, 1.0 - row / height, _title(m.finger), fontsize=0.62 * step, fontweight="bold", va="top"
        )
        row += step
        for j in m.finger.joints:
            color = style.joint_color(closing.index(j)) if j in closing else style.INK
            text = _joint_text(hand, j)
            style.write(figure, left, 1.0 - row / height, text, fontsize=0.56 * step, color=color, va="top")
            row += step
    _legend(figure, left - 0.004, below / height)


def _middle(m: FingerMap) -> FloatArray:
    """Return the tip's path in the middle plane, shape (S, 3)."""
    path: FloatArray = m.paths[len(m.paths) // 2]
    return path


def _title(finger: Finger) -> str:
    return finger.name + (" (thumb)" if finger.is_thumb and finger.name != "thumb" else "")


def _joint_text(hand: Hand, j: int) -> str:
    joint = hand.joints[j]
    leader = next((hand.joints[c.leader].name for c in hand.couplings if c.follower == j), None)
    way = f"closes {'+' if joint.direction > 0 else '-'}" if joint.role is JointRole.CLOSING else str(joint.role)
    low, open_value, high = (np.rad2deg(x) for x in (joint.lower, joint.open_value, joint.upper))
    follows = f", follows {leader}" if leader else ""
    return f"    {joint.name}: {way}, open {open_value:z.0f} in {low:z.0f}..{high:z.0f} deg{follows}"


def _legend(figure: Figure, left: float, bottom: float) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = []
    for k, name in enumerate(("first", "second", "third")):
        color = style.joint_color(k)
        handles.append(Line2D([], [], color=color, lw=3.5, label=f"axis of the {name} closing joint; its links alike"))
    handles += [
        Line2D([], [], color=style.INK, lw=1.8, ls="--", label="axis of a posture joint (set by the command)"),
        Line2D([], [], color=style.CONTACT, lw=2.0, label="way of the tip while the finger closes"),
        Patch(facecolor=style.CONTACT, alpha=0.25, label="middle curl plane (thin lines: those at both edges)"),
        Line2D([], [], color=style.CHOSEN, marker="o", lw=2.2, label="palm's centre and normal"),
        Patch(facecolor=PALM_COLOR, label="palm and what does not close"),
        Line2D([], [], color=style.FAINT, marker=r"$\rightarrow$", ms=12, ls="", label="axes of the palm's frame"),
    ]
    figure.legend(handles=handles, loc="lower left", bbox_to_anchor=(left, bottom), fontsize=9, frameon=False)
