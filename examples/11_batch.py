"""Solve at many wrist poses in one call, read the answers as arrays, and save them."""

import sys
from pathlib import Path

import numpy as np

import clench

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "clench_out")
folder.mkdir(parents=True, exist_ok=True)
hand = clench.Hand.load("robonaut2")
ball = clench.GraspObject.load("ball")

poses = clench.approach_poses(hand, ball, 100, seed=0)  # or your own: rows [w, x, y, z, X, Y, Z], or (N, 4, 4)
batch = clench.solve_batch(hand, ball, poses)
print(", ".join(f"{count} {status}" for status, count in batch.counts().items() if count))

good = np.flatnonzero((batch.status == "grasp") & batch.certified)
index = batch.joint_names.index("index_proximal")
print(f"index_proximal: {batch.joint_angles[good, index].min():.2f} to {batch.joint_angles[good, index].max():.2f} rad")

# The contacts of all poses are one table. Those of pose i are the rows first[i] to first[i + 1].
first = int(good[0])
rows = slice(batch.contacts.first[first], batch.contacts.first[first + 1])
print(f"pose {first}: {len(batch.contacts.position[rows])} contacts")

# One ordinary solve tells everything about one pose, with the same bits.
solution = batch.solution(first)
assert list(solution.joint_angles.values()) == batch.joint_angles[first].tolist()
print(f"pose {first}: {solution.reason['text']}")

batch.save(folder / "grasps.npz")
print("saved as", (folder / "grasps.npz").name)
