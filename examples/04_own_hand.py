"""Bring a hand of your own: a model file as it is, and a hand file only for what should be otherwise."""

import sys
from pathlib import Path

import clench

MODEL = """
<mujoco model="pincer">
  <worldbody>
    <body name="base">
      <geom type="box" size="0.02 0.03 0.01"/>
      <body name="left_lower" pos="0.02 0.02 0">
        <joint name="left_1" axis="0 0 -1" range="0 90"/>
        <geom type="capsule" fromto="0 0 0 0.05 0 0" size="0.008"/>
        <body name="left_upper" pos="0.05 0 0">
          <joint name="left_2" axis="0 0 -1" range="0 90"/>
          <geom type="capsule" fromto="0 0 0 0.04 0 0" size="0.007"/>
        </body>
      </body>
      <body name="right_lower" pos="0.02 -0.02 0">
        <joint name="right_1" axis="0 0 1" range="0 90"/>
        <geom type="capsule" fromto="0 0 0 0.05 0 0" size="0.008"/>
        <body name="right_upper" pos="0.05 0 0">
          <joint name="right_2" axis="0 0 1" range="0 90"/>
          <geom type="capsule" fromto="0 0 0 0.04 0 0" size="0.007"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
HAND_FILE = """
[joints.left_2]
follows = "left_1"
ratio = 0.8
"""

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "clench_out")
folder.mkdir(parents=True, exist_ok=True)
(folder / "pincer.xml").write_text(MODEL)
(folder / "pincer.hand.toml").write_text(HAND_FILE)  # found beside the model by its name

hand = clench.Hand.load(folder / "pincer.xml")
for finger in hand.fingers:
    print(f"finger {finger.name}: {[hand.joints[j].name for j in finger.joints]}")
assert len(hand.couplings) == 1

# One cylinder between the two fingers; the palm link's frame is the world here.
post = clench.GraspObject.load("cylinder:r=0.012,h=0.06", pose=clench.Pose([0.08, 0.0, 0.0]))
solution = clench.solve(hand, post, clench.GraspCommand(hand_pose=clench.Pose.identity()))
print(f"{solution.status.value}: {solution.reason['text']}")
assert solution.status is clench.types.SolutionStatus.GRASP
