"""Look at every candidate and its scores, save a solution, and keep all of them in a record."""

import sys
from pathlib import Path

import clench

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "clench_out")
folder.mkdir(parents=True, exist_ok=True)
hand, bottle = clench.Hand.load("robonaut2"), clench.GraspObject.load("bottle")

with clench.Record(folder / "record.sqlite") as record:
    for pose in clench.approach_poses(hand, bottle, count=5, seed=7):
        # Measure the penetration of every candidate. Without a preshape, this would be for all preshapes.
        command = clench.GraspCommand(hand_pose=pose, preshape="open", seed=7, check_candidates=True)
        solution = clench.solve(hand, bottle, command, record=record)
    print(f"{len(record)} solves recorded")
    for entry in record.find(limit=5):
        print(f"  {entry.id}: {entry.status.value}, {entry.touching_fingers} fingers touch")
    newest = record.read(record.find(limit=1)[0].id)
assert newest == solution

for name, finger in solution.fingers.items():
    print(f"{name}: {finger.reason}")
    for i, candidate in enumerate(finger.candidates):
        plane = "full width" if candidate.plane is None else f"plane {candidate.plane}"
        depth = "not measured" if candidate.penetration is None else f"{candidate.penetration * 1e3:.3f} mm deep"
        scores = ", ".join(f"{criterion} {score:.2f}" for criterion, score in candidate.scores.items())
        print(f"  {'*' if i == finger.chosen else ' '} {plane:10} {depth:14} {scores}")

solution.save(folder / "solution.json")
assert clench.GraspSolution.load(folder / "solution.json") == solution
for sentence in solution.violations():
    print("violation:", sentence)
