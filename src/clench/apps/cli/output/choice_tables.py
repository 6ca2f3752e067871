"""Tables of a choice: the criteria, the candidates of every finger, the closing orders and the Pareto front."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from .tables import console_out, plain, print_table, table_with

if TYPE_CHECKING:
    from rich.table import Table

    from clench.solver.analysis.pareto import HandSets
    from clench.solver.solution import Candidate, FingerResult, GraspSolution

#: Rows of a table that may be long.
_MOST_ROWS = 10


def plain_front(solution: GraspSolution) -> list[dict[str, Any]]:
    """Return the Pareto front over all fingers in its JSON form."""
    from clench.solver.analysis.pareto import hand_front

    return [entry.to_dict() for entry in hand_front(solution)]


def print_choice(solution: GraspSolution) -> None:
    """Print the criteria, the candidates of every finger, and the sentences; print nothing if the solution has none."""
    from clench.solver.analysis.pareto import hand_front

    out, choice = console_out(), solution.choice
    if choice is None:
        out.print("The solution does not say how its candidates were chosen.")
        return
    print_table(out, _criteria_table(choice))
    if choice["unused"]:
        out.print(f"said nothing about any candidate: {plain(', '.join(choice['unused']))}")
    for name, finger in solution.fingers.items():
        if name in choice["fingers"]:
            print_table(out, _finger_table(finger, choice))
            out.print(plain(f"{name}: {choice['fingers'][name]['text']}"))
            if choice["fingers"][name]["closed_again"]:
                out.print(plain(f"{name} met another finger and was closed again; its sum is that of before."))
    if "orders" in choice:
        print_table(out, _orders_table(choice["orders"]))
        out.print(plain(choice["orders"]["text"]))
    front = hand_front(solution)
    if len(front) > 1:
        print_table(out, _front_table(front, choice))
    for name, value in choice["final_hand_scores"].items():
        out.print(plain(f"{name} of the hand: {value:.4g} {choice['criteria'][name]['unit']}"))
    out.print(f"[bold]{plain(choice['text'])}[/bold]")
    if choice["combinations_tried"] and choice.get("proved"):
        judged, every = choice["combinations_tried"], choice["combinations"]
        out.print(f"No combination of one candidate per finger is better ({judged} of {every} had to be judged).")


def _criteria_table(choice: Mapping[str, Any]) -> Table:
    result = table_with(
        f"criteria ({choice['calibration']})",
        "criterion",
        "unit",
        "better",
        "weight [-]",
        "counts as 1 [unit]",
        "limit [unit]",
    )
    for name, c in choice["criteria"].items():
        limit = "" if c["limit"] is None else f"{c['limit']:g}"
        result.add_row(*map(plain, (name, c["unit"], c["better"], f"{c['weight']:g}", f"{c['scale']:g}", limit)))
    return result


def _finger_table(finger: FingerResult, choice: Mapping[str, Any]) -> Table:
    """List a finger's candidates: the scores that counted, the weighted sum, and how each ended."""
    said = choice["fingers"][finger.name]
    names = [n for n in choice["criteria"] if any(n in c.scores for c in finger.candidates)]
    title = f"{finger.name} (* chosen, 2 runner-up, P on the Pareto front, x may not be taken)"
    result = table_with(title, "", "candidate", "finger posture", *_with_units(names, choice), "sum [-]", "status")
    for i, candidate in enumerate(finger.candidates):
        mark = "*" if i == finger.chosen else "2" if i == said["runner_up"] else ""
        mark += "P" if i in said["pareto"] else ""
        mark += "x" if candidate.feasible is False else ""
        where = "full" if candidate.plane is None else f"plane {candidate.plane}"
        scores = [_score(candidate, name) for name in names]
        row = (mark, where, str(candidate.posture), *scores, f"{said['totals'][i]:z.4f}", candidate.status.value)
        result.add_row(*map(plain, row))
    return result


def _orders_table(orders: Mapping[str, Any]) -> Table:
    """List the closing orders that were solved, or why they could not be."""
    result = table_with("closing orders (* chosen)", "", "order", "status", "sum [-]")
    for name, said in orders["compared"].items():
        status, total = (said["refused"], "") if "refused" in said else (said["status"], f"{said['total']:z.4f}")
        result.add_row(*map(plain, ("*" if name == orders["chosen"] else "", name, status, total)))
    return result


def _front_table(front: Sequence[HandSets], choice: Mapping[str, Any]) -> Table:
    """List combinations over all fingers that no other beats in every criterion, by the numbers of their candidates."""
    title = f"Pareto front of the hand, {len(front)} combinations by weighted sum (* chosen; candidates from 0)"
    result = table_with(title, "", *front[0].candidates, *_with_units(front[0].scores, choice), "sum [-]")
    for entry in front[:_MOST_ROWS]:
        scores = [f"{v:.4g}" for v in entry.scores.values()]
        row = ("*" if entry.chosen else "", *map(str, entry.candidates.values()), *scores, f"{entry.total:z.4f}")
        result.add_row(*map(plain, row))
    return result


def _with_units(names: Iterable[str], choice: Mapping[str, Any]) -> list[str]:
    """Return criteria as heads of columns, with their units."""
    return [f"{name.replace('_', ' ')} [{choice['criteria'][name]['unit']}]" for name in names]


def _score(candidate: Candidate, name: str) -> str:
    return f"{candidate.scores[name]:.4g}" if name in candidate.scores else ""
