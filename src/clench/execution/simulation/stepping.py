"""Carry next steps out in simulation, and see whether they are reached and whether the object is still held."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from clench.core.pose import FloatArray
from clench.execution.execution_report import JointReached, NextStepReached, step_sentence
from clench.execution.hardware.joint_blocking import simulated_blocker
from clench.execution.next_steps import Phase, moved_joints, plan_next_steps
from clench.models.hand.hand import Hand
from clench.solver.solution import GraspSolution

from .filming import Film
from .hold import Hold, HoldTest, Pulled
from .mujoco_scene import TIMESTEP, Scene
from .pulling import Held, is_stable, place_of, pull_each_way
from .touch_watch import TouchWatch

#: Rest of the hand after a step, in which the servos settle [s].
SETTLING: Final = 0.4
_Each = Callable[[Any, FloatArray], None] | None


@dataclass(frozen=True, eq=False)
class Stepper:
    """Take a simulated hand through the next steps of a solution.

    Args:
        solution: with `next_steps`. hand: the hand that was solved for.
        pace: largest velocity [rad/s] and acceleration [rad/s²] of every joint, shape (J,) each.
        tolerance: largest difference to a step's angles that counts as reached [rad].
    """

    solution: GraspSolution
    hand: Hand
    pace: tuple[FloatArray, FloatArray]
    tolerance: float

    def in_place(
        self, scene: Scene, data: Any, told: FloatArray, film: Film | None, each: _Each
    ) -> tuple[NextStepReached, ...]:
        """Go through the steps while the object is held in place.

        Args:
            scene, data: at the touch. told: where the joints are told to be [rad], shape (J,).
            film: takes pictures. each: called with the state and the angles told, before every time step.
        """
        found: list[NextStepReached] = []
        none = np.zeros(len(scene.drives.numbers))
        for phase in self._phases(told):
            self._go(scene, data, phase, none, film, each)
            found.append(self._reached(scene, data, phase))
            if not found[-1].reached:
                break
        return tuple(found)

    def after_hold(self, held: Held, hold: Hold, film: Film | None) -> tuple[NextStepReached, ...]:
        """Go through the steps from where a free object is held; after each, test whether it still is.

        Args:
            held: the state. hold: the test that the object passed. film: takes pictures.
        """
        found: list[NextStepReached] = []
        scene, data, extra = held.scene, held.data, held.extra
        if film is not None:
            film.go_on(data)
        for phase in self._phases(held.told):
            before = place_of(scene, data)
            self._go(scene, data, phase, extra, film)
            extra = extra * ~self._released(scene, phase)
            found.append(self._still_held(scene, data, hold, before, self._reached(scene, data, phase)))
            if not found[-1].reached:
                break
        return tuple(found)

    def _phases(self, told: FloatArray) -> tuple[Phase, ...]:
        return plan_next_steps(self.solution, self.hand, told, self.pace)

    def _moved(self, phase: Phase) -> list[int]:
        assert phase.step is not None
        return list(moved_joints(self.hand, self.solution.next_steps[phase.step]))

    def _released(self, scene: Scene, phase: Phase) -> Any:
        """Return which actuators move joints of a step, shape (A,): these stop pressing."""
        return (scene.drives.arms[:, self._moved(phase)] != 0.0).any(axis=1)

    def _go(
        self, scene: Scene, data: Any, phase: Phase, extra: FloatArray, film: Film | None, each: _Each = None
    ) -> None:
        """Follow a phase and stand still; `extra` is added to the controls, and fades where actuators are moved."""
        import mujoco

        released = self._released(scene, phase)
        for step in range(int(np.ceil((phase.duration + SETTLING) / TIMESTEP))):
            told = phase.at(step * TIMESTEP)
            if each is not None:
                each(data, told)
            pressing = extra * (1.0 - released * phase.share_at(step * TIMESTEP))
            data.ctrl[scene.drives.numbers] = scene.drives.command(told) + pressing
            mujoco.mj_step(scene.model, data)
            if film is not None:
                film.look(data)
        mujoco.mj_forward(scene.model, data)
        if film is not None:
            film.still(f"next_step_{1 + (phase.step or 0)}", data)

    def _reached(self, scene: Scene, data: Any, phase: Phase) -> NextStepReached:
        angles, wanted = data.qpos[scene.qpos], phase.positions[-1]
        names = self.hand.joint_names
        joints = {names[j]: JointReached(float(wanted[j]), float(angles[j])) for j in self._moved(phase)}
        assert phase.step is not None
        stable = is_stable(data)
        reached, reason = step_sentence(phase.step, joints, self.tolerance)
        if stable and not reached:
            worst = max(joints, key=lambda name: abs(joints[name].error))
            reason = f"{reason} {simulated_blocker(scene, data, self.hand, worst)}".rstrip()
        if not stable:
            reached, reason = False, f"Next step {phase.step + 1}: the simulation did not stay finite."
        touching = TouchWatch(scene, self.hand).touching(data) if stable else ()
        return NextStepReached(joints, reached, reason, touching)

    def _still_held(self, scene: Scene, data: Any, hold: Hold, before: Any, found: NextStepReached) -> NextStepReached:
        """Return the result, with whether the object is still held: touched, not lost, and pulled or hung anew."""
        if not is_stable(data):
            return replace(found, held=False)
        after = place_of(scene, data)
        motion = before.motion_to(after)
        pulls: dict[str, Pulled] = {}
        if not found.touching:
            why = "no finger touches it"
        elif motion.distance >= hold.max_distance:
            why = f"the step moved it by {motion.distance * 1e3:.3g} mm"
        else:
            pulls = pull_each_way(scene, data, hold, after)
            lost = [name for name, pulled in pulls.items() if not pulled.held]
            why = _lost(hold, lost) if lost else ""
        said = f"The object is no longer held: {why}." if why else f"The object is still held, {_how(hold)}."
        return replace(found, reason=f"{found.reason} {said}", held=not why, motion=motion, pulls=pulls)


def _how(hold: Hold) -> str:
    if hold.test == HoldTest.LIFT:
        return f"{hold.duration:g} s long under gravity"
    return f"against {hold.pull * hold.mass:.3g} N in six directions"


def _lost(hold: Hold, lost: list[str]) -> str:
    if hold.test == HoldTest.LIFT:
        return "it falls"
    return f"dropped when pulled with {hold.pull * hold.mass:.3g} N along {', '.join(lost)}"
