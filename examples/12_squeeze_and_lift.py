"""Plan the squeeze that holds a range of masses, then lift the object from a table in simulation."""

import clench

hand = clench.Hand.load("robonaut2")
bottle = clench.GraspObject.load("bottle")
mass, friction = (0.05, 0.3), (0.4, 0.8)  # kg; both are known roughly

# Stand the bottle on a table, and plan a grasp that the table does not disturb.
standing = clench.stable_poses(bottle)
upright = max(standing, key=lambda pose: pose.center_height)
scene = upright.on_table(bottle)
plan = clench.plan_grasps(hand, scene, 1, mass=mass, friction=friction, seed=2)
solution = plan[0].solution

squeeze = clench.plan_squeeze(solution, hand, scene, mass=mass, friction=friction)
print(squeeze.text)
for name, torque in squeeze.torques.items():
    if abs(torque) > 1e-3:
        print(f"  {name:16} {torque:6.3f} Nm, told {squeeze.offsets.get(name, 0.0):.4f} rad beyond the touch")
assert squeeze.feasible

# The hand closes, squeezes, and lifts the free object by 0.1 m.
lift = clench.execution.Hold(test="lift", mass=0.2, friction=0.5, planned_mass=mass, planned_friction=friction)
report = clench.execute(solution, clench.SimulatedHand(hand, scene, hold=lift))
print(report.hold.reason)
assert report.hold.held
