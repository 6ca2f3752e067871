"""A process of its own that behaves like ros2_controllers' joint_trajectory_controller and a joint_state_broadcaster.

It takes a trajectory of exactly its joints whose times rise, starts it on arrival from where it is, interpolates
linearly, replaces it when another one comes, and holds the last point. It can lose its connection, die or fall silent.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import time
from pathlib import Path

import numpy as np


class Joints:
    def __init__(self, names: list[str], start: list[float]) -> None:
        self.names = names
        self.times, self.points = np.zeros(1), np.array([start])
        self.refused: list[str] = []
        #: What was accepted: times from when it came, and positions there.
        self.paths: list[tuple[list[float], list[list[float]]]] = []
        self.last = 0.0

    def take(self, names: list[str], times: list[float], points: list[list[float]]) -> None:
        if set(names) != set(self.names) or len(names) != len(self.names):
            self.refused.append(f"joints {names}")
        elif not points or any(len(p) != len(names) for p in points):
            self.refused.append("points")
        elif (np.diff(times) <= 0).any() or times[0] < 0:
            self.refused.append(f"times {times}")
        else:
            order = [names.index(n) for n in self.names]
            now = time.monotonic()
            told = np.array(points)[:, order]
            self.paths.append((times, told.tolist()))
            if times[0] > 0.0:  # from where it is, unless the trajectory says where it is by now
                told, times = np.vstack([self.at(now), told]), [0.0, *times]
            self.points, self.times, self.last = told, now + np.array(times), now

    def at(self, moment: float) -> np.ndarray:
        return np.array([np.interp(moment, self.times, c) for c in self.points.T])


class Cyclone:
    def __init__(self, domain: int, topic: str, states: str) -> None:
        from cyclonedds.domain import DomainParticipant
        from cyclonedds.pub import DataWriter
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic

        from clench.execution.drivers.cyclone_link import prepare_domain, quality
        from clench.execution.drivers.dds_messages import JointState, JointTrajectory

        prepare_domain(domain)
        p = DomainParticipant(domain)
        self.reader = DataReader(p, Topic(p, f"rt{topic}", JointTrajectory), qos=quality(reliable=True))
        self.writer = DataWriter(p, Topic(p, f"rt{states}", JointState), qos=quality(reliable=True))

    def spin(self, joints: Joints) -> None:
        for m in self.reader.take(10):
            if m.sample_info.valid_data:
                times = [p.time_from_start.sec + p.time_from_start.nanosec * 1e-9 for p in m.points]
                joints.take(list(m.joint_names), times, [list(p.positions) for p in m.points])

    def say(self, names: list[str], positions: list[float], stamp: int) -> None:
        from clench.execution.drivers.dds_messages import Header, JointState, Time

        self.writer.write(JointState(Header(Time(*divmod(stamp, 10**9)), ""), names, positions, [], []))

    def cut(self) -> None:
        self.reader = self.writer = None


class Rclpy:
    def __init__(self, domain: int, topic: str, states: str) -> None:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor
        from sensor_msgs.msg import JointState
        from trajectory_msgs.msg import JointTrajectory

        self.context = rclpy.Context()
        rclpy.init(args=[], context=self.context, domain_id=domain)
        self.node = rclpy.create_node("trajectory_controller", context=self.context)
        self.queue: list[JointTrajectory] = []
        self.subscription = self.node.create_subscription(JointTrajectory, topic, self.queue.append, 10)
        self.publisher = self.node.create_publisher(JointState, states, 10)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)

    def spin(self, joints: Joints) -> None:
        self.executor.spin_once(timeout_sec=0.0)
        while self.queue:
            m = self.queue.pop(0)
            times = [p.time_from_start.sec + p.time_from_start.nanosec * 1e-9 for p in m.points]
            joints.take(list(m.joint_names), times, [list(p.positions) for p in m.points])

    def say(self, names: list[str], positions: list[float], stamp: int) -> None:
        from builtin_interfaces.msg import Time
        from sensor_msgs.msg import JointState

        message = JointState(name=names, position=positions)
        message.header.stamp = Time(sec=stamp // 10**9, nanosec=stamp % 10**9)
        self.publisher.publish(message)

    def cut(self) -> None:
        self.executor.remove_node(self.node)
        self.node.destroy_node()


class Action(Rclpy):
    """The same by the action: a new goal takes the place of the one before, which ends as aborted."""

    def __init__(self, domain: int, topic: str, states: str) -> None:
        super().__init__(domain, topic + "_unused", states)
        from control_msgs.action import FollowJointTrajectory
        from rclpy.action import ActionServer, GoalResponse

        self.kind = FollowJointTrajectory
        self.answers = GoalResponse
        self.goals: list[object] = []
        self.joints: Joints | None = None
        self.server = ActionServer(
            self.node,
            FollowJointTrajectory,
            topic.replace("joint_trajectory", "follow_joint_trajectory"),
            execute_callback=self.end,
            goal_callback=self.judge,
            handle_accepted_callback=self.start,
        )

    def spin(self, joints: Joints) -> None:
        self.joints = joints
        super().spin(joints)
        if self.goals and time.monotonic() > joints.times[-1]:
            self.goals.pop().execute()

    def judge(self, goal: object) -> object:
        before = len(self.joints.paths)
        times = [p.time_from_start.sec + p.time_from_start.nanosec * 1e-9 for p in goal.trajectory.points]
        self.joints.take(list(goal.trajectory.joint_names), times, [list(p.positions) for p in goal.trajectory.points])
        return self.answers.ACCEPT if len(self.joints.paths) > before else self.answers.REJECT

    def start(self, goal: object) -> None:
        while self.goals:
            self.goals.pop(0).execute()
        self.goals.append(goal)

    def end(self, goal: object) -> object:
        if self.goals:
            goal.abort()
        else:
            goal.succeed()
        return self.kind.Result()

    def cut(self) -> None:
        self.server.destroy()
        super().cut()


def main() -> None:
    p = argparse.ArgumentParser()
    p.add_argument("--interface", choices=["cyclonedds", "rclpy", "action"])
    p.add_argument("--domain", type=int)
    p.add_argument("--topic")
    p.add_argument("--states")
    p.add_argument("--joints")
    p.add_argument("--start")
    p.add_argument("--log", type=Path)
    p.add_argument("--cut-after", type=float, default=np.inf, help="seconds of motion after which DDS is left")
    p.add_argument("--die-after", type=float, default=np.inf)
    p.add_argument("--freeze-after", type=float, default=np.inf, help="then the same state is sent on and on")
    p.add_argument("--silent", action="store_true")
    p.add_argument("--lifetime", type=float, default=40.0)
    a = p.parse_args()
    joints = Joints(a.joints.split(","), [float(x) for x in a.start.split(",")])
    dds = {"cyclonedds": Cyclone, "rclpy": Rclpy, "action": Action}[a.interface](a.domain, a.topic, a.states)
    a.log.with_suffix(".ready").touch()
    begun, moving, cut, samples = time.monotonic(), None, None, []
    ended: list[int] = []
    signal.signal(signal.SIGTERM, lambda *_: ended.append(1))
    stamp, at = time.time_ns(), joints.at(begun)
    while not ended and time.monotonic() - begun < a.lifetime:
        if cut is None:
            dds.spin(joints)
        if moving is None and joints.paths:
            moving = joints.last
            a.log.with_suffix(".moving").touch()
        now = time.monotonic()
        since, here = 0.0 if moving is None else now - moving, joints.at(now)
        if since > a.die_after:
            os._exit(9)
        if since > a.cut_after and cut is None:
            cut = since
            dds.cut()
        if since <= a.freeze_after:
            stamp, at = time.time_ns(), here
        samples.append([since, *here.tolist()])
        if cut is None and not a.silent:
            dds.say([*joints.names, "elbow"], [*at.tolist(), 1.0], stamp)
        time.sleep(0.01)
    log = {"paths": joints.paths, "refused": joints.refused, "cut": cut, "samples": samples}
    log |= {"last": None if moving is None else joints.last - moving}
    a.log.write_text(json.dumps(log))
    os._exit(0)


main()
