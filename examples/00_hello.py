"""Close the built-in hand around the built-in mug, and carry it out in simulation."""

import clench

hand = clench.Hand.load("robonaut2")  # a built-in name, or a path to .urdf / .xml
mug = clench.GraspObject.load("mug")  # a built-in name, a path to a mesh, or "cylinder:r=0.03,h=0.1"
command = clench.GraspCommand(hand_pose=clench.Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5]))
solution = clench.solve(hand, mug, command)
assert solution.is_valid()

print(f"{solution.status.value}: {solution.reason['text']}")
for joint, angle in solution.joint_angles.items():
    print(f"  {joint:16} {angle:6.3f} rad")
for contact in solution.contacts:
    print(f"  {contact.link:16} touches at {contact.position.round(4)} m")

report = clench.execute(solution, clench.SimulatedHand(hand, mug))
print(report.reason)
assert report.success
