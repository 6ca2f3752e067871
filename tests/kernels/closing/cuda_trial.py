"""Close fingers in the CUDA simulator and on the CPU; print whether the answers agree, for `test_cuda_closing`."""

from __future__ import annotations

import warnings

import numpy as np

import clench

COLUMNS = ("joint_angles", "status_codes", "certified", "planes")


def main() -> None:
    """Compare a hand on a round object and on a mesh, on planes alone and certified."""
    warnings.simplefilter("error")
    hand = clench.Hand.load("robonaut2")
    for name in ("sphere:r=0.03", "box:x=0.05,y=0.05,z=0.09"):
        obj = clench.GraspObject.load(name)
        poses = clench.approach_poses(hand, obj, 3, seed=1)
        for full in (False, True):
            command = clench.GraspCommand(hand_pose=poses[0], planes=2, full_width=full, preshape="open")
            cpu, device = (clench.solve_batch(hand, obj, poses, command, threads=2, device=d) for d in ("cpu", "cuda"))
            same = all(np.array_equal(getattr(cpu, column), getattr(device, column)) for column in COLUMNS)
            kinds = "certified" if full else "planes"
            print(name, kinds, len(cpu.contacts.gap), "contacts", "same" if same else "different")


if __name__ == "__main__":
    main()
