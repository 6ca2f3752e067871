"""Say more than a wrist pose: preshape, fingers, planes, criteria; and read the same from a command file."""

import json
import sys
from pathlib import Path

import clench

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "clench_out")
folder.mkdir(parents=True, exist_ok=True)
hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")

command = clench.GraspCommand(
    hand_pose=clench.Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5]),
    preshape={"index_yaw": 0.1, "thumb_roll": -0.2},  # posture joints, and open values of closing joints [rad]
    fingers=("index", "middle", "thumb"),  # the others stay open
    planes=9,  # curl planes per finger
    yaw_grid=(-0.05, 0.0, 0.05),  # alternatives of a finger's yaw [rad]
    criteria={"range_of_motion": 1.0, "touching_links": 2.0},
)
solution = clench.solve(hand, mug, command)
for name, finger in solution.fingers.items():
    print(f"{name}: {finger.status.value}, {len(finger.candidates)} candidates, number {finger.chosen} chosen")
assert solution.joint_angles["thumb_roll"] == -0.2

file = folder / "command.json"
pose = {"position": [-0.05, -0.1, 0.06], "wxyz": [0.5, 0.5, 0.5, 0.5]}
file.write_text(json.dumps({"hand_pose": pose, "planes": 9, "fingers": ["index", "thumb"]}))
again = clench.solve(hand, mug, clench.load_command(file))
print("from the file:", again.reason["text"])
assert set(again.fingers) == {"index", "thumb"}

# A whole posture, from a planner or a glove, is decomposed: posture joints are kept, closing joints are solved anew.
rough = {**solution.joint_angles, "index_proximal": solution.joint_angles["index_proximal"] - 0.05}
snapped = clench.solve(hand, mug, clench.GraspCommand.from_posture(hand, rough, command.hand_pose))
print("snapped to contact:", snapped.reason["text"])
