"""Compile a model text with MuJoCo, remove all bodies outside the hand, and refuse closed loops."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from clench.core.exceptions import FileError, HandError
from clench.core.rendering.opengl import import_mujoco

from .model_files import ModelText


@dataclass(frozen=True)
class StatedJoints:
    """Statements of a model about its joints that MuJoCo corrects or ignores silently, by joint name.

    Args:
        reversed: limits whose lower one is above the upper one [rad]; they are swapped before compiling.
        still: the one angle of joints whose limits are equal [rad]. axis_lengths: of the axes as written [-].
    """

    reversed: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    still: Mapping[str, float] = field(default_factory=dict)
    axis_lengths: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class CompiledModel:
    """A hand that MuJoCo has compiled: its spec, its model, and the text that they come from.

    Args:
        spec: `mujoco.MjSpec`. model: `mujoco.MjModel`.
        xml: text that compiles to the same model with the assets of the model text.
        label: how to name the model in messages. stated: see `StatedJoints`.
    """

    spec: Any
    model: Any
    xml: str
    label: str
    stated: StatedJoints = StatedJoints()

    def body_name(self, body: int) -> str:
        """Return a body's name, or one made from its number."""
        return str(self.model.body(body).name) or f"body{body}"

    def joint_name(self, joint: int) -> str:
        """Return a joint's name, or one made from its body's."""
        m = self.model
        body = int(m.jnt_bodyid[joint])
        number = joint - int(m.body_jntadr[body])
        made = f"{self.body_name(body)}_joint{number if number else ''}"
        return str(m.joint(joint).name) or made


def compile_model(text: ModelText) -> CompiledModel:
    """Compile a model.

    Raises:
        FileError: MuJoCo refuses it; its reason is passed on.
    """
    mujoco = import_mujoco()
    try:
        spec = mujoco.MjSpec.from_string(text.xml, assets=dict(text.assets))
    except (ValueError, RuntimeError) as error:  # it raises RuntimeError where memory is short
        raise FileError(text.label, f"MuJoCo cannot read it: {_first_lines(error)}") from None
    stated = _stated(spec, text)
    if stated.reversed:
        return _recompiled(spec, text.label, stated)
    try:
        return CompiledModel(spec, spec.compile(), text.xml, text.label, stated)
    except (ValueError, RuntimeError) as error:
        if "volume" not in str(error) and "mjMINVAL" not in str(error):
            raise FileError(text.label, f"MuJoCo cannot compile it: {_first_lines(error)}") from None
    # Flat or open meshes have no volume to take a mass from: their surface does as well. A body without a mass is given
    # some.
    spec.compiler.boundmass, spec.compiler.boundinertia = 1e-6, 1e-12
    for mesh in spec.meshes:
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    return _recompiled(spec, text.label, stated)


def keep_bodies(compiled: CompiledModel, kept: set[int]) -> CompiledModel:
    """Return the model without the other bodies; their subtrees go with them."""
    m = compiled.model
    gone = [
        b for b in range(1, m.nbody) if b not in kept and (int(m.body_parentid[b]) in kept or m.body_parentid[b] == 0)
    ]
    if not gone:
        return compiled
    spec = compiled.spec
    bodies = list(spec.bodies)
    removed = {bodies[b].name for b in range(1, m.nbody) if b not in kept}
    # MuJoCo also removes elements that are tied to a removed body, but not elements that look at it.
    for looking in [*spec.lights, *spec.cameras]:
        if looking.targetbody in removed:
            spec.delete(looking)
    for body in gone:
        spec.delete(bodies[body])
    for key in list(spec.keys):
        spec.delete(key)
    return _recompiled(spec, compiled.label, compiled.stated)


def collide_visuals(compiled: CompiledModel, bodies: set[int]) -> CompiledModel:
    """Return the model in which the drawn geometry of some bodies collides."""
    if not bodies:
        return compiled
    for body in bodies:
        for geom in list(compiled.spec.bodies)[body].geoms:
            geom.contype = 1
            geom.conaffinity = 1
    return _recompiled(compiled.spec, compiled.label, compiled.stated)


def refuse_loops(compiled: CompiledModel, palm: int | None) -> None:
    """Refuse closed kinematic loops.

    Args:
        compiled: the model.
        palm: body of the palm; only loops that hold something below it matter. None: any loop matters.

    Raises:
        HandError: a `connect` or `weld` ties two bodies of the hand.
    """
    import mujoco

    m = compiled.model
    connect, weld = int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)
    for e in range(m.neq):
        if int(m.eq_type[e]) not in (connect, weld) or not m.eq_active0[e]:
            continue
        ends = [_body_of(m, int(m.eq_objtype[e]), int(i)) for i in (m.eq_obj1id[e], m.eq_obj2id[e])]
        if palm is None:
            closes = min(ends) > 0 and m.body_rootid[ends[0]] == m.body_rootid[ends[1]]
        else:
            closes = any(_moves_below(m, body, palm) for body in ends)
        if closes:
            kind = "connect" if int(m.eq_type[e]) == connect else "weld"
            first, second = (compiled.body_name(b) for b in ends)
            raise HandError(
                f"{compiled.label}: bodies '{first}' and '{second}' close a kinematic loop (<{kind}>); "
                "clench closes fingers that are serial chains of revolute joints. "
                "Model the linkage as coupled joints instead (joint equality or URDF mimic)."
            )


def _body_of(model: Any, kind: int, index: int) -> int:
    import mujoco

    if kind == mujoco.mjtObj.mjOBJ_SITE:
        return int(model.site_bodyid[index])
    return index


def _moves_below(model: Any, body: int, palm: int) -> bool:
    """Return whether some joint below the palm moves a body."""
    moved = False
    while body > 0 and body != palm:
        moved = moved or model.body_jntnum[body] > 0
        body = int(model.body_parentid[body])
    return moved and body == palm


def _stated(spec: Any, text: ModelText) -> StatedJoints:
    """Read the stated limits and axes of the joints before MuJoCo compiles them; swap reversed limits."""
    import mujoco

    reversed_limits: dict[str, tuple[float, float]] = {}
    still, lengths = dict(text.still), {}
    for joint in spec.joints:
        if joint.type != mujoco.mjtJoint.mjJNT_HINGE:
            continue
        unit = np.deg2rad(1.0) if spec.compiler.degree else 1.0
        low, high = (float(x) for x in joint.range)
        lengths[joint.name] = math.hypot(*joint.axis)
        if low > high:
            reversed_limits[joint.name] = (low * unit, high * unit)
            joint.range = (high, low)
            joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        elif low == high != 0.0:
            still[joint.name] = low * unit
    return StatedJoints(reversed_limits, still, lengths)


def _recompiled(spec: Any, label: str, stated: StatedJoints) -> CompiledModel:
    try:
        model = spec.compile()
        return CompiledModel(spec, model, spec.to_xml(), label, stated)
    except (ValueError, RuntimeError) as error:
        raise FileError(label, f"MuJoCo cannot compile it: {_first_lines(error)}") from None


def _first_lines(error: Exception) -> str:
    return " ".join(str(error).split())[:300]
