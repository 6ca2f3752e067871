"""Time what closing GraspIt!'s own hands costs, in our default order and by its law, on its meshes and objects.

Run from `tests`: ``python -m graspit.cost``. Times are of the processor, all threads together: per pose the least of a
few passes in which both orders take turns, then the median over the poses. DLR is closed at the poses of its cases;
Robonaut has none, and is closed at approach poses.
"""

from __future__ import annotations

import argparse
import sys
import time
from itertools import islice

import numpy as np

import clench
from clench.models.hand.hand import Hand

from .compare import OBJECTS, SHARED, load_hand, read_cases

HANDS = ("Robonaut_13DOF", "DLR")
ORDERS = (clench.ClosingOrder.PROXIMAL_FIRST, clench.ClosingOrder.TOGETHER)


def poses_of(hand: Hand, folder: str, name: str, obj: clench.GraspObject, count: int) -> list[clench.Pose]:
    """Return the poses that a hand is closed at."""
    if folder != "DLR":
        return list(clench.approach_poses(hand, obj, count, 0))
    placed = (case["hand_pose_in_object"] for case in islice(read_cases(name), count))
    return [clench.Pose(p["t"], wxyz=np.array(p["q_wxyz"]) / np.linalg.norm(p["q_wxyz"])) for p in placed]


def times_of(hand: Hand, obj: clench.GraspObject, poses: list[clench.Pose], passes: int) -> np.ndarray:
    """Return the least processor time per order and pose [ms], shape (2, N)."""
    taken = np.full((len(ORDERS), len(poses)), np.inf)
    for _ in range(passes + 1):  # the first one loads kernels and plans the hand
        for i, pose in enumerate(poses):
            for k, order in enumerate(ORDERS):
                command = clench.GraspCommand(hand_pose=pose, order=order, measure=False, preshape="open")
                began = time.process_time()
                solution = clench.solve(hand, obj, command)
                _ = solution.status, solution.joint_angles, solution.certified
                taken[k, i] = min(taken[k, i], 1e3 * (time.process_time() - began))
    return taken


def triangles_of(hand: Hand) -> int:
    """Return how many triangles the links have that are closed."""
    shapes = (shape for link in hand.links for shape in link.shapes.get(hand.default_source, ()))
    return sum(len(shape.mesh.triangles) for shape in shapes if shape.mesh is not None)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hand", choices=HANDS, help="only this one")
    parser.add_argument("--poses", type=int, default=12)
    parser.add_argument("--passes", type=int, default=2)
    asked = parser.parse_args()
    sys.stdout.write("| hand | triangles | object | default order, median (90 %) ms | together, median (90 %) ms |\n")
    for folder in [asked.hand] if asked.hand else HANDS:
        hand = load_hand(SHARED / "hands" / folder)
        for name in OBJECTS:
            obj = clench.GraspObject.load(SHARED / "objects" / f"{name}.obj")
            taken = times_of(hand, obj, poses_of(hand, folder, name, obj, asked.poses), asked.passes)
            told = [f"{np.median(row):.3g} ({np.percentile(row, 90):.3g})" for row in taken]
            sys.stdout.write(f"| {folder} | {triangles_of(hand)} | {name} | {told[0]} | {told[1]} |\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
