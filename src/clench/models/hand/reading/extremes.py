"""Refuse numbers in a hand model that are no hand's, by the name of the joint or link that has them."""

from __future__ import annotations

import math

import numpy as np

from clench.core.exceptions import HandError
from clench.core.files.file_limits import MODEL_BODIES
from clench.core.tolerances import LARGEST_LENGTH

from .compiled import CompiledModel

#: Largest angle of a joint, for limits that are placeholders [rad].
LARGEST_ANGLE = 1e6
_UNIT = 1e-6


def refuse_extremes(compiled: CompiledModel) -> None:
    """Check that lengths and angles of a model are finite and of a size that can be computed with.

    Raises:
        HandError: with the joint or link.
    """
    m = compiled.model
    if m.nbody > MODEL_BODIES:
        raise HandError(f"{compiled.label}: has {m.nbody} bodies; expected a hand, or a robot of up to {MODEL_BODIES}.")
    for j in range(m.njnt):
        angles = (*m.jnt_range[j], m.qpos0[m.jnt_qposadr[j]])
        if not np.abs(angles).max() <= LARGEST_ANGLE:
            name = compiled.joint_name(j)
            raise HandError(
                f"{compiled.label}: joint '{name}' has limits {angles[0]:.6g} to {angles[1]:.6g} rad; "
                f"expected angles up to {LARGEST_ANGLE:g} rad."
            )
        # MuJoCo makes axes unit, but for numbers that overflow on the way.
        if not abs(math.hypot(*m.jnt_axis[j]) - 1.0) < _UNIT:
            raise HandError(f"{compiled.label}: joint '{compiled.joint_name(j)}' has an axis that has no direction.")
        _check(compiled, int(m.jnt_bodyid[j]), m.jnt_pos[j], "a joint")
    for body in range(m.nbody):
        _check(compiled, body, m.body_pos[body], "its place")
        if not math.isfinite(m.body_mass[body]):
            raise HandError(f"{compiled.label}: the mass of link '{compiled.body_name(body)}' is not finite.")
    for geom in range(m.ngeom):
        mesh = int(m.geom_dataid[geom]) if m.geom_type[geom] == _mesh_type() else -1
        first = int(m.mesh_vertadr[mesh]) if mesh >= 0 else 0
        points = m.mesh_vert[first : first + int(m.mesh_vertnum[mesh])] if mesh >= 0 else m.geom_size[geom]
        _check(compiled, int(m.geom_bodyid[geom]), np.append(m.geom_pos[geom], points), "a shape")


def _mesh_type() -> int:
    import mujoco

    return int(mujoco.mjtGeom.mjGEOM_MESH)


def _check(compiled: CompiledModel, body: int, lengths: np.ndarray, what: str) -> None:
    if not np.abs(lengths).max(initial=0.0) <= LARGEST_LENGTH:
        raise HandError(
            f"{compiled.label}: {what} of link '{compiled.body_name(body)}' has lengths that are not finite, "
            f"or above {LARGEST_LENGTH:g} m."
        )
