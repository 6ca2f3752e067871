"""Start without a wrist pose: plan grasps of an object of your own."""

import numpy as np

import clench

hand = clench.Hand.load("robonaut2")

# Vertices [m] and triangles, counter-clockwise seen from outside; a mesh file loads by path.
corners = np.array([[x, y, z] for x in (-0.03, 0.03) for y in (-0.02, 0.02) for z in (0.0, 0.12)])
triangles = [
    *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5]),
    *([0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6]),
    *([0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
]
box = clench.GraspObject.from_meshes([(corners, triangles)], name="box")
print("warnings:", box.warnings or "none")

plan = clench.plan_grasps(hand, box, 3, effort=20)
print(plan.text)
for grasp in plan:
    print(grasp)
best = plan[0]
print(f"best: palm at {best.hand_pose.position.round(4)} m, {100 * best.confidence:.0f} % of such grasps held.")
assert best.solution.is_valid()
