"""Draw what changing one weight changes: the criteria of the chosen sets, and the grasp at either end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

import clench
from clench.base.errors import CommandError
from clench.grasp.criterion_registry import find_criterion
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solve.examples import solve_scores
from clench.solve.solution import GraspSolution

from . import style
from .hand_view import render, viewpoints
from .surfaces import COARSE, hand_surface, object_surface
from .views import fitted_camera

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SIZE: Final = (1560, 560)
_PICTURE: Final = (470, 480)
_PLOT: Final = 520


def sweep_weight(
    hand: Hand, obj: GraspObject, command: GraspCommand, criterion: str, weights: Sequence[float]
) -> list[GraspSolution]:
    """Solve once for every weight of a criterion; the command's other weights stay.

    Args:
        hand, obj, command: what is solved; the command's criteria are weights by name. criterion: whose weight changes.
        weights: at least two.

    Raises:
        CommandError: criteria that are not weights, or fewer than two of them.
    """
    if not isinstance(command.criteria, Mapping) or len(weights) < 2:
        raise CommandError("sweep: expected a command whose criteria are weights by name, and at least two weights.")
    others = dict(command.criteria)
    return [
        clench.solve(hand, obj, replace(command, criteria={**others, criterion: float(weight)})) for weight in weights
    ]


def draw_sweep(
    hand: Hand,
    obj: GraspObject,
    solutions: Sequence[GraspSolution],
    criteria: tuple[str, str],
    weights: Sequence[float],
    path: Path,
) -> Path:
    """Write a figure of two criteria over the weight of the first, and of the grasps at the least and the most weight.

    Args:
        hand, obj: what was solved. solutions: of `sweep_weight`, one for every weight. criteria: the one whose weight
            changed, and one that pays for it. weights: above 0. path: the PNG file.
    """
    figure = style.new_figure(*_SIZE)
    width, height = _SIZE
    plot = figure.add_axes((80 / width, 70 / height, (_PLOT - 160) / width, (height - 150) / height))
    _draw_steps(plot, solutions, criteria, weights)
    style.write(figure, 0.5, 1.0 - 22 / height, _title(hand, obj, criteria[0]), fontsize=13, ha="center")
    ends = [(solutions[0], weights[0]), (solutions[-1], weights[-1])]
    surfaces = [(hand_surface(hand, s, COARSE).corners, object_surface(obj, s, COARSE).corners) for s, _ in ends]
    focus = np.concatenate([body.reshape(-1, 3) for body, _ in surfaces] + [surfaces[0][1].reshape(-1, 3)])
    towards = viewpoints(*surfaces[1], focus, ends[1][0])[0]
    for k, (solution, weight) in enumerate(ends):
        left = _PLOT + 20 + k * (_PICTURE[0] + 40)
        axes = figure.add_axes((left / width, 20 / height, _PICTURE[0] / width, _PICTURE[1] / height))
        _draw_grasp(axes, hand, obj, solution, towards, focus)
        scores = solve_scores(solution)
        told = ", ".join(f"{n} {scores[n]:.3g} {find_criterion(n, 'sweep').unit}" for n in criteria)
        style.write(figure, (left + _PICTURE[0] / 2) / width, (height - 52) / height, _end(weight, told), ha="center")
    return style.save_figure(figure, path)


def _title(hand: Hand, obj: GraspObject, name: str) -> str:
    return f"{hand.name} on {obj.name}: more weight on {name}"


def _end(weight: float, told: str) -> str:
    return f"weight {weight:g}: {told}"


def _draw_steps(
    plot: Axes, solutions: Sequence[GraspSolution], criteria: tuple[str, str], weights: Sequence[float]
) -> None:
    """Draw the values of two criteria over the weight, each against an axis of its own."""
    for axes, name, color, line in (
        (plot, criteria[0], style.CHOSEN, "-"),
        (plot.twinx(), criteria[1], style.JOINT_COLORS[0], "--"),
    ):
        c = find_criterion(name, "sweep")
        values = [solve_scores(s)[name] for s in solutions]
        axes.plot(weights, values, line, color=color, marker="o", drawstyle="steps-post", lw=2.0)
        better = "more" if c.larger_is_better else "less"
        axes.set_ylabel(f"{name} [{c.unit}], {better} is better", color=color)
        axes.tick_params(axis="y", colors=color)
        axes.margins(y=0.12)
    plot.set_xscale("log")
    plot.set_xlabel(f"weight of {criteria[0]}")
    plot.grid(alpha=0.3)


def _draw_grasp(
    axes: Axes, hand: Hand, obj: GraspObject, solution: GraspSolution, towards: np.ndarray, focus: np.ndarray
) -> None:
    camera = fitted_camera(towards, focus, _PICTURE)
    image, _ = render(hand_surface(hand, solution), object_surface(obj, solution), camera)
    axes.imshow(image, extent=(0, _PICTURE[0], _PICTURE[1], 0), interpolation="nearest")
    points = np.array([c.position for c in solution.contacts if not c.passed]).reshape(-1, 3)
    at = camera.project(points)[:, :2]
    axes.plot(at[:, 0], at[:, 1], "o", ms=7, mfc=style.CONTACT, mec=style.PAPER, mew=1.4)
    axes.set_xlim(0, _PICTURE[0])
    axes.set_ylim(_PICTURE[1], 0)
    axes.set_axis_off()
