"""Time batches in a process of its own, for this version of the package or for another one.

The program imports nothing but the package and NumPy, so the Python of an environment with another version can run it.
The first line of its input is a job, a JSON object with the keys of `Case`, by list. Each further line is the number of
a case, which it times once. Every answer is a JSON line.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import clench


def load(case: dict[str, Any]) -> Callable[[], Any]:
    """Return a call that solves a batch.

    Args:
        case: hand (name or path), geometry (or null), object (name, path or shape), scale, order, and poses: rows
            [w, x, y, z, X, Y, Z] of the palm.
    """
    chosen = {} if case["geometry"] is None else {"collision_source": case["geometry"]}
    hand = clench.Hand.load(case["hand"], **chosen)
    obj = clench.GraspObject.load(case["object"], scale=case["scale"])
    asked: dict[str, Any] = {"hand_pose": clench.Pose.identity(), "order": clench.ClosingOrder(case["order"])}
    # Versions without a planner have no named preshapes, and close the open hand by default.
    if hasattr(clench, "plan_grasps"):
        asked["preshape"] = "open"
    command = clench.GraspCommand(**asked, measure=False)
    poses = np.array(case["poses"])
    return lambda: clench.solve_batch(hand, obj, poses, command, threads=1, progress=False)


def main() -> int:
    """Answer every line of standard input."""
    calls = [load(case) for case in json.loads(sys.stdin.readline())]
    # The first call compiles or loads kernels, and plans and packs.
    batches = [call() for call in calls]
    answers = [{"angles": b.joint_angles.tolist(), "status": [str(s) for s in b.status]} for b in batches]
    _say({"version": clench.__version__, "answers": answers})
    for line in sys.stdin:
        # Untimed, so that a plan that a version did not keep over the other cases is there again.
        calls[int(line)]()
        began = time.process_time()
        calls[int(line)]()
        _say(time.process_time() - began)
    return 0


def _say(answer: Any) -> None:
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
