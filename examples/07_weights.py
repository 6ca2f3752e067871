"""Change one weight and look at what changes: a grasp that is steadier pays with more motion."""

import sys
from pathlib import Path

import clench
from clench.apps.figures.weight_sweep import draw_sweep, sweep_weight

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "clench_out")
folder.mkdir(parents=True, exist_ok=True)
hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")

command = clench.GraspCommand(
    hand_pose=clench.Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5]),
    planes=1,
    yaw_grid=(0.0, 0.1, -0.1, 0.2, -0.2),  # alternatives to choose among [rad]
    opposition_grid=(0.0, 0.2, -0.2, 0.4, -0.4),
    criteria={"range_of_motion": 1.0},
)
weights = [0.1, 0.3, 1.0, 2.0, 5.0, 10.0, 20.0]
solutions = sweep_weight(hand, mug, command, "epsilon", weights)
epsilons = [solution.choice["hand_scores"]["epsilon"] for solution in solutions]
for weight, steady, solution in zip(weights, epsilons, solutions, strict=True):
    motion = sum(f.candidates[f.chosen].scores["range_of_motion"] for f in solution.fingers.values())
    print(f"weight {weight:5g}: epsilon {steady:.4f} N/N, range of motion {motion:.3f} rad")
    print(f"    {solution.choice['text']}")
assert epsilons == sorted(epsilons)

print(draw_sweep(hand, mug, solutions, ("epsilon", "range_of_motion"), weights, folder / "weights.png"))
