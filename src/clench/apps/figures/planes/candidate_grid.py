"""Draw a finger's candidates side by side: the result of every curl plane alone, and the chosen one."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from clench.apps.figures.drawing import style
from clench.solver.solution import Candidate, FingerResult, FingerStatus

from .curl_plane import candidate_name, draw_plane, frame_plane, overlap
from .finger_scenes import FingerScenes
from .plane_scene import PlaneScene, along_y, bounds

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Sets shown at most; of more, an even selection.
MOST_CANDIDATES: Final = 8
_COLUMNS: Final = 4
_PANEL: Final = 370
#: Width of the figure at least, for the text above the panels, in pixels.
_NARROWEST: Final = 1180
_GAP: Final = 20
#: Height of the lines below a panel, in pixels.
_LINES: Final = 70
#: Units of scores that have one.
_UNITS: Final = {"range_of_motion": " rad"}
_TOP: Final = 92
_TITLE: Final = 24
_BOTTOM: Final = 42


def draw_candidates(scenes_of: FingerScenes, result: FingerResult, hand: str, obj: str, path: Path) -> Path:
    """Write a figure with one panel per candidate at the chosen posture, the chosen one framed.

    Args:
        scenes_of: of the chosen candidate. result: of the finger. hand, obj: names. path: of the PNG file.
    """
    chosen = result.candidates[result.chosen]
    alike = [c for c in result.candidates if c.posture == chosen.posture]
    shown = _selected(alike, chosen)
    made = [scenes_of.showing(c) for c in shown]
    axis_group = _busiest_axis_group(made[0])
    scenes = [
        m.scene(axis_group, dict(m.touched_planes(len(m.plan.axis_groups)))[axis_group], with_open=False) for m in made
    ]
    low, high = bounds(scenes)
    columns = min(_COLUMNS, len(shown))
    rows = math.ceil(len(shown) / columns)
    aspect = float(np.clip((high[1] - low[1]) / (high[0] - low[0]), 0.55, 1.1))
    each = (_PANEL, round(_PANEL * aspect))
    width = max(_GAP + columns * (each[0] + _GAP), _NARROWEST)
    height = _TOP + rows * (each[1] + _TITLE + _LINES + _GAP) + _BOTTOM
    figure = style.new_figure(width, height)
    for k, (candidate, scene) in enumerate(zip(shown, scenes, strict=True)):
        x = _GAP + (k % columns) * (each[0] + _GAP)
        y = height - _TOP - _TITLE - each[1] - (k // columns) * (each[1] + _TITLE + _LINES + _GAP)
        axes = figure.add_axes((x / width, y / height, each[0] / width, each[1] / height))
        frame_plane(axes, low, high)
        draw_plane(axes, scene, small=True)
        _caption(axes, candidate, scene, candidate is chosen)
        if k == 0:
            _scale_bar(axes)
    more = f" ({len(shown)} of {len(alike)} shown)" if len(shown) < len(alike) else ""
    title = f"Finger '{result.name}' of {hand} on {obj}: the candidates to choose from{more}"
    style.write(figure, _GAP / width, 1.0 - 14 / height, title, fontsize=14, fontweight="bold", va="top")
    for i, text in enumerate(_explanation(made[0], scenes[0], result, chosen)):
        below = 1.0 - (40 + 18 * i) / height
        style.write(
            figure, _GAP / width, below, text, fontsize=10, va="top", color=style.INK if i == 0 else style.CHOSEN
        )
    note = "●  touches on the plane that is drawn     ○  touches elsewhere across the finger's width     "
    note += "thin line: joints, also where the plane misses a link"
    style.write(figure, _GAP / width, 16 / height, note, fontsize=9.5, color=style.CONTACT)
    return style.save_figure(figure, path)


def _selected(alike: list[Candidate], chosen: Candidate) -> list[Candidate]:
    """Return up to `MOST_CANDIDATES` candidates, spread evenly, always with the chosen one and the full width."""
    planes = [c for c in alike if c.plane is not None and c is not chosen]
    kept = [c for c in alike if c.plane is None or c is chosen][: MOST_CANDIDATES // 2]
    if chosen not in kept:
        kept[-1] = chosen
    room = MOST_CANDIDATES - len(kept)
    if len(planes) > room:
        offsets = np.array([c.offset or 0.0 for c in planes])
        taken = [0, len(planes) - 1]  # the edges of the finger, then always the plane farthest from those taken
        while len(taken) < room:
            taken.append(int(np.argmax(np.abs(offsets[:, None] - offsets[taken]).min(axis=1))))
        planes = [planes[i] for i in taken]
    wanted = {id(c) for c in planes + kept}
    return [c for c in alike if id(c) in wanted]


def _busiest_axis_group(scenes: FingerScenes) -> int:
    """Return the axis group with most joints, the first of several."""
    axis_groups = [p.axis_group for p in scenes.plan.joints]
    return max(sorted(set(axis_groups)), key=axis_groups.count)


def _caption(axes: Axes, candidate: Candidate, scene: PlaneScene, chosen: bool) -> None:
    """Title a panel, write its joint angles, and frame the chosen one."""
    drawn = "drawn: " if candidate.plane is None else ""
    where = f" ({drawn}{along_y(scene.offset)})"
    title = f"{candidate_name(candidate)}{where}"
    color = style.CHOSEN if chosen else style.INK
    axes.set_title(
        f"CHOSEN: {title}" if chosen else title,
        fontsize=11,
        loc="left",
        y=1.0,
        color=color,
        fontweight="bold" if chosen else "normal",
        pad=5,
    )
    _frame(axes, chosen)
    box = axes.get_window_extent()
    names = _short([j.name for j in scene.joints])
    for i, joint in enumerate(scene.joints):
        shade = style.mixed(style.joint_color(joint.position), "#000000", 0.25)
        x = i / max(len(scene.joints), 3)
        for text, down, size in ((names[i], 6.0, 8.5), (f"{np.degrees(joint.angle):z.1f}°", 19.0, 11.0)):
            label = style.write(axes, x, -down / box.height, text, fontsize=size, color=shade, fontweight="bold")
            label.set(transform=axes.transAxes, va="top")
    for i, text in enumerate(_verdict(candidate)):
        label = style.write(axes, 0.0, -(37.0 + 15.0 * i) / box.height, text, fontsize=8.0)
        label.set(transform=axes.transAxes, va="top")


def _frame(axes: Axes, chosen: bool) -> None:
    """Replace an axes' ticks and spines by a border: they take longer to draw than its content."""
    from matplotlib.patches import Rectangle

    axes.set_axis_off()
    color, width = (style.CHOSEN, 3.5) if chosen else ("#cccccc", 1.0)
    border = Rectangle((0, 0), 1, 1, transform=axes.transAxes, fill=False, edgecolor=color, linewidth=width, zorder=13)
    border.set_clip_on(False)
    axes.add_artist(border)


def _short(names: list[str]) -> list[str]:
    """Return names without the words that all of them start with."""
    words = [name.split("_") for name in names]
    alike = 0
    while len(names) > 1 and min(map(len, words)) > alike + 1 and len({w[alike] for w in words}) == 1:
        alike += 1
    return ["_".join(w[alike:]) for w in words]


def _verdict(candidate: Candidate) -> list[str]:
    """Return up to two lines: the scores of the candidate, and its known overlap."""
    scores = "  ".join(
        f"{name.replace('_', ' ')} {value:.3g}{_UNITS.get(name, '')}" for name, value in candidate.scores.items()
    )
    known = [] if candidate.contacts else ["no contact"]
    if candidate.status is FingerStatus.BLOCKED:
        known = ["blocked: it does not move"]
    if candidate.penetration is not None:
        known.append(overlap(candidate.penetration))
    return [line for line in (scores, "; ".join(known)) if line]


def _explanation(scenes: FingerScenes, scene: PlaneScene, result: FingerResult, chosen: Candidate) -> list[str]:
    axis_group = ""
    if len(scenes.plan.axis_groups) > 1:
        axis_group = f" Its joints form {len(scenes.plan.axis_groups)} axis groups; drawn are planes of "
        axis_group += f"{', '.join(j.name for j in scene.joints)}."
    first = "One candidate per curl plane, closed as if only that plane existed"
    if all(c.plane is None for c in result.candidates):
        first = "One candidate, over the full width: joints about axes that are not parallel move at once, in no plane"
    elif any(c.plane is None for c in result.candidates):
        first += "; and one over the full width, which stops at touches between the planes, too"
    why = {
        True: "it stops at the first touch anywhere across the finger's width",
        False: "it scores best among the candidates",
    }[chosen.plane is None]
    second = f"Chosen: {candidate_name(chosen)}: {why}."
    return [f"{first}.{axis_group}", second if chosen.contacts else f"{second[:-1]}; {result.reason}."]


def _scale_bar(axes: Axes) -> None:
    """Draw a bar of a round length in the lower right corner of a panel whose axes are in millimetres."""
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    length = next(step for step in (100, 50, 20, 10, 5, 2, 1) if step < 0.3 * (x1 - x0) or step == 1)
    right, low = x1 - 0.04 * (x1 - x0), y0 + 0.13 * (y1 - y0)
    axes.plot([right - length, right], [low, low], "-", color=style.INK, lw=2.5, solid_capstyle="butt", zorder=12)
    label = style.write(axes, right - 0.5 * length, low + 0.015 * (y1 - y0), f"{length} mm", fontsize=9)
    label.set(ha="center", va="bottom", path_effects=style.halo(), zorder=12)
