"""Turn MuJoCo's bodies and joints into links with at most one joint each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from clench.base.errors import HandError
from clench.base.pose import FloatArray, Pose

from .compiled import CompiledModel
from .hand import Joint

#: Ranges above a whole turn are placeholders, not limits [rad].
_FULL_TURN = 2 * np.pi
#: Hands whose joints all turn less are likely misread: 2 pi degrees [rad].
_DEGREES_MISREAD = np.deg2rad(2 * np.pi)
#: Efforts above this are placeholders for a finger [Nm].
_EFFORT_PLACEHOLDER = 1e3


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
    """Hold the kinematics of a hand.

    Args:
        frames: links, parents first. Bodies with several joints are preceded by links without geometry.
        joints: revolute joints, in link order.
        link_of_body: last link of every kept MuJoCo body.
        joint_of_model: index of a joint by MuJoCo's joint number.
        warnings: sentences about what looks wrong.
    """

    frames: tuple[Frame, ...]
    joints: tuple[Joint, ...]
    link_of_body: Mapping[int, int]
    joint_of_model: Mapping[int, int]
    warnings: tuple[str, ...]


def build_skeleton(compiled: CompiledModel, bodies: list[int], palm: int, velocities: Mapping[str, float]) -> Skeleton:
    """Read links and joints of the kept bodies.

    Args:
        compiled: the model. bodies: kept bodies, parents first. palm: the palm's body.
        velocities: velocity limits [rad/s] by joint name.

    Raises:
        HandError: a finger has a joint that is not revolute.
    """
    m = compiled.model
    frames: list[Frame] = []
    joints: list[Joint] = []
    link_of_body: dict[int, int] = {}
    joint_of_model: dict[int, int] = {}
    warnings: list[str] = []
    efforts = _efforts(m)
    for body in bodies:
        parent = link_of_body.get(int(m.body_parentid[body]), -1) if body else -1
        T = Pose(m.body_pos[body], m.body_quat[body]).matrix
        moving = _revolute_joints(compiled, body, palm, warnings)
        name = compiled.body_name(body)
        for k, j in enumerate(moving):
            joints.append(_joint(compiled, j, efforts.get(j), velocities))
            joint_of_model[j] = len(joints) - 1
            last = k == len(moving) - 1
            link_name = name if last else f"{name}__{joints[-1].name}"
            mass = float(m.body_mass[body]) if last else 0.0
            frames.append(Frame(link_name, parent, len(joints) - 1, T, mass, body if last else -1))
            parent, T = len(frames) - 1, np.eye(4)
        if not moving:
            frames.append(Frame(name, parent, -1, T, float(m.body_mass[body]), body))
        link_of_body[body] = len(frames) - 1
    warnings += _doubtful_limits(compiled, joint_of_model, efforts)
    return Skeleton(tuple(frames), tuple(joints), link_of_body, joint_of_model, tuple(warnings))


def _revolute_joints(compiled: CompiledModel, body: int, palm: int, warnings: list[str]) -> list[int]:
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
            warnings.append(f"Joint '{compiled.joint_name(j)}' before the palm is {kind}; it is held at its reference.")
    return found


def _joint(compiled: CompiledModel, j: int, effort: float | None, velocities: Mapping[str, float]) -> Joint:
    m = compiled.model
    name = compiled.joint_name(j)
    lower, upper = (float(x) for x in m.jnt_range[j])
    reference = float(m.qpos0[m.jnt_qposadr[j]])
    if not m.jnt_limited[j]:
        lower, upper = -np.pi, np.pi
    if effort is not None and effort > _EFFORT_PLACEHOLDER:
        effort = None
    axis = np.array(m.jnt_axis[j])
    return Joint(
        name=name,
        axis=axis / np.linalg.norm(axis),
        anchor=np.array(m.jnt_pos[j]),
        lower=lower,
        upper=upper,
        reference=reference,
        velocity=velocities.get(name),
        effort=effort,
    )


def _doubtful_limits(compiled: CompiledModel, joints: Iterable[int], efforts: Mapping[int, float]) -> list[str]:
    """Return a sentence for each kind of limit that is missing or looks like a placeholder."""
    m = compiled.model
    free, wide, strong = [], [], []
    for j in joints:
        name = f"'{compiled.joint_name(j)}'"
        if not m.jnt_limited[j]:
            free.append(name)
        elif m.jnt_range[j, 1] - m.jnt_range[j, 0] > _FULL_TURN:
            wide.append(name)
        if efforts.get(j, 0.0) > _EFFORT_PLACEHOLDER:
            strong.append(name)
    found = (
        (free, "no limits in the model; -pi to pi is taken"),
        (wide, "may turn by more than a whole turn: the limits look like placeholders"),
        (strong, f"effort limits above {_EFFORT_PLACEHOLDER:.0f} Nm look like placeholders; taken as none"),
    )
    warnings = [f"Joints {', '.join(names)}: {text}." for names, text in found if names]
    ranges = [float(np.ptp(m.jnt_range[j])) for j in joints if m.jnt_limited[j]]
    if ranges and max(ranges) < _DEGREES_MISREAD:
        warnings.append(
            "No joint may turn by more than a few degrees: the limits look like radians read as degrees "
            '(in MJCF, <compiler angle="radian"/>).'
        )
    return warnings


def _efforts(model: Any) -> dict[int, float]:
    """Return effort limits [Nm] by MuJoCo joint: the smallest of what joint and actuator allow."""
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
    import mujoco

    if model.actuator_forcelimited[a]:
        return float(np.abs(model.actuator_forcerange[a]).max())
    motor = model.actuator_biastype[a] == mujoco.mjtBias.mjBIAS_NONE
    if motor and model.actuator_ctrllimited[a]:
        return float(np.abs(model.actuator_ctrlrange[a]).max() * abs(model.actuator_gainprm[a, 0]))
    return float("inf")


def fixed_tendon(model: Any, tendon: int) -> list[tuple[int, float]]:
    """Return the joints of a fixed tendon with their coefficients [m/rad]; empty for a spatial tendon."""
    import mujoco

    start = int(model.tendon_adr[tendon])
    wraps = range(start, start + int(model.tendon_num[tendon]))
    if any(model.wrap_type[w] != mujoco.mjtWrap.mjWRAP_JOINT for w in wraps):
        return []
    return [(int(model.wrap_objid[w]), float(model.wrap_prm[w])) for w in wraps]
