"""The pictures of scaling, one per axis, and their table."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from clench.apps.figures.drawing.style import CHOSEN, CONTACT, FAINT, INK, JOINT_COLORS, new_figure, save_figure

if TYPE_CHECKING:
    from .scaling import Axis

_TITLES: Final = {
    "triangles": "triangles of the same surface",
    "planes": "curl planes per finger",
    "fingers": "fingers that close",
    "threads": "threads, many poses at once",
    "batch": "poses at once, one thread",
}
_PARTS: Final = {
    "whole": ("one solve, certified", INK),
    "planar": ("one solve, planes only", CONTACT),
    "fingers": ("kernel: closing over the full width", CHOSEN),
    "on_planes": ("kernel: closing on the planes", JOINT_COLORS[0]),
    "prepare": ("packing the object, once", FAINT),
    "certified": ("certified, per pose", CHOSEN),
    "planes": ("planes only, per pose", CONTACT),
}


def draw_scaling(axes: Sequence[Axis], path: Path) -> Path:
    """Draw time against every axis, with the fitted exponents."""
    figure = new_figure(1280, 760)
    places = figure.subplots(2, 3).ravel()
    for place, axis in zip(places, axes, strict=False):
        _draw(place, axis)
    for place in places[len(axes) :]:
        place.axis("off")
    figure.tight_layout()
    return save_figure(figure, path)


def _draw(place: Any, axis: Axis) -> None:
    for part, seconds in axis.seconds.items():
        label, color = _PARTS[part]
        times = np.array(seconds) * 1e3
        place.plot(axis.at, times, "-o", markersize=4, color=color, label=f"{label}: n^{axis.exponent(part):.2f}")
    if axis.name == "triangles":
        whole = np.array(axis.seconds["whole"]) * 1e3
        growth = whole[0] * np.log(axis.at) / np.log(axis.at[0])
        place.plot(axis.at, growth, "--", color=INK, linewidth=1, label="log n from the first point")
    place.set(xscale="log", yscale="log", xlabel=_TITLES[axis.name], ylabel="ms")
    if axis.name in ("planes", "fingers", "threads"):
        place.set_xticks(axis.at, [str(n) for n in axis.at])
        place.set_xticks([], minor=True)
    place.grid(True, which="major", color="#e8e8e8", linewidth=0.8)
    place.spines[["top", "right"]].set_visible(False)
    low, high = place.get_ylim()
    room = 0.03 + 0.065 * len(place.get_lines())
    place.set_ylim(low, low * (high / low) ** (1.0 / (1.0 - room)))
    place.legend(fontsize=7.5, frameon=False, loc="upper left")


def scaling_table(axes: Sequence[Axis]) -> str:
    """Return a table per axis (Markdown): times in milliseconds, and the fitted exponents."""
    blocks = []
    for axis in axes:
        labels = [_PARTS[part][0] for part in axis.seconds]
        lines = [f"| {_TITLES[axis.name]} | {' | '.join(labels)} |", "|" + "---|" * (len(labels) + 1)]
        for k, at in enumerate(axis.at):
            times = [f"{seconds[k] * 1e3:.3g}" for seconds in axis.seconds.values()]
            lines.append(f"| {at} | {' | '.join(times)} |")
        exponents = [f"{axis.exponent(part):.2f}" for part in axis.seconds]
        lines.append(f"| *exponent* | {' | '.join(exponents)} |")
        blocks.append("\n".join(lines) + "\n")
    return "\n".join(blocks)
