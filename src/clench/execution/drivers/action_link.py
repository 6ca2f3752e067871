"""The action of a joint_trajectory_controller (control_msgs/FollowJointTrajectory), through `rclpy`.

Every command is a goal of its own that replaces the one before. Goals are as short as commands on the topic: a
controller with a whole path would move on to its end when the connection is cut. The action reports more than the
topic: refusals, and tolerances that were not kept.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import partial
from typing import Any, Final

from clench.execution.hardware.driver import DriverError

from .rclpy_link import RclpyLink, clear_import, trajectory_message
from .ros2 import LOOK, JointStates

#: action_msgs/GoalStatus: the controller gave the goal up.
ABORTED: Final = 6


class ActionLink:
    """Send goals to the controller's action; states come from the topic.

    Raises:
        CommandError: ROS 2 is there but cannot be used.
    """

    name = "rclpy, action"

    def __init__(self, topic: str, state_topic: str, domain: int) -> None:
        with clear_import():
            from control_msgs.action import FollowJointTrajectory
            from rclpy.action import ActionClient
        self._goal = FollowJointTrajectory.Goal
        self._action = topic.removesuffix("/joint_trajectory") + "/follow_joint_trajectory"
        self._link = RclpyLink(topic, state_topic, domain)
        self._client = ActionClient(self._link.node, FollowJointTrajectory, self._action)
        self._pending = 0
        self._sent = 0
        self._trouble: str | None = None

    def listeners(self) -> int:
        """Return 1 when the controller's action is there, else 0."""
        return int(self._client.server_is_ready())

    def states(self) -> list[JointStates]:
        """Return the messages that have come since the last call, oldest first.

        Raises:
            DriverError: the controller refused a goal, or gave it up.
        """
        if self._trouble is not None:
            trouble, self._trouble = self._trouble, None
            raise DriverError(trouble)
        return self._link.states()

    def publish(self, joints: Sequence[str], times: Sequence[float], positions: Sequence[Sequence[float]]) -> None:
        """Send a goal that starts when it arrives, in place of the one before."""
        goal = self._goal(trajectory=trajectory_message(joints, times, positions))
        self._pending += 1
        self._sent += 1
        self._client.send_goal_async(goal).add_done_callback(partial(self._answered, self._sent))

    def flush(self, timeout: float) -> None:
        """Wait until every goal was answered, at most so long [s]."""
        until = time.monotonic() + timeout
        while self._pending > 0 and time.monotonic() < until:
            time.sleep(LOOK)

    def trajectory_topics(self) -> list[str]:
        """Return the topics on which somebody listens for trajectories."""
        return self._link.trajectory_topics()

    def close(self) -> None:
        """Leave the network."""
        self._client.destroy()
        self._link.close()

    def _answered(self, number: int, future: Any) -> None:
        self._pending -= 1
        handle = future.result()
        if handle.accepted:
            handle.get_result_async().add_done_callback(partial(self._ended, number))
        else:
            self._trouble = f"'{self._action}' refused the goal; does it have exactly these joints?"

    def _ended(self, number: int, future: Any) -> None:
        answer = future.result()
        # Controllers differ in how they end a goal that another goal replaced.
        if answer.status == ABORTED and number == self._sent:
            why = answer.result.error_string or f"error code {answer.result.error_code}"
            self._trouble = f"'{self._action}' gave up: {why}."
