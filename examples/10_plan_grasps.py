"""Find where to put the hand: plan grasps of an object, try the best one in simulation, and write all of them."""

import sys
from pathlib import Path

import clench

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "clench_out")
folder.mkdir(parents=True, exist_ok=True)
hand = clench.Hand.load("robonaut2")
ball = clench.GraspObject.load("ball")

# No wrist pose, no preshape. The best grasps come first; they are the same for the same seed.
plan = clench.plan_grasps(hand, ball, 3, effort=16, friction=(0.4, 0.8), seed=1)
print(plan.text)
for number, grasp in enumerate(plan, start=1):
    print(f"{number}: {grasp}")
print("most proposals fell for:", max(plan.rejected, key=plan.rejected.__getitem__))

# Every grasp has its solution, its squeeze, and a path from the open hand that is proven free.
best = plan[0]
assert best.solution.is_valid()
print(f"{best.trajectory.duration:.2f} s to the touch, then at most {max(best.squeeze.torques.values()):.3f} Nm")

# The free object is closed on, squeezed, and pulled in six directions.
report = clench.execute(best.solution, clench.SimulatedHand(hand, ball, hold=clench.execution.Hold()))
print(report.hold.reason)
assert report.hold.held

# Other programs read all of them from one file (format isaac_grasp).
file = folder / "grasps.yaml"
export = clench.export_grasps(file, [grasp.solution for grasp in plan], hand=hand, obj=ball)
print(f"{file.name}: {len(plan)} grasps with confidences {export.confidences}")
