"""Mirror a hand: a left hand from the model of a right one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from clench.core.exceptions import HandError
from clench.core.pose import FloatArray, Pose
from clench.core.rendering.opengl import import_mujoco
from clench.models.mesh import TriangleMesh
from clench.models.shapes import Shape

from .hand import Hand, Joint, Link

SUFFIX: Final = "_mirrored"
#: Signs of the components of a place or a direction, and of the axis of a turn, under y -> -y.
_POLAR: Final = np.array([1.0, -1.0, 1.0])
_AXIAL: Final = -_POLAR
#: Signs of a quaternion `wxyz`, whose last three components are along the axis of a turn.
_QUATERNION: Final = np.array([1.0, *_AXIAL])
#: Signs of the six numbers of a symmetric tensor: xx, yy, zz, xy, xz, yz.
_TENSOR: Final = np.array([1.0, 1.0, 1.0, -1.0, 1.0, -1.0])


def mirrored_hand(hand: Hand) -> Hand:
    """Return the mirror image of a hand; see `Hand.mirrored`."""
    return replace(
        hand,
        name=f"{hand.name}{SUFFIX}",
        path=None,
        links=tuple(map(_link, hand.links)),
        joints=tuple(map(_joint, hand.joints)),
        palm_center=_POLAR * hand.palm_center,
        palm_normal=_POLAR * hand.palm_normal,
        spec_xml=_model_text(hand) if hand.spec_xml else "",
    )


def mirrored_pose(pose: Pose) -> Pose:
    """Return the pose of a mirrored frame in a mirrored frame."""
    return Pose(_POLAR * pose.position, _QUATERNION * pose.wxyz)


def mirrored_mesh(mesh: TriangleMesh) -> TriangleMesh:
    """Return the mirror image of a mesh, whose triangles still turn counter-clockwise seen from outside."""
    return TriangleMesh(_POLAR * mesh.vertices, mesh.triangles[:, ::-1])


def _link(link: Link) -> Link:
    shapes = {source: tuple(map(_shape, each)) for source, each in link.shapes.items()}
    signs = np.diag([*_POLAR, 1.0])
    return replace(link, T_parent_link=signs @ link.T_parent_link @ signs, shapes=shapes)


def _shape(shape: Shape) -> Shape:
    # Primitives are their own mirror images in their own frames.
    mesh = None if shape.mesh is None else mirrored_mesh(shape.mesh)
    return replace(shape, pose=mirrored_pose(shape.pose), mesh=mesh)


def _joint(joint: Joint) -> Joint:
    """Return the joint of a mirrored hand, which turns by the same angle about the mirrored axis the other way."""
    return replace(joint, axis=_AXIAL * joint.axis, anchor=_POLAR * joint.anchor)


def _model_text(hand: Hand) -> str:
    """Return the mirrored model for simulation, with the six digits that MuJoCo writes.

    Raises:
        HandError: MuJoCo cannot mirror it.
    """
    mujoco = import_mujoco()
    assets: Mapping[str, bytes] = dict(hand.assets)
    try:
        # MuJoCo writes positions and quaternions only, for every notation of the model.
        spec = mujoco.MjSpec.from_string(hand.spec_xml, assets=assets)
        spec.compile()
        spec = mujoco.MjSpec.from_string(spec.to_xml(), assets=assets)
        _mirror(spec, mujoco)
        spec.compile()
        return str(spec.to_xml())
    except (ValueError, RuntimeError) as error:
        why = " ".join(str(error).split())[:300]
        raise HandError(f"Hand '{hand.name}': MuJoCo cannot compile the mirror image of its model: {why}") from None


def _mirror(spec: Any, mujoco: Any) -> None:
    for key in list(spec.keys):
        spec.delete(key)
    for placed in (*spec.bodies[1:], *spec.geoms, *spec.sites, *spec.cameras, *spec.frames):
        _place(placed, "pos", "quat")
    for body in spec.bodies[1:]:
        _place(body, "ipos", "iquat")
        body.fullinertia = _TENSOR * np.asarray(body.fullinertia)
    for joint in spec.joints:
        joint.pos = _POLAR * np.asarray(joint.pos)
        slides = joint.type == mujoco.mjtJoint.mjJNT_SLIDE
        joint.axis = (_POLAR if slides else _AXIAL) * np.asarray(joint.axis)
    for light in spec.lights:
        light.pos, light.dir = _POLAR * np.asarray(light.pos), _POLAR * np.asarray(light.dir)
    for mesh in spec.meshes:
        mesh.scale = _POLAR * np.asarray(mesh.scale)
        _place(mesh, "refpos", "refquat")
    for actuator in spec.actuators:
        if actuator.trntype == mujoco.mjtTrn.mjTRN_SITE:
            actuator.gear = np.concatenate([_POLAR, _AXIAL]) * np.asarray(actuator.gear)
    for equality in spec.equalities:
        if equality.type == mujoco.mjtEq.mjEQ_CONNECT:
            equality.data[:3] = _POLAR * equality.data[:3]
        elif equality.type == mujoco.mjtEq.mjEQ_WELD:
            equality.data[:10] = np.concatenate([_POLAR, _POLAR, _QUATERNION]) * equality.data[:10]


def _place(element: Any, position: str, quaternion: str) -> None:
    """Mirror a place and an orientation of an element of a specification."""

    def signed(name: str, signs: FloatArray) -> FloatArray:
        return np.asarray(getattr(element, name), dtype=np.float64) * signs

    setattr(element, position, signed(position, _POLAR))
    setattr(element, quaternion, signed(quaternion, _QUATERNION))
