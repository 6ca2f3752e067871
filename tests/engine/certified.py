"""Judge certified grasps of every hand on every object by python-fcl, and print a table.

Run ``python tests/engine/certified.py --poses 50 --file certified.jsonl``; it takes hours, fewer poses a part of that.
A run that was ended goes on where it was. On the closing path, every joint backed off by 1e-5 rad where it stops,
nothing may collide; at most 1e-3 rad beyond a contact, its joint alone, the finger must. Of the orders in which all
joints move at once, the path is judged alone.
"""

import argparse
import os
import sys
from collections import Counter
from functools import lru_cache
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import clench
from clench.models.command import ClosingOrder
from engine.collisions import Collisions, trees_of_links
from engine.statistics import HANDS, SHARED
from resumable import each

COLUMNS = {
    "solves": "solves",
    "certified": "certified",
    "contacts": "contacts that stop a joint",
    "shallow": "of them less than 1 um deep 1e-3 rad beyond",
    "postures": "postures on paths",
    "gap": "gaps above 1e-9 m",
    "wrong": "wrong",
    "unreachable": "poses out of reach",
}


def meshes() -> list[Path]:
    """Return the mesh of every object."""
    folders = sorted((SHARED / "objects").iterdir())
    return [next(iter(sorted(folder.glob("*.obj")) or sorted(folder.glob("*.stl")))) for folder in folders]


@lru_cache(maxsize=len(HANDS))
def load_hand(name: str) -> tuple[clench.Hand, list[list[Any]]]:
    """Load a hand once, with the triangles of its links."""
    hand = clench.Hand.load(SHARED / HANDS[name])
    return hand, trees_of_links(hand)


def judge(name: str, mesh: str, poses: int, seed: int, order: str = ClosingOrder.PROXIMAL_FIRST) -> dict[str, Any]:
    """Solve one hand on one object from several poses; return what was counted, and a sentence for each mistake."""
    (hand, links), obj = load_hand(name), clench.GraspObject.load(mesh)
    counted: Counter[str] = Counter()
    wrong = []
    collisions = Collisions(hand, obj, links)
    try:
        drawn = clench.approach_poses(hand, obj, poses, seed)
    except clench.ClenchError:
        return {"counted": {"unreachable": poses}, "wrong": []}
    for number, pose in enumerate(drawn):
        solution = clench.solve(
            hand, obj, clench.GraspCommand(hand_pose=pose, order=ClosingOrder(order), preshape="open")
        )
        counted["solves"] += 1
        counted["certified"] += solution.certified
        counted["gap"] += any(abs(c.gap) > 1e-9 for c in solution.contacts if not c.passed)
        if solution.certified:
            at_once = order != ClosingOrder.PROXIMAL_FIRST
            seen, sentences = collisions.wrong_at_once(solution) if at_once else collisions.wrong(solution)
            counted += seen
            wrong += [f"{name}, {Path(mesh).parent.name}, seed {seed}, pose {number}: {s}" for s in sentences]
    counted["wrong"] += len(wrong)
    return {"counted": dict(counted), "wrong": wrong}


def main() -> None:
    """Print one row per hand."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--poses", type=int, default=50)
    parser.add_argument("--at-once", type=int, default=10, help="poses of one hand and object that are solved in a row")
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--order", choices=list(ClosingOrder), default=ClosingOrder.PROXIMAL_FIRST)
    parser.add_argument("--hands", nargs="*", default=list(HANDS))
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--file", type=Path, help="keeps what was found; a run goes on with it")
    parser.add_argument("--seconds", type=float, help="nothing new is begun after so long")
    asked = parser.parse_args()
    total: dict[str, Counter[str]] = {name: Counter() for name in asked.hands}
    # Of every hand and object a few poses before any more of them: a run that is ended has seen all.
    order = () if asked.order == ClosingOrder.PROXIMAL_FIRST else (str(asked.order),)
    pieces = [
        (name, str(mesh), min(asked.at_once, asked.poses - first), 1000 * asked.seed + first, *order)
        for first in range(0, asked.poses, asked.at_once)
        for mesh in meshes()
        for name in asked.hands
    ]
    for piece, found in each(judge, pieces, asked.processes, asked.file, asked.seconds):
        total[piece[0]].update(found["counted"])
        for sentence in found["wrong"]:
            print(sentence, file=sys.stderr)
    print("| hand | " + " | ".join(COLUMNS.values()) + " |")
    print("|---|" + "---|" * len(COLUMNS))
    total["all"] = sum(total.values(), Counter())
    for name, c in total.items():
        print(f"| {name} | " + " | ".join(str(c[key]) for key in COLUMNS) + " |", flush=True)


if __name__ == "__main__":
    main()
