"""Judge certified grasps of every hand on every object by python-fcl, and print a table.

Run ``python tests/engine/certified.py --poses 50``; it takes hours, fewer poses a part of that. On the closing path,
every joint backed off by 1e-5 rad where it stops, nothing may collide; 1e-3 rad beyond a contact, its joint alone, the
finger must.
"""

import argparse
import os
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import clench
from engine.collisions import Collisions
from engine.statistics import HANDS, SHARED


def meshes() -> list[Path]:
    """Return the mesh of every object."""
    folders = sorted((SHARED / "objects").iterdir())
    return [next(iter(sorted(folder.glob("*.obj")) or sorted(folder.glob("*.stl")))) for folder in folders]


def judge(name: str, mesh: Path, poses: int, seed: int) -> tuple[str, Counter[str], list[str]]:
    """Solve one hand on one object from several poses; return what was counted, and a sentence for each mistake."""
    hand, obj = clench.Hand.load(SHARED / HANDS[name]), clench.GraspObject.load(mesh)
    counted: Counter[str] = Counter()
    wrong = []
    collisions = Collisions(hand, obj)
    try:
        drawn = clench.approach_poses(hand, obj, poses, seed)
    except clench.ClenchError:
        return name, Counter(unreachable=1), []
    for number, pose in enumerate(drawn):
        solution = clench.solve(hand, obj, clench.GraspCommand(hand_pose=pose))
        counted["solves"] += 1
        counted["certified"] += solution.certified
        counted["gap"] += any(abs(c.gap) > 1e-9 for c in solution.contacts if not c.passed)
        if solution.certified:
            try:
                counted["contacts"] += collisions.check(solution)
            except AssertionError as error:
                wrong.append(f"{name}, {mesh.parent.name}, seed {seed}, pose {number}: {str(error)[:300]}")
    counted["wrong"] += len(wrong)
    return name, counted, wrong


def main() -> None:
    """Print one row per hand."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--poses", type=int, default=50)
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--hands", nargs="*", default=list(HANDS))
    asked = parser.parse_args()
    total: dict[str, Counter[str]] = {name: Counter() for name in asked.hands}
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        jobs = [pool.submit(judge, n, mesh, asked.poses, asked.seed) for n in asked.hands for mesh in meshes()]
        for job in jobs:
            name, counted, wrong = job.result()
            total[name] += counted
            for sentence in wrong:
                print(sentence, file=sys.stderr)
    print(
        "| hand | solves | certified | contacts that stop a joint | gaps above 1e-9 m | wrong | objects out of reach |"
    )
    print("|---|---|---|---|---|---|---|")
    for name, c in total.items():
        cells = [c[key] for key in ("solves", "certified", "contacts", "gap", "wrong", "unreachable")]
        print(f"| {name} | " + " | ".join(map(str, cells)) + " |", flush=True)


if __name__ == "__main__":
    main()
