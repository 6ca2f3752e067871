"""Write the same grasps for other programs, and read them back."""

import sys
from pathlib import Path

import clench

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "clench_out")
folder.mkdir(parents=True, exist_ok=True)
hand = clench.Hand.load("robonaut2")
ball = clench.GraspObject.load("ball")
plan = clench.plan_grasps(hand, ball, 2, effort=16, seed=1)
solutions = [grasp.solution for grasp in plan]

# The ending of the name chooses the format: isaac_grasp, moveit_msgs/Grasp, or a folder for DexGraspBench.
for name in ("grasps.yaml", "grasps.json", "dexgraspbench"):
    report = clench.export_grasps(folder / name, solutions, hand=hand, obj=ball)
    print(f"{name}: confidences {report.confidences}")
    for note in report.notes:
        print("   note:", note)

# A command keeps the posture joints of such a grasp and closes the others to contact.
for number, grasp in enumerate(clench.import_grasps(folder / "grasps.yaml")):
    again = clench.solve(hand, ball, grasp.command(hand))
    print(f"grasp {number} read back: {again.status.value}")
    assert again.is_valid()
