"""Move a hand with a controller of your own: a driver of eight members. HardwareHand checks and supervises."""

import math

import clench


class Servos:
    """Servos in memory that say degrees and go straight to what they were told; put your bus in their place."""

    name = "my servos"
    one_target = True  # of a path, command passes on one target alone
    limits = clench.execution.DriverLimits(velocities={"index_proximal_servo": 90.0})

    def __init__(self, joints: list[str]) -> None:
        self.joints = tuple(f"{joint}_servo" for joint in joints)
        self.angles = dict.fromkeys(self.joints, 5.0)

    def connect(self, timeout: float) -> None:
        pass  # raise clench.execution.DriverError when nobody answers within the timeout

    def read(self) -> clench.execution.HandState:
        return clench.execution.HandState(dict(self.angles))  # with ages, when measurements can be old

    def command(self, path: clench.execution.JointPath) -> None:
        self.angles.update(path.at(path.period))  # where to be when the next command comes

    def stop(self) -> None:
        pass  # they stand still already

    def disconnect(self) -> None:
        pass


hand = clench.Hand.load("robonaut2")
mug = clench.GraspObject.load("mug")
command = clench.GraspCommand(hand_pose=clench.Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5]))
solution = clench.solve(hand, mug, command)

followers = {coupling.follower for coupling in hand.couplings}
moved = [joint.name for i, joint in enumerate(hand.joints) if i not in followers]
degrees = clench.execution.JointMap.from_dict(
    {"unit": "deg", "joints": {name: {"name": f"{name}_servo"} for name in moved}}
)
servos = Servos(moved)
report = clench.execute(solution, clench.execution.HardwareHand(hand, servos, joint_map=degrees, obj=mug), speed=0.5)

print(report.reason)
print(f"{report.duration:.1f} s, {len(report.history.times)} samples")
reached = servos.angles["index_proximal_servo"]
print(f"index_proximal_servo at {reached:.1f} deg")
assert report.success
assert abs(reached - math.degrees(solution.joint_angles["index_proximal"])) < 0.1
