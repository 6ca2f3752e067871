"""Start without a wrist pose: draw approach poses around an object of your own and keep the best grasp."""

import numpy as np

import clench

hand = clench.Hand.load("patent15")

# Vertices [m] and triangles, counter-clockwise seen from outside; a mesh file loads by path.
corners = np.array([[x, y, z] for x in (-0.03, 0.03) for y in (-0.02, 0.02) for z in (0.0, 0.12)])
triangles = [
    *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5]),
    *([0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6]),
    *([0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
]
box = clench.GraspObject.from_meshes([(corners, triangles)], name="box")
print("warnings:", box.warnings or "none")

poses = clench.approach_poses(hand, box, count=20, seed=1)
solutions = [clench.solve(hand, box, clench.GraspCommand(hand_pose=pose, seed=1)) for pose in poses]


def merit(solution: clench.GraspSolution) -> tuple[bool, int, float]:
    touching = sum(finger.status is clench.FingerStatus.TOUCH for finger in solution.fingers.values())
    return solution.status is clench.SolutionStatus.GRASP, touching, -solution.max_penetration


best = max(solutions, key=merit)
for status in clench.SolutionStatus:
    print(f"{status.value:12} {sum(s.status is status for s in solutions)}")
print(f"best: {best.reason['text']} Palm at {best.hand_pose.position.round(4)} m.")
assert merit(best)[1] >= 1
