"""The hold test in simulation: close on a free object, squeeze as planned, pull it in six directions or lift it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from clench.core.pose import FloatArray
from clench.execution.trajectory import Trajectory
from clench.mechanics.grasp.jacobian import DegreesOfFreedom, hand_jacobian
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.solver.analysis.squeezing import DOWN, SqueezePlan, plan_squeeze
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import GraspSolution

from .filming import Film
from .hold import FingerForce, Hold, HoldReport, HoldTest, ObjectMotion, Pulled
from .mujoco_scene import TABLE, TIMESTEP, Scene, build_scene
from .simulated_actuators import Drive
from .touch_watch import TouchWatch

#: Durations of the rest at the touch, of the build-up of the squeeze, and of the rest after it [s].
SETTLING, SQUEEZING, STANDING = 0.1, 0.4, 0.2
#: Duration of the palm's rise [s].
LIFTING = 0.4
#: A hand that would be deeper in the table is not tested [m].
TABLE_OVERLAP = 1e-3
#: Interval at which the object is observed during a pull [s].
LOOK_INTERVAL = 0.02
#: The directions of the pulls in the world.
DIRECTIONS = {
    f"{sign}{axis}": (1.0 if sign == "+" else -1.0) * np.eye(3)[k] for k, axis in enumerate("xyz") for sign in "+-"
}


@dataclass(frozen=True, eq=False)
class Place:
    """The place of an object: its centre of mass [m], shape (3,), and its rotation, shape (3, 3)."""

    center: FloatArray
    rotation: FloatArray

    def motion_to(self, other: Place) -> ObjectMotion:
        """Return how far another place is from here."""
        turned = other.rotation @ self.rotation.T
        # From sine and cosine: the cosine alone cannot tell angles below 1e-8 from 0.
        sine = np.linalg.norm([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]])
        angle = float(np.arctan2(sine, np.trace(turned) - 1.0))
        return ObjectMotion(float(np.linalg.norm(other.center - self.center)), angle)

    def raised(self, height: float) -> Place:
        """Return the place so far above [m]."""
        return Place(self.center + np.array([0.0, 0.0, height]), self.rotation)


@dataclass(frozen=True, eq=False)
class Held:
    """The simulated state in which the hand holds a free object, squeezed or lifted. Next steps start from it.

    Args:
        scene, data: the simulation. told: where the joints are told to be [rad], shape (J,).
        extra: controls of the squeeze beyond the touch [of the actuators], shape (A,).
    """

    scene: Scene
    data: Any
    told: FloatArray
    extra: FloatArray


def hold_and_pull(
    solution: GraspSolution,
    hand: Hand,
    obj: GraspObject,
    hold: Hold,
    trajectory: Trajectory,
    *,
    drive: Drive = Drive.SERVO,
    film: Film | None = None,
    show_progress: bool = False,
    then: Callable[[Held], None] | None = None,
) -> HoldReport:
    """Close from the pregrasp on a free object, squeeze it, and pull it in six directions from there, or lift it.

    Obstacles are taken away. The planned forces hold the mass under a pull in any direction. The servo of every joint
    gets the angle at which it exerts its share of them at the touch.

    Args:
        solution: the solution. hand: the hand. obj: the object, at its pose. hold: the test.
        trajectory: the way to the touch, from its pregrasp on, or all of it without one.
        drive: kind of actuators.
        film: takes pictures of closing, squeeze, and the last pull or the lift.
        show_progress: show a bar while convex pieces are computed.
        then: called with the squeezed state, or the lifted one, where the object was held.

    Raises:
        HandError, ObjectError: see `build_scene`. CommandError: see `plan_squeeze`. ClenchError: nothing can be drawn.
    """
    import mujoco

    alone = replace(obj, bodies=tuple(body for body in obj.bodies if body.role is BodyRole.GRASPABLE))
    plan = _plan(solution, hand, alone, hold)
    start = trajectory.positions[0]
    scene = build_scene(hand, alone, solution.hand_pose, start, free=hold, drive=drive, show_progress=show_progress)
    computed = posture(solution.joint_angles, hand, "joint_angles")
    torques = hold.squeeze * joint_torques(plan, hand, computed)
    told = scene.drives.command(computed)
    ends = told, told + scene.drives.pressing(hand, computed, torques)
    report = HoldReport(
        held=False,
        reason="",
        settings=hold,
        plan=plan.text,
        planned=plan.feasible,
        torques=dict(zip(hand.joint_names, torques.tolist(), strict=True)),
    )
    sunk = _in_table(scene, (trajectory.positions[trajectory.pregrasp or 0], computed))
    if sunk > TABLE_OVERLAP:
        return replace(report, reason=f"Not tested: the hand would be {sunk * 1e3:.2g} mm deep in the table.")
    data = mujoco.MjData(scene.model)
    watch = TouchWatch(scene, hand, film)
    before = _close(scene, data, trajectory, watch)
    touch = place_of(scene, data)
    _squeeze(scene, data, ends, watch)
    forces = watch.normal_forces(data)
    if not is_stable(data):
        return replace(report, reason="Not tested: the simulation did not stay finite while the object was squeezed.")
    squeezed = place_of(scene, data)
    pulls, state = _tested(scene, data, hold, before, film)
    report = replace(
        report,
        held=all(pulled.held for pulled in pulls.values()),
        reason=_sentence(pulls, hold),
        angles=dict(zip(hand.joint_names, data.qpos[scene.qpos].tolist(), strict=True)),
        first_touch=watch.first,
        closed=before.motion_to(touch),
        squeezed=touch.motion_to(squeezed),
        forces=_forces(plan, hold, forces),
        pulls=pulls,
    )
    if report.held and then is not None:
        pressing = ends[1] - ends[0]
        # A servo gets angles; an actuator of the model may get other quantities.
        by_model = scene.drives.driven.by_model
        then(Held(scene, state, computed if by_model else computed + pressing, pressing * by_model))
    return report


def _plan(solution: GraspSolution, hand: Hand, obj: GraspObject, hold: Hold) -> SqueezePlan:
    mass, friction = hold.planned_for
    return plan_squeeze(
        solution,
        hand,
        obj,
        mass=mass,
        gravity=DOWN if hold.test == HoldTest.LIFT else None,
        contact_model=hold.contact_model,
        friction=friction,
        torsion=hold.torsion,
    )


def joint_torques(plan: SqueezePlan, hand: Hand, q: FloatArray) -> FloatArray:
    """Return the torque with which every joint, followers too, exerts the forces of a plan [Nm], shape (J,).

    Args:
        plan: the plan; without one the torques are 0. hand: the hand. q: its posture [rad], shape (J,).
    """
    count = len(hand.joints)
    if plan.found.plan is None:
        return np.zeros(count)
    single = DegreesOfFreedom(hand.joint_names, tuple(range(count)), np.eye(count), np.full(count, np.inf))
    J = hand_jacobian(hand, q, plan.grasp.held.contacts, single)
    return np.asarray(J.T @ plan.found.plan.forces.reshape(-1))


def _forces(plan: SqueezePlan, hold: Hold, measured: dict[str, float]) -> dict[str, FingerForce]:
    planned = dict.fromkeys(measured, 0.0)
    if plan.found.plan is not None:
        for contact, force in zip(plan.grasp.contacts, plan.found.plan.forces, strict=True):
            if contact.finger in planned:
                planned[contact.finger] += hold.squeeze * float(force[2])
    return {finger: FingerForce(planned[finger], measured[finger]) for finger in measured}


def _close(scene: Scene, data: Any, trajectory: Trajectory, watch: TouchWatch) -> Place:
    """Close from the pregrasp to the touch; return where the object was before."""
    import mujoco

    begin = trajectory.pregrasp or 0
    at = float(trajectory.times[begin])
    drives = scene.drives
    data.qpos[scene.qpos] = trajectory.positions[begin]
    data.ctrl[drives.numbers] = drives.command(trajectory.positions[begin])
    mujoco.mj_forward(scene.model, data)
    before = place_of(scene, data)
    if watch.film is not None:
        watch.film.begin(scene, data)
    for _ in range(round((trajectory.duration - at + SETTLING) / TIMESTEP)):
        data.ctrl[drives.numbers] = drives.command(trajectory.at(at + data.time))
        mujoco.mj_step(scene.model, data)
        watch.look(data)
    mujoco.mj_forward(scene.model, data)
    watch.still("touch", data)
    return before


def _squeeze(scene: Scene, data: Any, ends: tuple[FloatArray, FloatArray], watch: TouchWatch) -> None:
    import mujoco

    touch, command = ends
    for step in range(round((SQUEEZING + STANDING) / TIMESTEP)):
        done = min(1.0, (step + 1) * TIMESTEP / SQUEEZING)
        data.ctrl[scene.drives.numbers] = touch + done * (command - touch)
        mujoco.mj_step(scene.model, data)
        watch.look(data)
    mujoco.mj_forward(scene.model, data)
    watch.still("squeeze", data)


def _tested(scene: Scene, squeezed: Any, hold: Hold, before: Place, film: Film | None) -> tuple[dict[str, Pulled], Any]:
    """Pull or lift; return the result, and the next state: squeezed, or lifted."""
    if hold.test == HoldTest.LIFT:
        data = _copied(scene, squeezed)
        return {HoldTest.LIFT.value: _pull(scene, data, hold, before, film, lifted=True)}, data
    return pull_each_way(scene, squeezed, hold, before, film), squeezed


def pull_each_way(scene: Scene, state: Any, hold: Hold, before: Place, film: Film | None = None) -> dict[str, Pulled]:
    """Pull the object in six directions, or leave it to gravity if there is some, each time anew from a state.

    Args:
        scene: the scene. state: its `mujoco.MjData`, which is not changed. hold: the test.
        before: where the object is compared with. film: takes pictures of the last pull.
    """
    weighs = hold.test == HoldTest.LIFT
    tests = {"gravity": np.zeros(3)} if weighs else DIRECTIONS
    found = {}
    for name, direction in tests.items():
        data = _copied(scene, state)
        data.xfrc_applied[scene.object_body, :3] = hold.pull * hold.mass * direction
        found[name] = _pull(scene, data, hold, before, film if name == [*tests][-1] else None)
    return found


def _copied(scene: Scene, state: Any) -> Any:
    import mujoco

    data = mujoco.MjData(scene.model)
    mujoco.mj_copyData(data, scene.model, state)
    return data


def _pull(scene: Scene, data: Any, hold: Hold, before: Place, film: Film | None, *, lifted: bool = False) -> Pulled:
    """Simulate a pull, or the lift; the object is compared with its pose before, raised with the palm."""
    import mujoco

    duration = hold.duration + (LIFTING if lifted else 0.0)
    steps, every = max(1, round(duration / TIMESTEP)), round(LOOK_INTERVAL / TIMESTEP)
    taken, height = 0, 0.0
    motion = farthest = before.motion_to(place_of(scene, data))
    while taken < steps and _within(motion, hold):
        for _ in range(min(every, steps - taken)):
            taken += 1
            if lifted:
                part = min(1.0, taken * TIMESTEP / LIFTING)
                data.ctrl[-1] = hold.height * part * part * (3.0 - 2.0 * part)
            mujoco.mj_step(scene.model, data)
            if film is not None:
                film.look(data)
        mujoco.mj_kinematics(scene.model, data)
        mujoco.mj_comPos(scene.model, data)
        if not is_stable(data):
            return Pulled(False, motion, farthest, taken * TIMESTEP)
        if lifted:
            height = float(data.qpos[scene.lift])
        motion = before.raised(height).motion_to(place_of(scene, data))
        farthest = ObjectMotion(max(farthest.distance, motion.distance), max(farthest.angle, motion.angle))
    if film is not None:
        film.still("end", data)
    return Pulled(_within(motion, hold), motion, farthest, taken * TIMESTEP)


def place_of(scene: Scene, data: Any) -> Place:
    """Return where the object is."""
    body = scene.object_body
    return Place(data.xipos[body].copy(), data.xmat[body].reshape(3, 3).copy())


def _within(motion: ObjectMotion, hold: Hold) -> bool:
    return motion.within(hold.max_distance, hold.max_angle)


def is_stable(data: Any) -> bool:
    """Return whether the simulation has stayed finite: otherwise the engine restarts from the beginning."""
    import mujoco

    kinds = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)
    return not any(data.warning[kind].number for kind in kinds)


def _in_table(scene: Scene, postures: tuple[FloatArray, ...]) -> float:
    """Return how deep the hand is in the table in the worst of some postures [m], 0 without a table."""
    import mujoco

    table = mujoco.mj_name2id(scene.model, mujoco.mjtObj.mjOBJ_GEOM, TABLE)
    data, deepest = mujoco.MjData(scene.model), 0.0
    for q in postures if table >= 0 else ():
        data.qpos[scene.qpos] = q
        mujoco.mj_forward(scene.model, data)
        geoms = data.contact.geom
        mine = (geoms == table).any(axis=1) & ~np.isin(geoms, scene.object_geoms).any(axis=1)
        deepest = max(deepest, -float(data.contact.dist[mine].min(initial=0.0)))
    return deepest


def _sentence(pulls: dict[str, Pulled], hold: Hold) -> str:
    far = max(p.farthest.distance for p in pulls.values())
    turned = np.rad2deg(max(p.farthest.angle for p in pulls.values()))
    moved = f"it moved by up to {far * 1e3:.2g} mm and {turned:.2g}°, closing and squeeze included."
    lost = [name for name, pulled in pulls.items() if not pulled.held]
    if hold.test == HoldTest.LIFT:
        how = f"when lifted by {hold.height:g} m"
        return f"Dropped {how}." if lost else f"Held {how}; {moved}"
    force = f"{hold.pull * hold.mass:.3g} N"
    if lost:
        return f"Dropped when pulled with {force} along {', '.join(lost)}."
    return f"Held against {force} in six directions; {moved}"
