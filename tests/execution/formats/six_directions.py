"""DexGraspBench's six-direction test, written from its published facts: its own reader, scene and motion.

Nothing of clench is used: the hand is the maker's file as it is, the postures are told in the order of that file's
joints, and the pose is that of the frame of the file.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

KEYS = ("obj_pose", "obj_scale", "obj_path", "pregrasp_qpos", "grasp_qpos", "squeeze_qpos")
DIRECTIONS = np.vstack([np.eye(3), -np.eye(3)])


@dataclass(frozen=True)
class Settings:
    """Say what is tested: mass [kg], friction, and the gain of all servos [Nm/rad] (None: those of the hand's file)."""

    mass: float = 0.1
    friction: float = 0.6
    kp: float | None = None


def read_grasp(path: Path) -> dict[str, Any]:
    """Read a file as that program does: one pickled dictionary whose rows are a pose (position, wxyz) and joints."""
    grasp = np.load(path, allow_pickle=True).item()
    missing = [key for key in KEYS if key not in grasp]
    if missing:
        raise KeyError(missing[0])
    if not isinstance(grasp["obj_path"], str) or not isinstance(grasp["obj_scale"], float):
        raise TypeError("obj_path is a folder's name, obj_scale a number")
    return grasp


def holds(grasp: dict[str, Any], hand_file: Path, geoms: list[dict[str, Any]], settings: Settings) -> bool:
    """Return whether the object stays within 5 cm and 15 degrees of its place against 10 N/kg from six directions."""
    model = _model(hand_file, geoms, settings)
    return all(_held(model, grasp, direction, settings) for direction in DIRECTIONS)


def _model(hand_file: Path, geoms: list[dict[str, Any]], settings: Settings) -> Any:
    import mujoco

    spec = mujoco.MjSpec()
    spec.option.timestep = 0.004
    spec.option.gravity = [0.0, 0.0, 0.0]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0
    spec.option.noslip_iterations = 2
    spec.worldbody.add_body(name="mocap", mocap=True)
    base = spec.worldbody.add_body(name="base")
    base.add_freejoint()
    hand = mujoco.MjSpec.from_file(str(hand_file))
    for actuator in hand.actuators if settings.kp is not None else ():
        actuator.set_to_position(kp=settings.kp)
        actuator.forcerange = [-3.0, 3.0]
    for geom in hand.geoms:
        geom.solimp[:3], geom.solref = [0.5, 0.99, 0.0001], [0.005, 1.0]
    spec.attach(hand, frame=base.add_frame(), prefix="hand-")
    weld = spec.add_equality(type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_BODY, name1="mocap", name2="base")
    weld.data[10] = 1.0  # torques count like forces
    body = spec.worldbody.add_body(name="object")
    body.add_freejoint()
    for geom in geoms:
        body.add_geom(**geom)
    for geom in spec.geoms:
        geom.condim, geom.friction = 4, [settings.friction, 0.02, 0.0001]
    model = spec.compile()
    number = model.body("object").id
    share = settings.mass / model.body_mass[number]
    model.body_mass[number] *= share
    model.body_inertia[number] *= share
    return model


def _held(model: Any, grasp: dict[str, Any], direction: np.ndarray, settings: Settings) -> bool:
    import mujoco

    data = mujoco.MjData(model)
    rows = [np.asarray(grasp[key], dtype=float) for key in ("pregrasp_qpos", "grasp_qpos", "squeeze_qpos")]
    data.qpos[:] = [*rows[0], *grasp["obj_pose"]]
    mujoco.mj_forward(model, data)
    if data.ncon and data.contact.dist.min() < -0.01:
        return False
    moments = np.zeros((model.nu, model.nv))
    mujoco.mju_sparse2dense(moments, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind)
    told = [moments[:, 6:-6] @ row[7:] for row in rows]
    number = model.body("object").id
    before = data.xipos[number].copy(), data.xquat[number].copy()
    for k in (0, 1):
        for share in np.linspace(0.1, 1.0, 10):
            data.mocap_pos[0] = (1 - share) * rows[k][:3] + share * rows[k + 1][:3]
            data.mocap_quat[0] = rows[k + 1][3:7]
            data.ctrl[:] = (1 - share) * told[k] + share * told[k + 1]
            mujoco.mj_step(model, data, 10)
    data.xfrc_applied[number, :3] = 10.0 * settings.mass * direction
    for _ in range(10):
        mujoco.mj_step(model, data, 50)
        mujoco.mj_forward(model, data)
        turned = 2.0 * np.arccos(min(1.0, abs(float(data.xquat[number] @ before[1]))))
        if np.linalg.norm(data.xipos[number] - before[0]) >= 0.05 or turned >= np.deg2rad(15.0):
            return False
    return True
