"""Closing a hand in MuJoCo: position actuators pull every finger on until everything is at rest."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from clench.closing.finger_plan import closing_joints
from clench.core.pose import FloatArray, Pose
from clench.execution.simulation.mujoco_scene import build_scene
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject

#: How far the actuators' goals are ahead of the joints [rad]: a pull that does not grow at a contact.
LEAD: Final = 0.05
#: At rest: no joint is faster [rad/s] for so many steps.
SLOW: Final = 0.02
RESTING: Final = 25
#: Steps at most: 2 s.
MOST: Final = 1000


class Rested(NamedTuple):
    """The rest of a simulated closing: posture [rad], and steps of the engine."""

    q: FloatArray
    steps: int


class Driven:
    """Close one hand around one object, which is held in place, in simulation."""

    def __init__(self, hand: Hand, obj: GraspObject, hand_pose: Pose) -> None:
        import mujoco

        self.hand = hand
        self.start = hand.open_angles()
        self.scene = build_scene(hand, obj, hand_pose, self.start)
        self.data = mujoco.MjData(self.scene.model)
        followers = {c.follower for c in hand.couplings}
        free = [j for finger in hand.fingers for j in closing_joints(hand, finger) if j not in followers]
        self._ahead = np.zeros(len(hand.joints))
        self._ahead[free] = [LEAD * hand.joints[j].direction for j in free]
        self._limits = np.array([(j.lower, j.upper) for j in hand.joints]).T

    def close(self) -> Rested:
        """Close from the open hand until everything is at rest."""
        import mujoco

        model, data = self.scene.model, self.data
        mujoco.mj_resetData(model, data)
        data.qpos[self.scene.qpos] = self.start
        mujoco.mj_forward(model, data)
        rest, steps, goal = 0, 0, self.start
        while rest < RESTING and steps < MOST:
            goal = self._goal(data.qpos[self.scene.qpos], goal)
            data.ctrl[:] = self.scene.drives.command(goal)
            mujoco.mj_step(model, data)
            steps += 1
            rest = rest + 1 if np.abs(data.qvel).max(initial=0.0) < SLOW else 0
        return Rested(np.array(data.qpos[self.scene.qpos]), steps)

    def _goal(self, q: FloatArray, before: FloatArray) -> FloatArray:
        """Return where the actuators pull [rad]: ahead of closing joints, never back, so that they do not creep."""
        closing = np.sign(self._ahead)
        goal = before + closing * np.maximum((q + self._ahead - before) * closing, 0.0)
        return self.hand.coupled(np.clip(goal, *self._limits))
