"""Lay an object on a table in its most probable poses, and grasp it from above."""

import clench

hand = clench.Hand.load("robonaut2")
bottle = clench.GraspObject.load("bottle")

for stable in clench.stable_poses(bottle)[:3]:
    down = -stable.pose.rotation[2]
    print(f"{stable.probability:.1%} of drops: {down.round(2) + 0.0} points down", end="; ")

    scene = stable.on_table(bottle)
    above = [p for p in clench.approach_poses(hand, scene, 40, seed=1) if p.position[2] > stable.center_height]
    solutions = (clench.solve(hand, scene, clench.GraspCommand(hand_pose=pose)) for pose in above)
    found = next((s for s in solutions if s.status == "grasp" and s.is_valid()), None)
    print("no grasp" if found is None else f"a {clench.mechanics.grasp_kind(found, hand, scene)} grasp")
