"""Draw the effect of one weight: the criteria of the chosen candidates, and the grasp at either end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from string import ascii_uppercase
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

import clench
from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.scoring.criterion_registry import find_criterion
from clench.solver.solution import GraspSolution, solve_scores

from .drawing import style
from .drawing.camera import Image, fitted_camera
from .drawing.contact_labels import dot, photograph
from .drawing.stage import Stage, solution_poses, solution_solids
from .drawing.viewpoints import focus_of, viewpoints
from .drawing.views import show

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SIZE: Final = (1560, 560)
_PICTURE: Final = (470, 470)
_PLOT: Final = 520


def sweep_weight(
    hand: Hand, obj: GraspObject, command: GraspCommand, criterion: str, weights: Sequence[float]
) -> list[GraspSolution]:
    """Solve once for every weight of a criterion; the command's other weights stay.

    Args:
        hand, obj, command: the problem; the command's criteria are weights by name. criterion: whose weight changes.
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
    """Write a figure of two criteria over the weight of the first, and of the grasps at the first and the last weight.

    Args:
        hand, obj: hand and object. solutions: of `sweep_weight`, one for every weight. criteria: the one whose weight
            changed, and one that pays for it. weights: above 0, rising. path: the PNG file.
    """
    figure = style.new_figure(*_SIZE)
    width, height = _SIZE
    letters = _letters(solutions)
    for row, name in enumerate(criteria):
        low = 80 + (1 - row) * 210
        plot = figure.add_axes((80 / width, low / height, (_PLOT - 120) / width, 180 / height))
        _draw_values(plot, [solve_scores(s)[name] for s in solutions], weights, name, letters)
        if row:
            plot.set_xlabel(f"weight of {criteria[0]} (the others keep theirs)")
        else:
            plot.tick_params(labelbottom=False)
    title = f"{hand.name} on {obj.name}: how much {criteria[0]} counts decides which grasp is chosen"
    style.write(figure, 0.5, 1.0 - 22 / height, title, fontsize=13, ha="center")
    ends = (0, len(solutions) - 1)
    panels = _photographs(hand, obj, [solutions[k] for k in ends])
    for place, k in enumerate(ends):
        left = _PLOT + 20 + place * (_PICTURE[0] + 40)
        axes = figure.add_axes((left / width, 5 / height, _PICTURE[0] / width, _PICTURE[1] / height))
        image, points, hidden = panels[place]
        show(axes, image, _PICTURE)
        for (x, y), behind in zip(points, hidden, strict=True):
            dot(axes, float(x), float(y), bool(behind), 7.0)
        scores = solve_scores(solutions[k])
        told = ", ".join(f"{n} {scores[n]:.3g} {find_criterion(n, 'sweep').unit}" for n in criteria)
        head = f"{letters[k]}, chosen at weight {weights[k]:g}" + (_changed(solutions) if place else "")
        middle = (left + _PICTURE[0] / 2) / width
        style.write(figure, middle, 1.0 - 52 / height, head, ha="center", fontsize=11, fontweight="bold")
        style.write(figure, middle, 1.0 - 72 / height, told, ha="center")
    return style.save_figure(figure, path)


def _letters(solutions: Sequence[GraspSolution]) -> list[str]:
    """Return a letter for every solution, the same for the same candidates, in the order in which they come."""
    candidates = [tuple(f.chosen for f in s.fingers.values()) for s in solutions]
    known = list(dict.fromkeys(candidates))
    return [f"grasp {ascii_uppercase[known.index(chosen) % 26]}" for chosen in candidates]


def _changed(solutions: Sequence[GraspSolution]) -> str:
    """Return which fingers take another candidate at the last weight than at the first."""
    first, last = solutions[0].fingers, solutions[-1].fingers
    names = [name for name in last if last[name].chosen != first[name].chosen]
    return f": {' and '.join(names)} elsewhere" if names else ": the same"


def _draw_values(plot: Axes, values: Sequence[float], weights: Sequence[float], name: str, letters: list[str]) -> None:
    """Draw the values of a criterion over the weight, with a band for every grasp that is chosen."""
    c = find_criterion(name, "sweep")
    places = np.log10(np.asarray(weights))
    borders = 10.0 ** np.concatenate([[places[0] - 0.15], (places[1:] + places[:-1]) / 2.0, [places[-1] + 0.15]])
    known = list(dict.fromkeys(letters))
    for letter in known:
        own = [k for k in range(len(letters)) if letters[k] == letter]
        color = style.JOINT_COLORS[known.index(letter) % len(style.JOINT_COLORS)]
        for k in own:
            plot.axvspan(borders[k], borders[k + 1], color=style.mixed(color, style.PAPER, 0.8), lw=0)
            plot.plot([borders[k], borders[k + 1]], [values[k]] * 2, color=color, lw=3.0)
        plot.plot([weights[k] for k in own], [values[k] for k in own], "o", color=color, ms=7)
        middle = 10.0 ** (np.log10([borders[own[0]], borders[own[-1] + 1]]).mean())
        plot.annotate(letter, (middle, 0.9), xycoords=("data", "axes fraction"), ha="center", va="center", color=color)
    plot.set_xscale("log")
    plot.set_xlim(borders[0], borders[-1])
    plot.margins(y=0.35)
    plot.set_title(f"{name} [{c.unit}], {'more' if c.larger_is_better else 'less'} is better", fontsize=10, loc="left")
    plot.grid(alpha=0.3, axis="y")


def _photographs(
    hand: Hand, obj: GraspObject, solutions: Sequence[GraspSolution]
) -> list[tuple[Image, FloatArray, NDArray[np.bool_]]]:
    """Return the image of every grasp from one side, and where its contacts are in it, with those that are hidden."""
    solids = solution_solids(hand, obj, solutions[0])
    poses = [solution_poses(hand, solids, solution) for solution in solutions]
    places = [np.array([c.position for c in s.contacts if not c.passed]).reshape(-1, 3) for s in solutions]
    found = []
    with Stage(solids, poses[-1]) as stage:
        focus = focus_of(stage)
        towards = viewpoints(stage, focus, places[-1], 1)[0]
        stage.pose(poses[0])
        camera = fitted_camera(towards, np.concatenate([focus, focus_of(stage)]), _PICTURE)
        for posed, points in zip(poses, places, strict=True):
            stage.pose(posed)
            image, _, hidden = photograph(stage, camera, points)
            found.append((image, camera.project(points)[:, :2], hidden))
    return found
