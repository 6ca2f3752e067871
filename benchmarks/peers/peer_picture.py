"""The picture of cost against accuracy: peers with steps of several sizes, and our own solve; and their table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from clench.apps.figures.drawing.style import CHOSEN, CONTACT, FAINT, INK, JOINT_COLORS, PAPER, new_figure, save_figure

from ..bench_report import Value
from .peer_sweep import FACTORS, Misses, Swept
from .stepper import RULES

#: Gaps below this are drawn there: rounding, not a gap [mm].
_LEAST: Final = 1e-6
_LABELS: Final = {
    "graspit_like": "GraspIt!-like steps",
    "simox_like": "Simox-like steps",
    "openrave_like": "OpenRAVE-like steps",
    "clench_planes": "clench, planes only",
    "clench_certified": "clench, certified",
    "clench_planes_batch": "clench, planes only, in a batch",
    "clench_certified_batch": "clench, certified, in a batch",
    "mujoco": "MuJoCo, until at rest",
}
_COLORS: Final = {
    "graspit_like": JOINT_COLORS[0],
    "simox_like": JOINT_COLORS[3],
    "openrave_like": JOINT_COLORS[2],
    "clench_planes": CONTACT,
    "clench_certified": CHOSEN,
    "clench_planes_batch": CONTACT,
    "clench_certified_batch": CHOSEN,
    "mujoco": INK,
}


def draw_peers(swept: Swept, misses: Misses, path: Path) -> Path:
    """Draw the gap that is left against the time of a closing, and the share of a blade's touches that are missed."""
    figure = new_figure(1180, 520)
    left, right = figure.subplots(1, 2, width_ratios=[3, 2])
    _draw_cost(left, swept)
    _draw_misses(right, misses)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    figure.tight_layout()
    return save_figure(figure, path)


def _draw_cost(axes: Any, swept: Swept) -> None:
    for name, label in _LABELS.items():
        if name not in swept.seconds:
            continue
        x = np.array(swept.seconds[name]) * 1e3
        y = np.maximum(np.array(swept.residual[name]) * 1e3, _LEAST)
        look = {"color": _COLORS[name], "label": label}
        if len(x) == 1:
            star = name != "mujoco"
            face = PAPER if name.endswith("_batch") else _COLORS[name]
            axes.plot(x, y, "*" if star else "s", markersize=17 if star else 8, markerfacecolor=face, **look)
            continue
        axes.plot(x, y, "-o", markersize=4, **look)
        _ring(axes, x, y, name)
    axes.set(xscale="log", yscale="log", xlabel="time of one closing of the whole hand [ms]")
    axes.set_ylabel("gap (or overlap) left at a touching finger [mm]")
    axes.set_title("Cost against accuracy: left and down is better", fontsize=11, color=INK)
    axes.axhline(_LEAST, color=FAINT, linewidth=1, linestyle=":")
    axes.text(0.01, 1.4 * _LEAST, "rounding", color=FAINT, fontsize=8, transform=axes.get_yaxis_transform())
    axes.grid(True, which="major", color="#e8e8e8", linewidth=0.8)
    own = "ring: the program's own step"
    axes.legend(fontsize=9, frameon=False, loc="lower left", bbox_to_anchor=(0, 0.08), title=own, title_fontsize=8)


def _draw_misses(axes: Any, misses: Misses) -> None:
    for rule in RULES:
        steps = [rule.step * factor for factor in FACTORS]
        shares = 100.0 * np.array(misses.shares[rule.name])
        axes.plot(steps, shares, "-o", markersize=4, color=_COLORS[rule.name])
        _ring(axes, steps, shares, rule.name)
    for name, label in (("clench_certified", "clench, certified"), ("clench_planes", "clench, planes only")):
        share = 100.0 * int(misses.values[f"{name}_missed"]) / max(int(misses.values[f"{name}_touches"]), 1)
        axes.axhline(
            share, color=_COLORS[name], linewidth=1.5, linestyle="--", label=f"{label}: {share:.0f} %, no step"
        )
    axes.legend(fontsize=9, frameon=False, loc="upper left")
    axes.set(xscale="log", xlabel="step of a joint [rad]", ylabel="touches stepped through [%]")
    axes.set_title("1 mm fingers on a 0.1 mm blade", fontsize=11, color=INK)
    axes.grid(True, which="major", color="#e8e8e8", linewidth=0.8)


def _ring(axes: Any, x: Any, y: Any, name: str) -> None:
    standard = FACTORS.index(1.0)
    axes.plot(x[standard], y[standard], "o", markersize=11, markerfacecolor="none", color=_COLORS[name])


def peer_table(values: Mapping[str, Value], objects: Sequence[str]) -> str:
    """Return what was measured per object as a table (Markdown); ratios are by the clock, and by processor time."""
    heads = (
        "object", "closing", "ms", "CPU ms", "queries", "µs/query", "fcl µs/query", "gap left, mm: median / 90 % / max",
        "overlap, max mm", "theirs / planes", "theirs / certified",
    )  # fmt: skip
    lines = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
    for key in objects:
        names = [name for name in _LABELS if f"{key}_{name}_median_ms" in values]
        lines += [f"| {' | '.join([key, *_row(values, f'{key}_{name}', _LABELS[name])])} |" for name in names]
    return "\n".join(lines) + "\n"


def _row(values: Mapping[str, Value], key: str, label: str) -> Iterator[str]:
    def number(name: str) -> str:
        value = values.get(f"{key}_{name}")
        if not isinstance(value, float):
            return "" if value is None else str(value)
        return f"{value:.2g}" if abs(value) < 99.5 else f"{value:.0f}"

    yield label
    for name in ("median_ms", "processor_ms", "queries", "query_us", "fcl_query_us"):
        yield number(name)
    yield " / ".join(filter(None, (number(f"residual_{part}_mm") for part in ("median", "p90", "max"))))
    yield number("penetration_max_mm")
    for ours in ("clench_planes", "clench_certified"):
        yield " / ".join(filter(None, (number(f"over_{ours}"), number(f"over_{ours}_processor"))))
