"""Draw a finger in its curl planes, open and closed, as the patent's FIG. 3 and 5 do."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from clench.apps.figures.drawing import style
from clench.core.pose import FloatArray
from clench.solver.solution import Candidate, FingerResult

from .finger_scenes import FingerScenes
from .loops import Loop
from .plane_scene import JointMotion, PlaneContact, PlaneScene, bounds

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Planes beside each other at most; a candidate that touches on more shows the busiest.
MOST_PANELS: Final = 3
_MM: Final = 1e3
_TEXT_WIDTH: Final = 430
_MARGIN: Final = 62


def draw_finger(scenes: FingerScenes, result: FingerResult, hand: str, obj: str, path: Path) -> Path:
    """Write the curl-plane figure of a finger's chosen candidate."""
    shown = [scenes.scene(axis_group, plane) for axis_group, plane in scenes.touched_planes(MOST_PANELS)]
    text = 370.0 + 37.0 * len(scenes.plan.joints) + 54.0 * len(scenes.contacts)
    figure, panels = _panels(shown, text)
    low, high = bounds(shown)
    for axes, scene in zip(panels, shown, strict=True):
        draw_plane(axes, scene)
        frame_plane(axes, low, high)
        axes.set_title(
            plane_title(scene, len(scenes.plan.axis_groups)), fontsize=10.5, loc="left", color=style.INK, y=1.0
        )
        axes.set_xlabel("x, in the plane [mm]", fontsize=9)
    panels[0].set_ylabel("z, the way the finger closes [mm]", fontsize=9)
    width = figure.get_figwidth() * style.DPI
    title = f"Finger '{result.name}' of {hand} closing on {obj}, seen along y, across its curl planes"
    style.write(figure, _MARGIN / width, 0.975, title, fontsize=14, fontweight="bold", va="top")
    _explain(figure, scenes, shown, result, 1.0 - _TEXT_WIDTH / width)
    return style.save_figure(figure, path)


def _panels(shown: Sequence[PlaneScene], text: float) -> tuple[Figure, list[Axes]]:
    """Return a figure with one panel per plane, as large as 1600 pixels allow, beside a column of text of a height."""
    low, high = bounds(shown)
    aspect = float((high[1] - low[1]) / (high[0] - low[0]))
    count = len(shown)
    each = min(820.0, (1600.0 - _TEXT_WIDTH - _MARGIN) / count - 30.0)
    tall = float(np.clip(each * aspect, max(430.0, text - 150.0), 700.0))
    each = min(each, max(tall / aspect, 300.0))
    width = _MARGIN + count * (each + 30.0) + _TEXT_WIDTH
    height = tall + 150.0
    figure = style.new_figure(round(width), round(height))
    panels = [
        figure.add_axes(((_MARGIN + k * (each + 30.0)) / width, 60.0 / height, each / width, tall / height))
        for k in range(count)
    ]
    for axes in panels[1:]:
        axes.tick_params(labelleft=False)
    return figure, panels


def plane_title(scene: PlaneScene, axis_groups: int) -> str:
    """Return a title that says which plane is seen."""
    if axis_groups == 1:
        return scene.place
    names = ", ".join(j.name for j in scene.joints)
    short = names if len(names) < 40 else f"{len(scene.joints)} joints from {scene.joints[0].name}"
    return f"{scene.place}\nturned by {short}"


def frame_plane(axes: Axes, low: FloatArray, high: FloatArray) -> None:
    """Show a box with the same scale on both axes, in millimetres, grown to fill the panel."""
    box = axes.get_window_extent()
    size = 1.1 * (high - low)
    scale = max(size[0] / box.width, size[1] / box.height)
    half = 0.5 * scale * np.array([box.width, box.height]) * _MM
    middle = 0.5 * (low + high) * _MM
    axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
    axes.set_ylim(middle[1] - half[1], middle[1] + half[1])
    axes.tick_params(labelsize=8, colors=style.FAINT)
    for spine in axes.spines.values():
        spine.set_color("#cccccc")


def draw_plane(axes: Axes, scene: PlaneScene, *, small: bool = False) -> None:
    """Draw section, links, joints and contacts of one plane, in millimetres.

    Args:
        axes: drawn on. scene: the scene. small: leave out details that a small panel cannot show.
    """
    for obstacle in (True, False):
        curves = [c.loop for c in scene.section if c.obstacle is obstacle]
        fill, edge = (style.OBSTACLE_FILL, style.OBSTACLE_EDGE) if obstacle else (style.OBJECT_FILL, style.OBJECT_EDGE)
        _fill(axes, curves, fill, 1.0)
        _stroke(axes, curves, edge, 1.0 if small else 1.8, 2.0)
    _body(axes, scene.palm, style.PALM_FILL, style.FAINT, 1.2, 3.0)
    for link in scene.open_links:
        color = style.joint_color(link.joint)
        _body(axes, link.loops, style.mixed(color, style.PAPER, 0.93), style.mixed(color, style.PAPER, 0.5), 1.0, 4.0)
    if not small:
        for joint in scene.joints:
            _motion(axes, joint)
    for link in scene.closed_links:
        color = style.joint_color(link.joint)
        _body(axes, link.loops, style.mixed(color, style.PAPER, 0.55), color, 1.2 if small else 2.2, 6.0)
    bones = np.array([*(j.pivot for j in scene.joints), scene.joints[-1].pivot + scene.joints[-1].arm]) * _MM
    axes.plot(bones[:, 0], bones[:, 1], "-", color=style.FAINT, lw=1.0, zorder=5.9)
    for joint in scene.joints:
        x, z = joint.pivot * _MM
        size = 4.0 if small else 8.0
        axes.plot(x, z, "o", ms=size, mfc=style.PAPER, mec=style.INK, mew=1.0 if small else 1.6, zorder=8)
        if not small:
            axes.plot(x, z, "o", ms=2.0, color=style.INK, zorder=8)
            _angle_label(axes, joint, scene)
    _contacts(axes, scene, small)


def _path(loops: Iterable[Loop]) -> Any:
    from matplotlib.path import Path as Curve

    points, codes = [], []
    for loop in loops:
        p = loop.points * _MM
        kinds = [Curve.MOVETO] + [Curve.LINETO] * (len(p) - 1)
        if loop.closed:
            p, kinds = np.vstack([p, p[:1]]), [*kinds, Curve.CLOSEPOLY]
        points.append(p)
        codes += kinds
    return Curve(np.vstack(points), codes) if points else None


def _fill(axes: Axes, loops: Iterable[Loop], color: str, order: float) -> None:
    from matplotlib.patches import PathPatch

    path = _path(loop for loop in loops if loop.closed)
    if path is not None:
        axes.add_artist(PathPatch(path, facecolor=color, edgecolor="none", zorder=order))


def _stroke(axes: Axes, loops: Iterable[Loop], color: str, width: float, order: float) -> None:
    from matplotlib.patches import PathPatch

    path = _path(loops)
    if path is not None:
        axes.add_artist(PathPatch(path, fill=False, edgecolor=color, linewidth=width, zorder=order, joinstyle="round"))


def _body(axes: Axes, loops: Sequence[Loop], fill: str, edge: str, width: float, order: float) -> None:
    """Draw overlapping loops as one body: every border first, then every inside on top of it."""
    _stroke(axes, loops, edge, 2.0 * width, order)
    for loop in loops:
        _fill(axes, [loop], fill, order + 0.5)


def _motion(axes: Axes, joint: JointMotion) -> None:
    """Draw a joint's range of motion as an arc from open to limit, and the used part as a wedge."""
    from matplotlib.patches import Wedge

    color = style.joint_color(joint.position)
    radius = 0.62 * float(np.linalg.norm(joint.arm)) * _MM
    x, z = joint.pivot * _MM
    now = float(np.arctan2(joint.arm[1], joint.arm[0]))
    start, stop = now - joint.turn, now - joint.turn + joint.full_turn
    t = np.linspace(start, stop, 60)
    axes.plot(x + radius * np.cos(t), z + radius * np.sin(t), ":", color=color, lw=1.4, zorder=7.1)
    ends = np.array([0.9, 1.1]) * radius
    axes.plot(x + ends * np.cos(stop), z + ends * np.sin(stop), "-", color=color, lw=2.0, zorder=7.1)
    axes.plot(
        [x, x + 1.1 * radius * np.cos(start)],
        [z, z + 1.1 * radius * np.sin(start)],
        "--",
        color=color,
        lw=1.0,
        zorder=7.2,
    )
    a, b = np.degrees(sorted([start, now]))
    if b - a > 0.05:
        axes.add_artist(Wedge((x, z), radius, a, b, facecolor=color, alpha=0.28, edgecolor="none", zorder=5.0))
        t = np.linspace(start, now, 40)
        axes.plot(x + radius * np.cos(t), z + radius * np.sin(t), "-", color=color, lw=2.0, zorder=7.2)


def _angle_label(axes: Axes, joint: JointMotion, scene: PlaneScene) -> None:
    """Write a joint's angle beside it, on the outer side of the finger, where no wedge is."""
    color = style.mixed(style.joint_color(joint.position), "#000000", 0.25)
    away = outer_side(joint, scene.joints)
    near = (joint.position, joint.position - 1)
    borders = [loop.points for link in scene.closed_links if link.joint in near for loop in link.loops]
    thickness = float(((np.vstack(borders) - joint.pivot) @ away).max()) if borders else 0.0
    axes.annotate(
        f"{np.degrees(joint.angle):z.1f}°",
        tuple((joint.pivot + thickness * away) * _MM),
        xytext=tuple(7.0 * away),
        textcoords="offset points",
        ha="left" if away[0] > 0.4 else "right" if away[0] < -0.4 else "center",
        va="bottom" if away[1] > 0.4 else "top" if away[1] < -0.4 else "center",
        fontsize=12,
        fontweight="bold",
        color=color,
        zorder=12,
        path_effects=style.halo(),
    )


def outer_side(joint: JointMotion, joints: Sequence[JointMotion]) -> FloatArray:
    """Return the unit direction out of a knuckle, away from the side to which it closes, shape (2,)."""
    arms = [j.arm / np.linalg.norm(j.arm) for j in joints if j.position < joint.position and j.arm.any()]
    back = arms[-1] if arms else np.array([1.0, 0.0])
    # Joints in one place have no arm between them.
    arm = joint.arm / np.linalg.norm(joint.arm) if joint.arm.any() else back
    across = np.array([arm[1], -arm[0]]) if joint.full_turn >= 0.0 else np.array([-arm[1], arm[0]])
    middle = back - arm
    size = float(np.linalg.norm(middle))
    return middle / size if size > 0.15 and middle @ across > 0.0 else across


def _contacts(axes: Axes, scene: PlaneScene, small: bool) -> None:
    """Mark contacts: the touch, the tangent of the object's curve there, and the normal towards the link."""
    span = 5.0 if small else 13.0
    for c in scene.contacts:
        x, z = c.point * _MM
        if not small:
            along = np.array([-c.normal[1], c.normal[0]]) * span
            axes.plot(
                [x - along[0], x + along[0]], [z - along[1], z + along[1]], "-", color=style.CONTACT, lw=1.6, zorder=9
            )
            axes.annotate(
                "",
                (x + span * c.normal[0], z + span * c.normal[1]),
                (x, z),
                arrowprops={"arrowstyle": "-|>", "color": style.CONTACT, "lw": 1.6, "shrinkA": 0, "shrinkB": 0},
                zorder=9,
            )
        axes.plot(x, z, "o", ms=5.0 if small else 8.0, color=style.CONTACT, mec=style.PAPER, mew=1.0, zorder=10)
    if not small:
        _numbers(axes, scene.contacts, 0.75 * span)
    if small:
        for c in scene.others:
            x, z = c.point * _MM
            axes.plot(x, z, "o", ms=5.0, mfc="none", mec=style.CONTACT, mew=1.2, zorder=10)


def _numbers(axes: Axes, contacts: Sequence[PlaneContact], distance: float) -> None:
    """Write every contact's number inside the object beside it; contacts at one place share one label [mm]."""
    placed: list[tuple[FloatArray, list[int]]] = []
    for c in contacts:
        place = c.point * _MM - distance * c.normal
        near = next((numbers for other, numbers in placed if np.linalg.norm(other - place) < 0.6 * distance), None)
        if near is None:
            placed.append((place, [c.number + 1]))
        else:
            near.append(c.number + 1)
    for place, numbers in placed:
        style.number_label(axes, (float(place[0]), float(place[1])), numbers)


def candidate_name(candidate: Candidate) -> str:
    """Return the name of a candidate in titles."""
    return "full width" if candidate.plane is None else f"plane {candidate.plane}"


def _explain(
    figure: Figure, scenes: FingerScenes, shown: Sequence[PlaneScene], result: FingerResult, left: float
) -> None:
    """Write the column on the right: joints, contacts, the chosen candidate, and the legend."""
    height = figure.get_figheight() * style.DPI
    top = height - 62.0

    def line(text: str, step: float = 19.0, **options: Any) -> None:
        nonlocal top
        style.write(figure, left, top / height, text, va="top", **options)
        top -= step

    line("Joint angles", fontsize=11, fontweight="bold")
    for joint in (j for f in range(len(scenes.plan.axis_groups)) for j in scenes.scene(f, 0, with_open=False).joints):
        color = style.mixed(style.joint_color(joint.position), "#000000", 0.2)
        line(f"joint {joint.name}", 17.0, color=color, fontweight="bold")
        line(
            f"   open {_deg(joint.open_angle)}  →  closed {_deg(joint.angle)}   (limit {_deg(joint.limit)})",
            20.0,
            fontsize=9.5,
        )
    top -= 6.0
    line("Contacts", fontsize=11, fontweight="bold")
    seen = {c.number for s in shown for c in s.contacts}
    for c in scenes.contacts:
        stops = f", stops {c.contact.stops_joint}" if c.contact.stops_joint else ""
        passed = ", opened again later" if c.contact.passed else ""
        hidden = "" if c.number in seen else " (not shown)"
        line(f"{c.number + 1}  {c.contact.link}", 17.0, color=style.CONTACT, fontweight="bold")
        line(f"    {_KIND[c.contact.kind.value]}{stops}{passed}", 17.0, fontsize=9.5)
        line(f"    {c.place}{hidden}", 20.0, fontsize=9.5)
    if not scenes.contacts:
        for text in textwrap.wrap(f"none: {result.reason}", 58)[:4]:
            line(text, 16.0, fontsize=9.5)
    top -= 6.0
    line(f"Chosen candidate: {candidate_name(scenes.candidate)}", fontsize=11, fontweight="bold", color=style.CHOSEN)
    for text in _meaning(scenes.candidate):
        line(text, 16.0, fontsize=9.5)
    _legend(figure, left)


def _deg(angle: float) -> str:
    return f"{np.degrees(angle):z.1f}°"


_KIND: Final = {
    "side": "side of the link",
    "tip": "rounded end of the link",
    "edge": "edge of the link",
    "face": "face of the link",
    "vertex": "corner of the link",
}


def _meaning(candidate: Candidate) -> list[str]:
    if candidate.plane is None:
        lines = [
            "each joint stops at the first touch across the whole width",
            "of the finger, between the planes, too, or at another link",
        ]
    else:
        lines = ["closed as if only this plane existed"]
    if candidate.penetration is not None and candidate.feasible is not None:
        lines.append(f"{'feasible' if candidate.feasible else 'not feasible'}: {overlap(candidate.penetration)}")
    return lines


def overlap(depth: float) -> str:
    """Return a sentence part about the depth [m] to which a finger overlaps the object anywhere."""
    return "overlaps the object nowhere" if depth < 1e-6 else f"overlaps the object by up to {depth * 1e3:.2g} mm"


def _legend(figure: Figure, left: float) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    blue = style.JOINT_COLORS[0]
    handles: list[Any] = [
        Patch(facecolor=style.OBJECT_FILL, edgecolor=style.OBJECT_EDGE, label="object, cut by the plane"),
        Patch(facecolor=style.PALM_FILL, edgecolor=style.FAINT, label="palm, and links that these joints do not move"),
        Patch(
            facecolor=style.mixed(blue, style.PAPER, 0.93),
            edgecolor=style.mixed(blue, style.PAPER, 0.5),
            label="link, open",
        ),
        Patch(facecolor=style.mixed(blue, style.PAPER, 0.55), edgecolor=blue, label="link, closed"),
        Patch(facecolor=style.mixed(blue, style.PAPER, 0.72), label="joint: turned from open (dashed) to closed"),
        Line2D([], [], color=blue, ls=":", lw=1.4, label="joint: range of motion, up to its limit (bar)"),
        Line2D(
            [], [], color=style.CONTACT, marker="o", mec=style.PAPER, label="contact, tangent of the object's curve"
        ),
        Line2D([], [], color=style.CONTACT, marker=r"$\rightarrow$", ms=12, ls="", label="normal, out of the object"),
    ]
    figure.legend(handles=handles, loc="lower left", bbox_to_anchor=(left - 0.004, 0.02), fontsize=9, frameon=False)
