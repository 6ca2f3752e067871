"""Put the object on a table that the fingers must not hit, and write the timed motion as a file."""

import sys
from pathlib import Path

import clench

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "clench_out")
folder.mkdir(parents=True, exist_ok=True)
hand = clench.Hand.load("robonaut2")
scene = clench.GraspObject.load("mug").with_body(clench.table(height=0.0))

command = clench.GraspCommand(hand_pose=clench.Pose([-0.05, -0.1, 0.08], wxyz=[0.5, 0.5, 0.5, 0.5]))
solution = clench.solve(hand, scene, command)
print(f"{solution.status.value}: {solution.reason['text']}")
for name, finger in solution.fingers.items():
    print(f"  {name}: {finger.reason}")

trajectory = clench.plan_trajectory(solution, hand, obj=scene)
trajectory.save(folder / "trajectory.json")
print(f"{trajectory.duration:.2f} s for {len(trajectory.times)} points of {len(trajectory.joints)} joints")
assert trajectory.at(trajectory.duration)[0] == solution.joint_angles[trajectory.joints[0]]
