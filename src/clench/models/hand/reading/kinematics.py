"""Turn MuJoCo's bodies and joints into links with at most one joint each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from clench.core.exceptions import HandError
from clench.core.pose import FloatArray, Pose
from clench.models.hand.findings import Finding, FindingCode, Severity
from clench.models.hand.hand import Joint
from clench.models.hand.hand_file import JointOverride

from .compiled import CompiledModel
from .limits import EFFORT_PLACEHOLDER, doubtful_joints, joint_limits


@dataclass(frozen=True)
class Frame:
    """Describe a link before its geometry is known; see `clench.models.hand.hand.Link`."""

    name: str
    parent: int
    joint: int
    T_parent_link: FloatArray
    mass: float
    body: int


@dataclass(frozen=True)
class Skeleton:
    """The links and joints of a hand, with their numbers in MuJoCo's model.

    Args:
        frames: links, parents first. Bodies with several joints are preceded by links without geometry.
        joints: revolute joints, in link order.
        link_of_body: last link of every kept MuJoCo body.
        joint_of_model: index of a joint by MuJoCo's joint number.
        findings: problems and notes.
    """

    frames: tuple[Frame, ...]
    joints: tuple[Joint, ...]
    link_of_body: Mapping[int, int]
    joint_of_model: Mapping[int, int]
    findings: tuple[Finding, ...]


def build_skeleton(
    compiled: CompiledModel,
    bodies: list[int],
    palm: int,
    velocities: Mapping[str, float],
    given: Mapping[str, JointOverride],
) -> Skeleton:
    """Read links and joints of the kept bodies.

    Args:
        compiled: the model. bodies: kept bodies, parents first. palm: the palm's body.
        velocities: velocity limits [rad/s] by joint name. given: what the hand file says instead of the model, by name.

    Raises:
        HandError: a finger has a joint that is not revolute.
    """
    m = compiled.model
    frames: list[Frame] = []
    joints: list[Joint] = []
    link_of_body: dict[int, int] = {}
    joint_of_model: dict[int, int] = {}
    findings: list[Finding] = []
    efforts = _efforts(m)
    for body in bodies:
        parent = link_of_body.get(int(m.body_parentid[body]), -1) if body else -1
        name = compiled.body_name(body)
        T = Pose(m.body_pos[body], m.body_quat[body], key=f"link '{name}'").matrix
        moving = _revolute_joints(compiled, body, palm, findings)
        for k, j in enumerate(moving):
            joints.append(_joint(compiled, j, efforts.get(j), velocities, given))
            joint_of_model[j] = len(joints) - 1
            last = k == len(moving) - 1
            link_name = name if last else f"{name}__{joints[-1].name}"
            mass = float(m.body_mass[body]) if last else 0.0
            frames.append(Frame(link_name, parent, len(joints) - 1, T, mass, body if last else -1))
            parent, T = len(frames) - 1, np.eye(4)
        if not moving:
            frames.append(Frame(name, parent, -1, T, float(m.body_mass[body]), body))
        link_of_body[body] = len(frames) - 1
    findings += doubtful_joints(compiled, joint_of_model, efforts, given)
    return Skeleton(tuple(frames), tuple(joints), link_of_body, joint_of_model, tuple(findings))


def _revolute_joints(compiled: CompiledModel, body: int, palm: int, findings: list[Finding]) -> list[int]:
    """Return a body's revolute joints; others are refused in fingers and held still upstream."""
    import mujoco

    m = compiled.model
    kinds = {
        int(mujoco.mjtJoint.mjJNT_SLIDE): "prismatic",
        int(mujoco.mjtJoint.mjJNT_BALL): "a ball joint",
        int(mujoco.mjtJoint.mjJNT_FREE): "a free joint",
    }
    found: list[int] = []
    start = int(m.body_jntadr[body])
    for j in range(start, start + int(m.body_jntnum[body])):
        kind = kinds.get(int(m.jnt_type[j]))
        if kind is None:
            found.append(j)
        elif body > palm:
            raise HandError(
                f"{compiled.label}: joint '{compiled.joint_name(j)}' of link '{compiled.body_name(body)}' is {kind}; "
                "clench closes fingers made of revolute joints."
            )
        elif kind != "a free joint":
            name = compiled.joint_name(j)
            text = f"Joint '{name}' before the palm is {kind}; it is held at its reference."
            findings.append(
                Finding(
                    FindingCode.JOINT_HELD,
                    text,
                    "Nothing to do: commands place the palm.",
                    Severity.NOTE,
                    joints=(name,),
                )
            )
    return found


def _joint(
    compiled: CompiledModel,
    j: int,
    effort: float | None,
    velocities: Mapping[str, float],
    given: Mapping[str, JointOverride],
) -> Joint:
    m = compiled.model
    name = compiled.joint_name(j)
    own = given.get(name, JointOverride())
    lower, upper = own.limits or joint_limits(compiled, j)
    reference = float(m.qpos0[m.jnt_qposadr[j]])
    if effort is not None and effort > EFFORT_PLACEHOLDER:
        effort = None
    axis = np.array(m.jnt_axis[j])
    stiffness, share = _servo(m, j)
    return Joint(
        name=name,
        axis=axis / np.linalg.norm(axis),
        anchor=np.array(m.jnt_pos[j]),
        lower=lower,
        upper=upper,
        reference=reference,
        velocity=velocities.get(name),
        effort=own.effort or effort,
        stiffness=stiffness,
        servo_share=share,
        friction_loss=float(m.dof_frictionloss[m.jnt_dofadr[j]]),
    )


def _efforts(model: Any) -> dict[int, float]:
    """Return effort limits [Nm] by MuJoCo joint: the smaller limit of joint and actuator."""
    import mujoco

    efforts: dict[int, float] = {}

    def limit(joint: int, value: float) -> None:
        if np.isfinite(value) and value > 0.0:
            efforts[joint] = min(value, efforts.get(joint, np.inf))

    for j in range(model.njnt):
        if model.jnt_actfrclimited[j]:
            limit(j, float(np.abs(model.jnt_actfrcrange[j]).max()))
    for a in range(model.nu):
        force = _actuator_force(model, a) * abs(float(model.actuator_gear[a, 0]))
        target = int(model.actuator_trnid[a, 0])
        if model.actuator_trntype[a] == mujoco.mjtTrn.mjTRN_JOINT:
            limit(target, force)
        elif model.actuator_trntype[a] == mujoco.mjtTrn.mjTRN_TENDON:
            for joint, coefficient in fixed_tendon(model, target):
                limit(joint, force * abs(coefficient))
    return efforts


def _actuator_force(model: Any, a: int) -> float:
    """Return the largest force of an actuator, infinite when the model gives no limit."""
    return float(np.abs(actuator_forces(model, a)).max())


def actuator_forces(model: Any, a: int) -> tuple[float, float]:
    """Return the least and the largest force of an actuator, infinite when the model gives no limit."""
    import mujoco

    if model.actuator_forcelimited[a]:
        low, high = model.actuator_forcerange[a]
        return float(low), float(high)
    motor = model.actuator_biastype[a] == mujoco.mjtBias.mjBIAS_NONE
    if motor and model.actuator_ctrllimited[a]:
        low, high = sorted(model.actuator_ctrlrange[a] * model.actuator_gainprm[a, 0])
        return float(low), float(high)
    return -float("inf"), float("inf")


def _servo(model: Any, joint: int) -> tuple[float | None, float]:
    """Return the gain that a position servo has at a joint [Nm/rad], and that gain beside the servo's own [-].

    The servo is that of the joint or of its fixed tendon; without one the gain is None. A tendon's servo counts as `k_p
    sum(c_i²)`. Suppose every joint of the tendon gets a target offset `tau_i / stiffness` with `tau_i = c_i F`. Then
    the tendon's target grows by `F / k_p`, and it pulls with the force F.
    """
    import mujoco

    for a in range(model.nu):
        gain, bias = float(model.actuator_gainprm[a, 0]), float(model.actuator_biasprm[a, 1])
        if model.actuator_biastype[a] != mujoco.mjtBias.mjBIAS_AFFINE or gain <= 0.0 or bias != -gain:
            continue
        target = int(model.actuator_trnid[a, 0])
        arms = {}
        if model.actuator_trntype[a] == mujoco.mjtTrn.mjTRN_JOINT:
            arms = {target: 1.0}
        elif model.actuator_trntype[a] == mujoco.mjtTrn.mjTRN_TENDON:
            arms = dict(fixed_tendon(model, target))
        if arms.get(joint, 0.0) != 0.0:
            share = float(model.actuator_gear[a, 0]) ** 2 * sum(arm * arm for arm in arms.values())
            return (gain * share, share) if np.isfinite(gain * share) else (None, 1.0)
    return None, 1.0


def fixed_tendon(model: Any, tendon: int) -> list[tuple[int, float]]:
    """Return the joints of a fixed tendon with their coefficients [m/rad]; empty for a spatial tendon."""
    import mujoco

    start = int(model.tendon_adr[tendon])
    wraps = range(start, start + int(model.tendon_num[tendon]))
    if any(model.wrap_type[w] != mujoco.mjtWrap.mjWRAP_JOINT for w in wraps):
        return []
    return [(int(model.wrap_objid[w]), float(model.wrap_prm[w])) for w in wraps]
