"""The hold test in simulation: release the object, squeeze as planned, pull it in six directions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from clench.base.pose import FloatArray
from clench.grasp.mechanics.jacobian import DegreesOfFreedom, hand_jacobian
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.solve.posture import posture
from clench.solve.solution import GraspSolution
from clench.solve.squeezing import SqueezePlan, plan_squeeze

from .hold import Hold, HoldReport, ObjectMotion, Pulled
from .scene import TIMESTEP, Scene, build_scene

#: How long the squeeze takes to build up, and how long it then stands [s].
SQUEEZING, STANDING = 0.4, 0.2
#: How often the object is looked at while it is pulled [s].
LOOK_INTERVAL = 0.02
#: The directions of the pulls in the world.
DIRECTIONS = {
    f"{sign}{axis}": (1.0 if sign == "+" else -1.0) * np.eye(3)[k] for k, axis in enumerate("xyz") for sign in "+-"
}


@dataclass(frozen=True, eq=False)
class _Test:
    """Hold the scene of a test, the command to its servos [rad], shape (J,), and where the object was held."""

    scene: Scene
    command: FloatArray
    center: FloatArray
    rotation: FloatArray

    def motion(self, data: Any) -> ObjectMotion:
        body = self.scene.object_body
        turned = data.xmat[body].reshape(3, 3) @ self.rotation.T
        # From sine and cosine: the cosine alone cannot tell angles below 1e-8 from 0.
        sine = np.linalg.norm([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]])
        angle = float(np.arctan2(sine, np.trace(turned) - 1.0))
        return ObjectMotion(float(np.linalg.norm(data.xipos[body] - self.center)), angle)


def hold_and_pull(
    solution: GraspSolution,
    hand: Hand,
    obj: GraspObject,
    hold: Hold,
    *,
    start: FloatArray,
    reached: FloatArray,
    show_progress: bool = False,
) -> HoldReport:
    """Release the object at the touch, squeeze it, and pull it in six directions, each from the same squeeze.

    There is no gravity, the palm stays where it is, and obstacles are taken away. The planned forces hold the mass in
    any direction; the servo of every joint is told the angle at which it exerts its share of them at the touch.

    Args:
        solution: the solution. hand: the hand. obj: the object, at its pose. hold: the test.
        start: posture [rad], shape (J,), at which the palm is placed. reached: posture at the touch [rad], shape (J,).
        show_progress: show a bar while convex pieces are computed.

    Raises:
        HandError, ObjectError: see `build_scene`. CommandError: see `plan_squeeze`.
    """
    import mujoco

    graspable = tuple(body for body in obj.bodies if body.role is BodyRole.GRASPABLE)
    alone = replace(obj, bodies=graspable)
    plan = plan_squeeze(
        solution,
        hand,
        alone,
        mass=hold.mass,
        gravity=None,
        contact_model=hold.contact_model,
        friction=hold.friction,
        torsion=hold.torsion,
    )
    scene = build_scene(hand, alone, solution.hand_pose, start, free=hold, show_progress=show_progress)
    computed = posture(solution.joint_angles, hand, "joint_angles")
    torques = hold.squeeze * joint_torques(plan, hand, computed)
    stiffness = scene.model.actuator_gainprm[:, 0]
    data = mujoco.MjData(scene.model)
    data.qpos[scene.qpos] = reached
    mujoco.mj_forward(scene.model, data)
    body = scene.object_body
    test = _Test(scene, computed + torques / stiffness, data.xipos[body].copy(), data.xmat[body].reshape(3, 3).copy())
    _squeeze(test, data, computed)
    squeezed, stable = test.motion(data), _stable(data)
    pulls = {name: _pull(test, data, direction, hold) for name, direction in DIRECTIONS.items()} if stable else {}
    names = hand.joint_names
    return HoldReport(
        held=stable and all(pulled.held for pulled in pulls.values()),
        reason=_sentence(pulls, hold),
        settings=hold,
        plan=plan.text,
        planned=plan.feasible,
        torques=dict(zip(names, torques.tolist(), strict=True)),
        angles=dict(zip(names, data.qpos[scene.qpos].tolist(), strict=True)),
        squeezed=squeezed,
        pulls=pulls,
    )


def joint_torques(plan: SqueezePlan, hand: Hand, q: FloatArray) -> FloatArray:
    """Return the torque with which every joint, followers too, exerts the forces of a plan [Nm], shape (J,).

    Args:
        plan: the plan; nothing is exerted where there is none. hand: the hand. q: its posture [rad], shape (J,).
    """
    count = len(hand.joints)
    if plan.found.plan is None:
        return np.zeros(count)
    single = DegreesOfFreedom(hand.joint_names, tuple(range(count)), np.eye(count), np.full(count, np.inf))
    J = hand_jacobian(hand, q, plan.grasp.held.contacts, single)
    return np.asarray(J.T @ plan.found.plan.forces.reshape(-1))


def _squeeze(test: _Test, data: Any, touch: FloatArray) -> None:
    import mujoco

    for step in range(round((SQUEEZING + STANDING) / TIMESTEP)):
        done = min(1.0, (step + 1) * TIMESTEP / SQUEEZING)
        data.ctrl[:] = touch + done * (test.command - touch)
        mujoco.mj_step(test.scene.model, data)
    mujoco.mj_forward(test.scene.model, data)


def _pull(test: _Test, squeezed: Any, direction: FloatArray, hold: Hold) -> Pulled:
    import mujoco

    model = test.scene.model
    data = mujoco.MjData(model)
    mujoco.mj_copyData(data, model, squeezed)
    data.xfrc_applied[test.scene.object_body, :3] = hold.pull * hold.mass * direction
    steps, every = max(1, round(hold.duration / TIMESTEP)), round(LOOK_INTERVAL / TIMESTEP)
    taken, motion = 0, test.motion(data)
    while taken < steps and _within(motion, hold):
        for _ in range(min(every, steps - taken)):
            mujoco.mj_step(model, data)
            taken += 1
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        if not _stable(data):
            return Pulled(False, motion, taken * TIMESTEP)
        motion = test.motion(data)
    return Pulled(_within(motion, hold), motion, taken * TIMESTEP)


def _within(motion: ObjectMotion, hold: Hold) -> bool:
    return motion.distance < hold.max_distance and motion.angle < hold.max_angle


def _stable(data: Any) -> bool:
    """Return whether the simulation has stayed finite: the engine starts again from the beginning where it has not."""
    import mujoco

    kinds = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)
    return not any(data.warning[kind].number for kind in kinds)


def _sentence(pulls: dict[str, Pulled], hold: Hold) -> str:
    if not pulls:
        return "Not tested: the simulation did not stay finite while the object was squeezed."
    force = f"{hold.pull * hold.mass:.3g} N"
    lost = [name for name, pulled in pulls.items() if not pulled.held]
    if lost:
        return f"Dropped when pulled with {force} along {', '.join(lost)}."
    far = max(p.motion.distance for p in pulls.values())
    turned = np.rad2deg(max(p.motion.angle for p in pulls.values()))
    return f"Held against {force} in six directions; it moved by up to {far * 1e3:.2g} mm and {turned:.2g}°."
