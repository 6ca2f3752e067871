"""The controller's action, with a stand-in for control_msgs, which no package index has: goals, refusals, giving up."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from types import ModuleType, SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

from clench.core.exceptions import CommandError
from clench.execution.drivers import action_link, ros2
from clench.execution.drivers.action_link import ABORTED, ActionLink
from clench.execution.drivers.ros2 import RosInterface, installed_interface
from clench.execution.hardware.driver import DriverError, JointPath

PATH = JointPath(("a", "b"), np.array([0.1, 0.30000001]), np.array([[0.0, 0.5], [1.0, 2.0]]), 0.05)


class Now:
    """A future that is done."""

    def __init__(self, value: object) -> None:
        self.value = value

    def result(self) -> object:
        return self.value

    def add_done_callback(self, call: Callable[[Any], None]) -> None:
        call(self)


@dataclass
class Goal:
    trajectory: Any


class FollowJointTrajectory:
    Goal = Goal


@dataclass
class Client:
    """Stand in for rclpy's ActionClient: remembers goals, answers what it is told."""

    node: object
    kind: object
    name: str
    goals: list[Goal] = field(default_factory=list)
    destroyed: bool = False
    made: ClassVar[list[Client]] = []
    accepted: ClassVar[bool] = True
    status: ClassVar[int] = 5  # canceled by the goal that comes next
    error: ClassVar[str] = ""

    def __post_init__(self) -> None:
        self.made.append(self)

    def server_is_ready(self) -> bool:
        return True

    def send_goal_async(self, goal: Goal) -> Now:
        self.goals.append(goal)
        result = SimpleNamespace(error_code=-4, error_string=self.error)
        answer = Now(SimpleNamespace(status=self.status, result=result))
        return Now(SimpleNamespace(accepted=self.accepted, get_result_async=lambda: answer))

    def destroy(self) -> None:
        self.destroyed = True


class Link:
    """Stand in for the link by topics."""

    node = object()

    def __init__(self, *_: object) -> None:
        self.closed = False

    def states(self) -> list[ros2.JointStates]:
        return []

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def client(monkeypatch: pytest.MonkeyPatch) -> Iterator[type[Client]]:
    pytest.importorskip("rclpy", reason="needs rclpy (Linux, x86-64)")
    import rclpy.action

    package, module = ModuleType("control_msgs"), ModuleType("control_msgs.action")
    module.FollowJointTrajectory = FollowJointTrajectory  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "control_msgs", package)
    monkeypatch.setitem(sys.modules, "control_msgs.action", module)
    monkeypatch.setattr(rclpy.action, "ActionClient", Client)
    monkeypatch.setattr(action_link, "RclpyLink", Link)
    Client.made.clear()
    for name in ("accepted", "status", "error"):
        monkeypatch.setattr(Client, name, getattr(Client, name))
    return Client


def send(link: ActionLink) -> None:
    link.publish(PATH.joints, PATH.times.tolist(), PATH.positions.tolist())


def test_every_command_is_a_goal(client: type[Client]) -> None:
    link = ActionLink("/hand/joint_trajectory", "/joint_states", 0)
    (made,) = client.made
    assert made.name == "/hand/follow_joint_trajectory"
    assert made.kind is FollowJointTrajectory
    assert link.listeners() == 1
    send(link)
    send(link)
    link.flush(0.1)
    assert link.states() == []  # a goal that was replaced is no trouble
    trajectory = made.goals[1].trajectory
    assert trajectory.joint_names == ["a", "b"]
    assert [list(p.positions) for p in trajectory.points] == PATH.positions.tolist()
    assert [(p.time_from_start.sec, p.time_from_start.nanosec) for p in trajectory.points] == [
        (0, 100_000_000),
        (0, 300_000_010),
    ]
    assert (trajectory.header.stamp.sec, trajectory.header.stamp.nanosec) == (0, 0)
    link.close()
    assert made.destroyed


def test_a_refused_goal_is_told(client: type[Client]) -> None:
    client.accepted = False
    link = ActionLink("/hand/joint_trajectory", "/joint_states", 0)
    send(link)
    with pytest.raises(DriverError, match="'/hand/follow_joint_trajectory' refused the goal; does it have exactly"):
        link.states()
    assert link.states() == []  # told once: where the hand stands is still read while it is stopped


@pytest.mark.parametrize(("error", "told"), [("Tolerance violated", "Tolerance violated"), ("", "error code -4")])
def test_a_goal_that_is_given_up_is_told(client: type[Client], error: str, told: str) -> None:
    client.status, client.error = ABORTED, error
    link = ActionLink("/hand/joint_trajectory", "/joint_states", 0)
    send(link)
    with pytest.raises(DriverError, match=rf"'/hand/follow_joint_trajectory' gave up: {told}\."):
        link.states()


def test_what_becomes_of_a_replaced_goal_does_not_matter(client: type[Client]) -> None:
    link = ActionLink("/hand/joint_trajectory", "/joint_states", 0)
    ended = []
    slow = SimpleNamespace(add_done_callback=ended.append)
    handle = SimpleNamespace(accepted=True, get_result_async=lambda: slow)
    client.made[0].send_goal_async = lambda goal: Now(handle)  # type: ignore[method-assign]
    send(link)
    send(link)
    aborted = Now(SimpleNamespace(status=ABORTED, result=SimpleNamespace(error_code=-1, error_string="replaced")))
    ended[0](aborted)
    assert link.states() == []
    ended[1](aborted)
    with pytest.raises(DriverError, match="gave up: replaced"):
        link.states()


def test_it_is_only_used_where_it_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ros2.importlib.util, "find_spec", lambda _: True)
    assert installed_interface(RosInterface.AUTO) is RosInterface.RCLPY
    assert installed_interface(RosInterface.ACTION) is RosInterface.ACTION
    monkeypatch.setattr(ros2.importlib.util, "find_spec", lambda name: name != "control_msgs")
    with pytest.raises(CommandError, match="control_msgs is not installed; source a ROS installation that has it"):
        installed_interface(RosInterface.ACTION)
