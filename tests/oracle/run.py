"""Judge random cases by the oracles, any number: ``cd tests && python -m oracle.run --planar 1000000 --width 1000000``.

The planar oracle walks conservatively along the path of a finger on one plane; that of the full width does so in three
dimensions with python-fcl's distances. Cases follow from the seed and their number alone. Grazing stops, beyond which
nothing gets deeper than the tolerance, and paths that took too many steps to prove are counted apart.
"""

import argparse
import os
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from oracle.test_against_oracle import judge
from oracle.width import judge_places
from resumable import each

ORDERS = (
    *("proximal-first", "together", "speeds", "fingertip"),
    *("tilted proximal-first", "tilted together", "tilted speeds", "tilted fingertip"),
)
#: Cases of one piece of work; places of the object for each random finger of the full width.
PLANAR, FINGERS, PLACES = 500, 20, 10
COLUMNS = ("cases", "blocked", "contacts", "stages", "grazing", "unresolved", "wrong")


def planar(seed: int, first: int, count: int) -> dict[str, Any]:
    """Judge planar cases."""
    counted, wrong = judge(seed, count, first)
    columns = {
        "cases": count,
        "blocked": counted["overlap"],
        "contacts": counted["contacts"],
        "stages": counted["stages"],
        "grazing": counted["grazing"],
        "unresolved": counted["unresolved"],
        "wrong": len(wrong),
    }
    return {"counted": columns, "wrong": wrong}


def width(order: str, seed: int, first: int) -> dict[str, Any]:
    """Judge the full width of some fingers, each with an object in several places."""
    found = [j for k in range(first, first + FINGERS) for j in judge_places(10**7 * seed + k, order, PLACES)]
    columns = {
        "cases": len(found),
        "blocked": sum(j.kind == "blocked" for j in found),
        "contacts": sum(j.kind == "contact" for j in found),
        "stages": sum(j.stages for j in found),
        "grazing": sum(j.grazing for j in found),
        "unresolved": sum(j.unresolved for j in found),
        "wrong": sum(bool(j.wrong) for j in found),
    }
    return {"counted": columns, "wrong": [sentence for j in found for sentence in j.wrong]}


def work(kind: str, *given: Any) -> dict[str, Any]:
    """Judge one piece of either kind."""
    return planar(*given) if kind == "planar" else width(kind, *given)


def pieces(planes: int, widths: int, seed: int) -> list[tuple[Any, ...]]:
    """Return what to do for so many cases; kinds take turns, so that a run that is ended has seen all."""
    each_order = -(-widths // (len(ORDERS) * FINGERS * PLACES))
    flat = [("planar", seed, first, min(PLANAR, planes - first)) for first in range(0, planes, PLANAR)]
    full = [(order, seed, FINGERS * k) for k in range(each_order) for order in ORDERS]
    turns = [(k / len(part), piece) for part in (flat, full) for k, piece in enumerate(part)]
    return [piece for _, piece in sorted(turns, key=lambda turn: turn[0])]


def main() -> int:
    """Print a row per kind of case."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--planar", type=int, default=10_000, help="cases on one plane")
    parser.add_argument("--width", type=int, default=4_000, help="cases of the full width, of all orders")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--file", type=Path, help="keeps what was found; a run goes on with it")
    parser.add_argument("--seconds", type=float, help="nothing new is begun after so long")
    asked = parser.parse_args()
    total = {kind: Counter[str]() for kind in ("planar", *ORDERS)}
    todo = pieces(asked.planar, asked.width, asked.seed)
    for piece, found in each(work, todo, asked.processes, asked.file, asked.seconds):
        total[piece[0]].update(found["counted"])
        for sentence in found["wrong"]:
            print(sentence, file=sys.stderr, flush=True)
    print("| cases of | " + " | ".join(COLUMNS) + " |")
    print("|---|" + "---|" * len(COLUMNS))
    total["all"] = sum(total.values(), Counter())
    for kind, counted in total.items():
        print(f"| {kind} | " + " | ".join(str(counted[c]) for c in COLUMNS) + " |")
    return 1 if total["all"]["wrong"] else 0


if __name__ == "__main__":
    raise SystemExit(main())
