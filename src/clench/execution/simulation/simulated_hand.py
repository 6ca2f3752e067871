"""A simulated hand (MuJoCo): opens, closes to the computed angles, and reports the reached posture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from clench.core.argument_types import check_type
from clench.core.pose import FloatArray, Pose
from clench.core.showing.short_repr import described
from clench.execution.execution_report import (
    ContactReached,
    ExecutionReport,
    JointReached,
    NextStepReached,
    judge_steps,
    notes_on_steps,
)
from clench.execution.hardware.joint_blocking import simulated_blocker
from clench.execution.history import ExecutionHistory
from clench.execution.trajectory import Trajectory
from clench.execution.trajectory_checks import check_for_hand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import Contact, FingerStatus, GraspSolution

from .filming import Film
from .hold import Hold, HoldReport
from .mujoco_scene import TIMESTEP, Scene, body_pose, build_scene
from .piece_hold import (
    NO_GRASP_ON_PIECES,
    ON_PIECES,
    CollidedGrasp,
    as_collided,
    hold_as_collided,
    notes_on_given,
    solve_on_pieces,
)
from .simulated_actuators import Drive, check_drive, sentences
from .stepping import Stepper
from .touch_watch import TouchWatch

#: Rest of the hand after the motion, in which the servos settle [s].
SETTLING = 0.4
#: Interval of posture samples [s].
WATCH_INTERVAL = 0.02


class SimulatedHand:
    """Move a hand in simulation, with the palm fixed and the object held in place.

    The simulated object consists of convex pieces, and its contacts are a little soft. Angles and contacts are
    therefore reached up to tolerances, which the report names.

    Args:
        hand: the hand.
        obj: the object, at the solution's pose.
        angle_tolerance: largest difference to the computed angles that counts as reached [rad].
        contact_tolerance: largest distance that counts as touching [m].
        show_progress: show a bar while convex pieces are computed.
        hold: after the touch, repeat the grasp with a free object, squeeze it as planned, and pull or lift it. Without
            it the object is fixed.
        drive: actuators of its joints, also in the hold test: "servo" or "model", see `Drive`.
        film: takes pictures of the hold test, or of closing without one.
        on_step: called with time [s], joint angles [rad] in model order, shape (J,), every 20 ms and at the end.
    """

    name = "simulated"

    def __init__(
        self,
        hand: Hand,
        obj: GraspObject,
        *,
        angle_tolerance: float = 0.02,
        contact_tolerance: float = 0.001,
        show_progress: bool = False,
        hold: Hold | None = None,
        drive: Drive | str = Drive.SERVO,
        film: Film | None = None,
        on_step: Callable[[float, FloatArray], None] | None = None,
    ) -> None:
        check_type(hand, Hand, "hand")
        check_type(obj, GraspObject, "obj")
        self._hand = hand
        self.obj = obj
        self.angle_tolerance = angle_tolerance
        self.contact_tolerance = contact_tolerance
        self.show_progress = show_progress
        self.hold = hold
        self.drive = check_drive(drive)
        self.film = film
        self.on_step = on_step

    def __repr__(self) -> str:
        return described(self, hand=self.hand.name, obj=self.obj.name, hold=self.hold, drive=self.drive)

    @property
    def hand(self) -> Hand:
        """The hand that it moves."""
        return self._hand

    def execute(self, solution: GraspSolution, trajectory: Trajectory) -> ExecutionReport:
        """Open, follow the trajectory, stand still for a moment, compare with the solution; test the hold if asked.

        Raises:
            HandError: the hand cannot be simulated. ObjectError: the object cannot. CommandError: the solution or
                the trajectory does not fit the hand.
        """
        check_for_hand(trajectory, solution, self.hand)
        grasp = CollidedGrasp(solution, self.obj.posed(solution.object_pose), trajectory)
        touch = self._close_as_collided(grasp)
        grasp, success, reason = touch.grasp, touch.success, touch.reason
        held: HoldReport | None = None
        steps: tuple[NextStepReached, ...] = ()
        if success and self.hold is not None:
            held, steps = self._held(grasp, self.hold)
            success, reason = held.held, f"{reason} {held.reason}"
        elif success and solution.next_steps:
            stepper = Stepper(grasp.solution, self.hand, grasp.trajectory.pace, self.angle_tolerance)
            told = grasp.trajectory.positions[-1]
            steps = stepper.in_place(touch.scene, touch.data, told, touch.watch.film, touch.samples.look)
        touch.samples.end(touch.data)
        if success:
            success, reason = judge_steps(success, reason, steps)
        return ExecutionReport(
            actuator=self.name,
            success=success,
            reason=reason,
            joints=touch.joints,
            contacts=touch.contacts,
            touched_links=touch.touched_links,
            first_touch=touch.watch.first,
            duration=float(touch.data.time),
            largest_angle_error=max((abs(joint.error) for joint in touch.joints.values()), default=0.0),
            angle_tolerance=self.angle_tolerance,
            contact_tolerance=self.contact_tolerance,
            notes=(
                *_notes(touch.scene, solution),
                *sentences(touch.scene.drives.driven, self.drive),
                *self._notes_on_hold(held),
                *notes_on_given(touch.as_given, held),
                *notes_on_steps(solution, steps),
            ),
            driven_by=touch.scene.drives.driven.by,
            history=touch.samples.history(),
            hold=held,
            next_steps=steps,
        )

    def _close_as_collided(self, grasp: CollidedGrasp) -> _Touch:
        """Close the hand; where convex pieces of the object stop it, close it as solved again on these pieces."""
        scene = self._scene(grasp)
        if not scene.approximated:
            return self._close(scene, grasp, watched=True)
        touch = given = self._close(scene, grasp, watched=False)
        collided = None if given.success else as_collided(grasp.obj, self.show_progress)
        if collided is not None:
            again = solve_on_pieces(grasp.solution, self.hand, collided, grasp.trajectory)
            touch = given if again is None else self._close(self._scene(again), again, watched=False)
        if self.film is not None or self.on_step is not None:
            touch = self._close(touch.scene, touch.grasp, watched=True)
        if collided is None:
            return touch
        if touch.grasp is grasp:
            return replace(touch, reason=f"{touch.reason} {NO_GRASP_ON_PIECES}")
        ended = f": {touch.reason[:1].lower()}{touch.reason[1:]}" if touch.success else f". {touch.reason}"
        return replace(touch, reason=f"Executed {ON_PIECES}{ended}", as_given=given.reason)

    def _scene(self, grasp: CollidedGrasp) -> Scene:
        start = grasp.trajectory.positions[0]
        return build_scene(
            self.hand,
            grasp.obj,
            grasp.solution.hand_pose,
            start,
            drive=self.drive,
            show_progress=self.show_progress,
        )

    def _close(self, scene: Scene, grasp: CollidedGrasp, watched: bool) -> _Touch:
        """Simulate the motion to the touch, and compare with the solution; `watched` by the film and the observer."""
        solution = grasp.solution
        computed = posture(solution.joint_angles, self.hand, "joint_angles")
        watch = TouchWatch(scene, self.hand, self.film if watched and self.hold is None else None)
        samples = _Samples(scene, grasp.trajectory.joints, self.on_step if watched else None)
        data = self._run(scene, grasp.trajectory, watch, samples)
        reached = data.qpos[scene.qpos]
        joints = {
            name: JointReached(float(c), float(r))
            for name, c, r in zip(self.hand.joint_names, computed, reached, strict=True)
        }
        T_palm_link = self.hand.link_poses(computed)
        contacts = tuple(
            self._contact(scene, data, c, solution.hand_pose, T_palm_link) for c in solution.contacts if not c.passed
        )
        touched = tuple(
            link.name
            for i, link in enumerate(self.hand.links)
            if nearest(scene, data, i, self.contact_tolerance)[0] <= self.contact_tolerance
        )
        success, reason = self._judge(solution, joints, contacts, partial(simulated_blocker, scene, data, self.hand))
        return _Touch(grasp, scene, data, watch, samples, joints, contacts, touched, success, reason)

    def _held(self, grasp: CollidedGrasp, hold: Hold) -> tuple[HoldReport, tuple[NextStepReached, ...]]:
        steps: list[NextStepReached] = []
        stepper = Stepper(grasp.solution, self.hand, grasp.trajectory.pace, self.angle_tolerance)
        report = hold_as_collided(
            grasp.solution,
            self.hand,
            grasp.obj,
            hold,
            grasp.trajectory,
            drive=self.drive,
            film=self.film,
            show_progress=self.show_progress,
            then=lambda held: steps.extend(stepper.after_hold(held, hold, self.film)),
        )
        return report, tuple(steps)

    def _notes_on_hold(self, held: HoldReport | None) -> tuple[str, ...]:
        if self.hold is None:
            return ()
        if held is None:
            return ("Holding was not tested: the touch was not reached.",)
        notes = ["Angles and contacts are of a run with the object held in place; for the hold test it was free."]
        if not held.pulls:
            notes = ["Angles and contacts are of a run with the object held in place, alone."]
            notes += ["There are no pictures: the hold test was not carried out."] * (self.film is not None)
        if not held.planned:
            notes.append(f"The planned squeeze does not hold the mass. {held.plan}")
        return tuple(notes)

    def _run(self, scene: Scene, trajectory: Trajectory, watch: TouchWatch, samples: _Samples) -> Any:
        """Simulate the motion to the touch; return the state there."""
        import mujoco

        data = mujoco.MjData(scene.model)
        data.qpos[scene.qpos] = trajectory.positions[0]
        data.ctrl[:] = scene.drives.command(trajectory.positions[0])
        mujoco.mj_forward(scene.model, data)
        if watch.film is not None:
            watch.film.begin(scene, data)
        for _ in range(int(np.ceil((trajectory.duration + SETTLING) / TIMESTEP)) + 1):
            told = trajectory.at(data.time)
            samples.look(data, told)
            data.ctrl[:] = scene.drives.command(told)
            mujoco.mj_step(scene.model, data)
            watch.look(data)
        mujoco.mj_forward(scene.model, data)
        watch.look(data)
        watch.still("touch", data)
        return data

    def _contact(
        self, scene: Scene, data: Any, contact: Contact, hand_pose: Pose, T_palm_link: FloatArray
    ) -> ContactReached:
        link = self.hand.link_index(contact.link)
        gap, position = nearest(scene, data, link, np.inf)
        T_world_computed = hand_pose.matrix @ T_palm_link[link]
        p_link = np.linalg.inv(T_world_computed) @ np.append(contact.position, 1.0)
        moved = (body_pose(data, scene.link_bodies[link]) @ p_link)[:3]
        return ContactReached(
            finger=contact.finger,
            link=contact.link,
            computed=np.array(contact.position),
            position=position,
            gap=gap,
            displacement=float(np.linalg.norm(moved - contact.position)),
            touches=gap <= self.contact_tolerance,
        )

    def _judge(
        self,
        solution: GraspSolution,
        joints: dict[str, JointReached],
        contacts: tuple[ContactReached, ...],
        blocker: Callable[[str], str],
    ) -> tuple[bool, str]:
        touching = {c.finger for c in contacts if c.touches}
        wanted = [n for n, f in solution.fingers.items() if f.status is FingerStatus.TOUCH]
        absent = [name for name in wanted if name not in touching]
        worst = max(joints, key=lambda name: abs(joints[name].error))
        error = abs(joints[worst].error)
        if error > self.angle_tolerance:
            far = f"joint '{worst}' is {error:.3g} rad from its computed angle"
            return False, f"Not reached: {far}; tolerance {self.angle_tolerance:g} rad. {blocker(worst)}".rstrip()
        if absent:
            return False, f"Finger '{absent[0]}' does not touch; tolerance {self.contact_tolerance:g} m."
        return True, f"Every joint is within {error:.2g} rad of its computed angle, and {len(wanted)} fingers touch."


@dataclass(frozen=True, eq=False)
class _Touch:
    """The outcome of closing the hand around an object that is held in place.

    Args:
        grasp: what was carried out. scene, data: the simulation, and its state at the touch.
        watch, samples: what was seen on the way.
        joints: by name. contacts: those of the solution. touched_links: at the end.
        success: the hand reached the grasp. reason: one sentence.
        as_given: why the touch of the solution itself was not reached, if another grasp was executed.
    """

    grasp: CollidedGrasp
    scene: Scene
    data: Any
    watch: TouchWatch
    samples: _Samples
    joints: dict[str, JointReached]
    contacts: tuple[ContactReached, ...]
    touched_links: tuple[str, ...]
    success: bool
    reason: str
    as_given: str = ""


@dataclass
class _Samples:
    """Record targets and measurements every `WATCH_INTERVAL`, and pass them to the observer."""

    scene: Scene
    joints: tuple[str, ...]
    on_step: Callable[[float, FloatArray], None] | None
    times: list[float] = field(default_factory=list)
    told: list[FloatArray] = field(default_factory=list)
    measured: list[FloatArray] = field(default_factory=list)
    steps: int = 0

    def look(self, data: Any, told: FloatArray) -> None:
        """Note the state when it is time to."""
        if self.steps % round(WATCH_INTERVAL / TIMESTEP) == 0:
            self.end(data)
            self.times.append(float(data.time))
            self.told.append(told)
            self.measured.append(np.array(data.qpos[self.scene.qpos]))
        self.steps += 1

    def end(self, data: Any) -> None:
        """Show the state."""
        if self.on_step is not None:
            self.on_step(float(data.time), np.array(data.qpos[self.scene.qpos]))

    def history(self) -> ExecutionHistory:
        """Return the recorded history."""
        return ExecutionHistory(self.joints, np.array(self.times), np.array(self.told), np.array(self.measured))


def nearest(scene: Scene, data: Any, link: int, within: float) -> tuple[float, FloatArray]:
    """Return the distance of a link to the object [m], negative for overlap, and the place [m], shape (3,).

    The distance is infinite when the link has no geometry or is farther away than `within` [m].
    """
    import mujoco

    model, best, place = scene.model, np.inf, np.zeros(3)
    ends = np.zeros(6)
    others = np.array(scene.object_geoms, dtype=np.int64)
    for geom in scene.link_geoms[link]:
        apart = np.linalg.norm(data.geom_xpos[others] - data.geom_xpos[geom], axis=1)
        bound = apart - model.geom_rbound[others] - model.geom_rbound[geom]
        for k in np.argsort(bound):
            reach = min(best, within)
            if bound[k] > reach:
                break
            distance = mujoco.mj_geomDistance(model, data, geom, int(others[k]), min(reach, 10.0) + 1e-6, ends)
            if distance < min(best, within + 1e-6):
                best, place = float(distance), (ends[:3] + ends[3:]) / 2.0
    return best, place


def _notes(scene: Scene, solution: GraspSolution) -> tuple[str, ...]:
    notes = ["Contacts in the simulation are a little soft: links may overlap the object by some micrometres."]
    if scene.approximated:
        names = ", ".join(f"'{name}'" for name in scene.approximated)
        notes.append(f"The simulated shape of {names} is made of convex pieces, which are near the true surface only.")
    if solution.collision_source != "engine":
        notes.append(
            f"The solution is for the hand's '{solution.collision_source}' geometry, the simulation collides 'engine'."
        )
    return tuple(notes)
