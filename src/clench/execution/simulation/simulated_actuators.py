"""The actuators of a simulated hand: those of its own model, or servos that the simulation adds."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
import numpy.typing as npt

from clench.core.exceptions import CommandError, HandError
from clench.core.pose import FloatArray
from clench.core.rendering.opengl import import_mujoco
from clench.mechanics.grasp.jacobian import degrees_of_freedom
from clench.models.hand.hand import Hand
from clench.models.hand.reading.kinematics import fixed_tendon

IndexArray = npt.NDArray[np.int64]
#: Elements of a hand's model that the scene makes, or has no use for.
_REPLACED = ("sensor", "keyframe", "option", "size", "statistic", "visual")
#: Elements that would compete with servos at every joint.
_DRIVING = ("actuator", "tendon", "equality")
SERVO = "servo "
#: Value of `driven_by` for joints that equalities of the model move along.
COUPLED = "coupled"


class Drive(StrEnum):
    """Name the kinds of actuators of a simulated hand."""

    SERVO = "servo"
    """a stiff position servo at every joint; couplings hold because trajectories obey them"""
    MODEL = "model"
    """position actuators, tendons, couplings, friction and damping of the model; servos for the remaining joints"""


def check_drive(drive: Drive | str) -> Drive:
    """Return a drive by its name.

    Raises:
        CommandError: there is no such drive.
    """
    if drive not in list(Drive):
        raise CommandError(f"drive: expected one of {', '.join(Drive)}, got {drive!r}.")
    return Drive(drive)


@dataclass(frozen=True)
class Driven:
    """The drive of every joint of a hand.

    Args:
        by: name of the model's actuator, "servo" or "coupled", by joint.
        unfit: names of actuators of the model that are unused because they are no position servos.
    """

    by: Mapping[str, str]
    unfit: tuple[str, ...] = ()

    @property
    def servos(self) -> tuple[str, ...]:
        """Joints that a servo moves."""
        return tuple(joint for joint, by in self.by.items() if by == Drive.SERVO)

    @property
    def by_model(self) -> bool:
        """Whether actuators of the model move any joint."""
        return len(self.servos) < len(self.by)


def driving_spec(hand: Hand, drive: Drive, still: tuple[int, ...]) -> tuple[Any, Driven]:
    """Return the hand's `mujoco.MjSpec` with the used actuators, and the drive of each joint.

    Used are position servos (affine bias, no dynamics) of joints and of fixed tendons that belong to the hand.

    Args:
        hand: the hand. drive: see `Drive`. still: joints that servos hold, regardless of the model.

    Raises:
        HandError: the hand has no model.
    """
    if not hand.spec_xml:
        raise HandError(f"Hand '{hand.name}' has no model that can be simulated.")
    servos = Driven(dict.fromkeys(hand.joint_names, Drive.SERVO.value))
    if drive == Drive.MODEL:
        spec = _spec(hand, _REPLACED)
        driven = _chosen(spec, hand, {hand.joint_names[j] for j in still})
        if driven.by_model:
            return spec, driven
        servos = Driven(servos.by, driven.unfit)
    return _spec(hand, (*_REPLACED, *_DRIVING)), servos


def _spec(hand: Hand, without: tuple[str, ...]) -> Any:
    mujoco = import_mujoco()
    root = ET.fromstring(hand.spec_xml)
    for tag in without:
        for element in root.findall(tag):
            root.remove(element)
    return mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"), assets=dict(hand.assets))


def _chosen(spec: Any, hand: Hand, still: set[str]) -> Driven:
    """Delete unused actuators and equalities of bodies from a spec; return the drive of each joint."""
    import mujoco

    of_joints = mujoco.mjtEq.mjEQ_JOINT, mujoco.mjtEq.mjEQ_TENDON
    for equality in [e for e in spec.equalities if e.type not in of_joints]:
        spec.delete(equality)
    for number, actuator in enumerate(spec.actuators):
        actuator.name = actuator.name or f"actuator {number}"
    model = spec.copy().compile()
    names, by, unfit = set(hand.joint_names), dict[str, str](), []
    for actuator in list(spec.actuators):
        a = model.actuator(actuator.name).id
        moved = {model.joint(j).name for j in arms_of(model, a)}
        if moved and moved <= names - still and _is_servo(model, a):
            by |= dict.fromkeys(moved, actuator.name)
            continue
        if moved <= names and not moved & still:
            unfit.append(actuator.name)
        spec.delete(actuator)
    if not by:
        return Driven(dict.fromkeys(hand.joint_names, Drive.SERVO.value), tuple(unfit))
    _follow(model, by)
    followers = {hand.joint_names[c.follower] for c in hand.couplings}
    for name in sorted(hand.joint_names, key=lambda joint: joint in followers):
        if name not in by:
            by[name] = Drive.SERVO.value
            _follow(model, by)
    return Driven({name: by[name] for name in hand.joint_names}, tuple(unfit))


def _is_servo(model: Any, a: int) -> bool:
    import mujoco

    return bool(
        model.actuator_dyntype[a] == mujoco.mjtDyn.mjDYN_NONE
        and model.actuator_gaintype[a] == mujoco.mjtGain.mjGAIN_FIXED
        and model.actuator_biastype[a] == mujoco.mjtBias.mjBIAS_AFFINE
        and model.actuator_gainprm[a, 0] > 0.0
        and model.actuator_biasprm[a, 1] < 0.0
    )


def arms_of(model: Any, a: int) -> dict[int, float]:
    """Return how an actuator's length grows with joint angles; empty unless it acts on a joint or a fixed tendon."""
    import mujoco

    target, gear = int(model.actuator_trnid[a, 0]), float(model.actuator_gear[a, 0])
    kind = model.actuator_trntype[a]
    if kind == mujoco.mjtTrn.mjTRN_JOINT or kind == mujoco.mjtTrn.mjTRN_JOINTINPARENT:
        return {target: gear}
    if kind == mujoco.mjtTrn.mjTRN_TENDON:
        return {joint: gear * arm for joint, arm in fixed_tendon(model, target)}
    return {}


def _follow(model: Any, by: dict[str, str]) -> None:
    """Add the joints that equalities of the model tie to the driven ones."""
    import mujoco

    ties = []
    for e in range(model.neq):
        ends = [int(end) for end in (model.eq_obj1id[e], model.eq_obj2id[e]) if end >= 0]
        if model.eq_type[e] == mujoco.mjtEq.mjEQ_TENDON:
            ends = [joint for tendon in ends for joint, _ in fixed_tendon(model, tendon)]
        if model.eq_active0[e]:
            ties.append({model.joint(joint).name for joint in ends})
    for _ in ties:
        for tied in ties:
            if len(tied) == 1 or not tied.isdisjoint(by):
                by |= dict.fromkeys(tied - set(by), COUPLED)


@dataclass(frozen=True, eq=False)
class Drives:
    """Set the controls of a scene's actuators.

    Args:
        numbers: of the hand's actuators in the scene, shape (A,). driven: drive of each joint.
        arms: how lengths of actuators grow with joint angles, shape (A, J).
        gains: force per control, shape (A,). ratios, offsets: of the control that holds a length, shape (A,).
    """

    numbers: IndexArray
    driven: Driven
    arms: FloatArray
    gains: FloatArray
    ratios: FloatArray
    offsets: FloatArray

    def command(self, q: FloatArray) -> FloatArray:
        """Return the controls at which no actuator exerts a force in a posture [rad], shape (A,)."""
        told: FloatArray = self.offsets + self.ratios * (self.arms @ q)
        return told

    def pressing(self, hand: Hand, q: FloatArray, torques: FloatArray) -> FloatArray:
        """Return the change of the controls by which the hand exerts torques [Nm], shape (A,).

        With fewer actuators than joints, the torques do the same work in every motion that couplings allow.
        """
        if not self.driven.by_model:
            return torques / self.gains
        motion = degrees_of_freedom(hand, q).motion
        forces = np.linalg.lstsq(motion.T @ self.arms.T, motion.T @ torques, rcond=None)[0]
        return np.asarray(forces / self.gains)


def find_drives(model: Any, joints: IndexArray, hand_actuators: IndexArray, driven: Driven) -> Drives:
    """Read the hand's actuators from a compiled scene whose servos are tuned.

    Args:
        model: the scene's. joints: numbers of the hand's joints in it, shape (J,).
        hand_actuators: numbers of the hand's actuators, shape (A,). driven: drive of each joint.
    """
    columns = {int(joint): k for k, joint in enumerate(joints)}
    arms = np.zeros((len(hand_actuators), len(joints)))
    for row, a in enumerate(hand_actuators):
        for joint, arm in arms_of(model, int(a)).items():
            arms[row, columns[joint]] += arm
    gains, biases = model.actuator_gainprm[hand_actuators, 0], model.actuator_biasprm[hand_actuators]
    return Drives(hand_actuators, driven, arms, gains, -biases[:, 1] / gains, -biases[:, 0] / gains)


def sentences(driven: Driven, asked: Drive | str) -> tuple[str, ...]:
    """Describe the drives of the joints, unless all are plain default servos."""
    if asked != Drive.MODEL:
        return ()
    found = []
    own = len({by for by in driven.by.values() if by not in (Drive.SERVO, COUPLED)})
    coupled = sum(by == COUPLED for by in driven.by.values())
    if driven.by_model:
        found.append(
            f"Joints were moved by {own} actuators of the model, {coupled} followed by its couplings, and "
            f"{len(driven.servos)} had servos of the simulation."
        )
    else:
        found.append("The model has no position actuators for this hand: all joints had servos of the simulation.")
    if driven.unfit:
        names = ", ".join(f"'{name}'" for name in driven.unfit)
        found.append(f"Not used, because they are no position servos of joints or fixed tendons: {names}.")
    return tuple(found)
