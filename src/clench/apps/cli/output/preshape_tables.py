"""Print tables of preshapes: those of a hand, and those that were compared for a solution."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from clench.solver.solution import posture_reason

from .tables import console_out, plain, print_table, table_with

if TYPE_CHECKING:
    from clench.solver.preshapes.preshapes import Preshape
    from clench.solver.solution import GraspSolution


def print_preshapes(preshapes: Sequence[Preshape]) -> None:
    """Print the preshapes of a hand: how far apart its pads are, and how well they oppose."""
    console = console_out()
    if not preshapes:
        console.print("preshapes: none, as no two fingers close towards each other")
        return
    title = "preshapes (a command may name one)"
    table = table_with(title, "name", "aperture [mm]", "best at [mm]", "opposition")
    for said in (shape.to_dict() for shape in preshapes):
        if said["quality"] is None:
            table.add_row(plain(said["name"]), "", "", "none")
            continue
        low, high = (f"{1e3 * length:z.0f}" for length in said["aperture_range"])
        best = f"{1e3 * said['aperture']:z.0f}"
        table.add_row(plain(said["name"]), f"{low} to {high}", best, f"{said['quality']:z.2f}")
    print_table(console, table)


def print_posture_choice(solution: GraspSolution) -> None:
    """Print the preshape that clench chose, and the comparison; print nothing if the command left no choice."""
    said = posture_reason(solution)
    if said is None:
        return
    console, compared = console_out(), said["compared"]
    names = list(dict.fromkeys(name for each in compared.values() for name in each["scores"]))
    words = [name.replace("_", " ") for name in names]
    title = "preshapes that were compared (* chosen, 2 next best; epsilon: a lower bound)"
    table = table_with(title, "", "preshape", "status", "epsilon", *words, "sum")
    table.columns[1].no_wrap = True
    marks = {said["chosen"]: "*", said["runner_up"]: "2"}
    for name, each in compared.items():
        scores = [f"{each['scores'][key]:.4g}" if key in each["scores"] else "" for key in names]
        bound, total = f"{each['epsilon_bound']:z.3f}", f"{each['total']:z.4f}"
        row = (marks.get(name, ""), name, each["status"], bound, *scores, total)
        table.add_row(*map(plain, row))
    print_table(console, table)
    console.print(plain(said["text"]), soft_wrap=True)
