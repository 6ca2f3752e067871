"""A MuJoCo scene: the hand fixed in space at its palm, the actuators of its joints, and the object, fixed or free."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from clench.core.exceptions import HandError
from clench.core.pose import FloatArray, Pose, invert
from clench.core.rendering.opengl import import_mujoco
from clench.mechanics.grasp.loads import GRAVITY
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import Body, GraspObject
from clench.models.shapes import CollisionSource, Shape, ShapeKind

from .convex_pieces import convex_pieces, hull_of
from .hold import Hold, HoldTest
from .simulated_actuators import SERVO, Drive, Driven, Drives, driving_spec, find_drives

PREFIX = "hand/"
BASE = "hand base"
LIFT = "lift"
TABLE = "table"
TIMESTEP = 0.002
#: Bandwidth of the servos [rad/s]: fast beside the motion, slow beside the time step.
SERVO_BANDWIDTH = 100.0
#: Least inertia that a servo moves [kg m²], for links whose model gives next to none.
ARMATURE = 1e-3
#: Inertia of joints between the base and the palm [kg m²]: the palm keeps its pose when the fingers move.
HEAVY = 100.0
#: Nearer than that is touching [m]: the engine lists such pairs as contacts, forces begin at 0.
TOUCHING = 1e-5
#: Colour of the object in pictures: red, green, blue, and opacity.
COLOR = (0.93, 0.55, 0.2, 1.0)
_ALL_BITS = 0x7FFFFFFF


@dataclass(frozen=True, eq=False)
class Scene:
    """A compiled simulation of hand and object, with the addresses of their parts.

    Args:
        model: the compiled `mujoco.MjModel`.
        qpos: address of every joint of the hand, in the hand's order, shape (J,).
        link_bodies: body of every link, -1 when the simulation merged it into another, shape (L,).
        link_geoms: colliding geoms of every link.
        object_body: body of the object and its obstacles. object_geoms: its geoms.
        approximated: names of the bodies whose simulated shape is only near the object's.
        drives: targets of the hand's actuators.
        lift: address of the palm's way up, -1 without one.
    """

    model: Any
    qpos: FloatArray
    link_bodies: tuple[int, ...]
    link_geoms: tuple[tuple[int, ...], ...]
    object_body: int
    object_geoms: tuple[int, ...]
    approximated: tuple[str, ...]
    drives: Drives
    lift: int = -1


def build_scene(
    hand: Hand,
    obj: GraspObject,
    hand_pose: Pose,
    q: FloatArray,
    *,
    free: Hold | None = None,
    drive: Drive = Drive.SERVO,
    show_progress: bool = False,
) -> Scene:
    """Place a hand and an object in a scene without gravity, or for a lift on a table, with gravity on the object.

    With servos, the model's own actuators, tendons and equalities are left out. Every joint has a position servo of
    `SERVO_BANDWIDTH`, within its effort limit. Coupling holds because trajectories obey it. Joint friction, springs and
    damping are left out too: the servos are ideal, so differences come from contact alone. Joints before the palm
    always have such a servo: the palm keeps its pose.

    Args:
        hand: the hand.
        obj: the object, at its pose.
        hand_pose: `T_world_palm`.
        q: posture [rad], shape (J,), at which the palm is placed (matters when a wrist is upstream of it).
        free: mass and friction of an object that can move; None fixes it in place.
        drive: kind of actuators.
        show_progress: show a bar while convex pieces are computed.

    Raises:
        HandError: the hand cannot be simulated. ObjectError: the object has a flat body.
    """
    mujoco = import_mujoco()
    spec = mujoco.MjSpec()
    lifted = free is not None and free.test == HoldTest.LIFT
    spec.option.gravity = np.array([0.0, 0.0, -GRAVITY if lifted else 0.0])
    spec.option.timestep = TIMESTEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    _light(spec)
    driven = _add_hand(spec, hand, lifted, drive, hand.allowed_pairs_from(CollisionSource.ENGINE, q))
    if free is not None:
        # Without these, friction of the engine creeps: a held object slides out slowly.
        spec.option.impratio = 10.0
        spec.option.noslip_iterations = 2
    approximated = _add_object(spec, obj, free, show_progress)
    try:
        model = spec.compile()
    except ValueError as error:
        raise HandError(f"Hand '{hand.name}' and object '{obj.name}' cannot be simulated: {error}.") from None
    if free is not None:
        body = model.body("object").id
        share = free.mass / model.body_mass[body]
        model.body_mass[body] *= share
        model.body_inertia[body] *= share
    _tune(model, hand, driven)  # after the mass: it computes what follows from masses
    scene = _located(model, hand, approximated, driven)
    _place(scene, hand, hand_pose, q)
    return scene


def _light(spec: Any) -> None:
    """Make pictures bright, on a white ground."""
    import mujoco

    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.45] * 3, [0.55] * 3
    sky = {"type": mujoco.mjtTexture.mjTEXTURE_SKYBOX, "builtin": mujoco.mjtBuiltin.mjBUILTIN_FLAT}
    spec.add_texture(name="sky", width=16, height=96, rgb1=[1.0] * 3, rgb2=[1.0] * 3, **sky)


def _add_hand(spec: Any, hand: Hand, lifted: bool, drive: Drive, allowed: Iterable[tuple[int, int]]) -> Driven:
    import mujoco

    child, driven = driving_spec(hand, drive, _joints_before_palm(hand))
    for joint in list(child.joints):
        if joint.type == mujoco.mjtJoint.mjJNT_FREE:
            child.delete(joint)
    root = spec.worldbody
    if lifted:
        # Its mass is next to nothing beside the hand's; a body that moves must have one.
        root = spec.worldbody.add_body(name=LIFT, mass=1e-3, inertia=[1e-6] * 3, explicitinertial=True)
        root.add_joint(name=LIFT, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0.0, 0.0, 1.0])
    base = root.add_body(name=BASE)
    spec.attach(child, frame=base.add_frame(), prefix=PREFIX)
    bodies = {body.name for body in spec.bodies}
    for a, b in allowed:
        names = PREFIX + hand.links[a].name, PREFIX + hand.links[b].name
        if a != b and bodies.issuperset(names):
            spec.add_exclude(bodyname1=names[0], bodyname2=names[1])
    joints = {joint.name for joint in spec.joints}
    for joint in hand.joints:
        if PREFIX + joint.name not in joints:
            raise HandError(f"Joint '{joint.name}' of hand '{hand.name}' is missing in the model that is simulated.")
        if driven.by[joint.name] != Drive.SERVO:
            continue
        actuator = spec.add_actuator(
            name=SERVO + joint.name, target=PREFIX + joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT
        )
        actuator.set_to_position(kp=1.0, kv=0.0)
        if joint.effort:
            actuator.forcelimited = True
            actuator.forcerange = [-joint.effort, joint.effort]
    if lifted:
        for body in spec.bodies:
            body.gravcomp = 1.0
        lift = spec.add_actuator(name=LIFT, target=LIFT, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        lift.set_to_position(kp=1.0, kv=0.0)
    return driven


def _add_object(spec: Any, obj: GraspObject, free: Hold | None, show_progress: bool) -> tuple[str, ...]:
    """Add the object's bodies, as one; return the names of those whose shape is approximated."""
    base = spec.worldbody.add_body(name="object", pos=obj.pose.position, quat=obj.pose.wxyz)
    surface = _surface(free)
    if free is not None:
        base.add_freejoint()
        if free.test == HoldTest.LIFT:
            _add_table(spec, lowest(obj), surface)
    approximated = []
    for number, body in enumerate(obj.bodies):
        pieces = _pieces(body, obj.collision_source, show_progress)
        count = sum(len(vertices) for vertices in pieces.values())
        for i, (shape, hulls) in enumerate(pieces.items()):
            for k, vertices in enumerate(hulls):
                _add_hull(spec, base, f"object {number} {i} {k}", vertices, surface)
            if not hulls:
                _add_primitive(base, body.shapes[shape], f"object {number} {i}", surface)
        if count > sum(1 for hulls in pieces.values() if hulls):
            approximated.append(body.name)
    return tuple(approximated)


def _add_table(spec: Any, height: float, surface: dict[str, Any]) -> None:
    import mujoco

    own = {"pos": [0.0, 0.0, height], "size": [2.0, 2.0, 0.1], "rgba": [0.8, 0.82, 0.85, 1.0]}
    spec.worldbody.add_geom(name=TABLE, type=mujoco.mjtGeom.mjGEOM_PLANE, **(surface | own))


def lowest(obj: GraspObject) -> float:
    """Return the height of the lowest point of an object in the world [m]."""
    meshes = [shape.to_mesh(1e-5) for body in obj.bodies for shape in body.shapes]
    return min(float(obj.pose.apply(mesh.vertices)[:, 2].min()) for mesh in meshes)


def _pieces(body: Body, source: CollisionSource, show_progress: bool) -> dict[int, tuple[FloatArray, ...]]:
    """Return the convex hulls of every shape, by its index; none for shapes that the engine knows."""
    if body.pieces:
        return {0: tuple(piece.vertices for piece in body.pieces)}
    found: dict[int, tuple[FloatArray, ...]] = {}
    for i, shape in enumerate(body.shapes):
        if shape.kind is not ShapeKind.MESH:
            found[i] = ()
            continue
        mesh = shape.to_mesh()
        if source is CollisionSource.ENGINE:
            found[i] = (hull_of(mesh.vertices, body.name)[0],)
        else:
            found[i] = convex_pieces(mesh, body.name, show_progress=show_progress)
    return found


def _add_hull(spec: Any, base: Any, name: str, vertices: FloatArray, surface: dict[str, Any]) -> None:
    import mujoco

    spec.add_mesh(name=name, uservert=np.ascontiguousarray(vertices).ravel())
    base.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, **surface)


def _add_primitive(base: Any, shape: Shape, name: str, surface: dict[str, Any]) -> None:
    import mujoco

    kinds = {
        ShapeKind.SPHERE: mujoco.mjtGeom.mjGEOM_SPHERE,
        ShapeKind.CAPSULE: mujoco.mjtGeom.mjGEOM_CAPSULE,
        ShapeKind.CYLINDER: mujoco.mjtGeom.mjGEOM_CYLINDER,
        ShapeKind.BOX: mujoco.mjtGeom.mjGEOM_BOX,
        ShapeKind.ELLIPSOID: mujoco.mjtGeom.mjGEOM_ELLIPSOID,
    }
    place = {"pos": shape.pose.position, "quat": shape.pose.wxyz}
    base.add_geom(name=name, type=kinds[shape.kind], size=np.array(shape.size), **place, **surface)


def _surface(free: Hold | None) -> dict[str, Any]:
    """Return how the object's geoms touch: anything that touches at all, as stiffly as the time step allows."""
    found: dict[str, Any] = {
        "contype": _ALL_BITS,
        "conaffinity": _ALL_BITS,
        "priority": 1,
        "solref": [2 * TIMESTEP, 1.0],
    }
    found |= {"gap": TOUCHING, "rgba": COLOR}
    if free is not None:
        found |= {"condim": 4, "friction": [free.friction, free.torsion, 0.0]}
    return found


def _located(model: Any, hand: Hand, approximated: tuple[str, ...], driven: Driven) -> Scene:
    import mujoco

    def index(kind: Any, name: str) -> int:
        return int(mujoco.mj_name2id(model, kind, name))

    bodies = tuple(index(mujoco.mjtObj.mjOBJ_BODY, PREFIX + link.name) for link in hand.links)
    joints = [index(mujoco.mjtObj.mjOBJ_JOINT, PREFIX + joint.name) for joint in hand.joints]
    colliding = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    owner = model.geom_bodyid
    object_body = index(mujoco.mjtObj.mjOBJ_BODY, "object")
    lift = index(mujoco.mjtObj.mjOBJ_JOINT, LIFT)
    of_hand = np.array([a for a in range(model.nu) if model.actuator(a).name != LIFT], dtype=np.int64)
    return Scene(
        model=model,
        qpos=model.jnt_qposadr[joints],
        link_bodies=bodies,
        link_geoms=tuple(tuple(np.flatnonzero(colliding & (owner == b)).tolist()) if b >= 0 else () for b in bodies),
        object_body=object_body,
        object_geoms=tuple(np.flatnonzero(owner == object_body).tolist()),
        approximated=approximated,
        drives=find_drives(model, np.array(joints), of_hand, driven),
        lift=int(model.jnt_qposadr[lift]) if lift >= 0 else -1,
    )


def _tune(model: Any, hand: Hand, driven: Driven) -> None:
    """Give every servo the same bandwidth, critically damped; take passive forces away there; hold the palm still."""
    import mujoco

    joints = [model.joint(PREFIX + name).id for name in driven.servos]
    if not driven.by_model:
        joints = np.flatnonzero(model.jnt_bodyid != model.body("object").id).tolist()
    dofs = model.jnt_dofadr[joints]
    model.dof_armature[dofs] = np.maximum(model.dof_armature[dofs], ARMATURE)
    for i in _joints_before_palm(hand):
        name = hand.joint_names[i]
        model.dof_armature[model.joint(PREFIX + name).dofadr] = HEAVY
        model.actuator(SERVO + name).forcelimited = 0
    servos = [model.actuator(SERVO + name).id for name in driven.servos]
    if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, LIFT) >= 0:
        model.dof_armature[model.joint(LIFT).dofadr] = HEAVY
        servos.append(model.actuator(LIFT).id)
    model.dof_damping[dofs] = 0.0
    model.dof_frictionloss[dofs] = 0.0
    model.jnt_stiffness[joints] = 0.0
    data = mujoco.MjData(model)
    mujoco.mj_setConst(model, data)
    for i in servos:
        inertia = float(model.dof_M0[model.jnt_dofadr[model.actuator_trnid[i, 0]]])
        stiffness = SERVO_BANDWIDTH**2 * inertia
        model.actuator_gainprm[i, 0] = stiffness
        model.actuator_biasprm[i, :3] = 0.0, -stiffness, -2.0 * SERVO_BANDWIDTH * inertia


def _joints_before_palm(hand: Hand) -> tuple[int, ...]:
    """Return the joints of wrist and arm, which the palm moves with."""
    found, link = [], hand.palm
    while link >= 0:
        found.append(hand.links[link].joint)
        link = hand.links[link].parent
    return tuple(joint for joint in found if joint >= 0)


def _place(scene: Scene, hand: Hand, hand_pose: Pose, q: FloatArray) -> None:
    """Move the hand's base so that the palm is at its pose when the hand has the given posture."""
    import mujoco

    model = scene.model
    palm = scene.link_bodies[hand.palm]
    if palm < 0:
        raise HandError(f"Palm '{hand.links[hand.palm].name}' of hand '{hand.name}' is missing in the simulated model.")
    data = mujoco.MjData(model)
    data.qpos[scene.qpos] = q
    mujoco.mj_kinematics(model, data)
    T_base_palm = body_pose(data, palm)
    T_world_base = Pose.from_matrix(hand_pose.matrix @ invert(T_base_palm))
    base = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, BASE)
    model.body_pos[base] = T_world_base.position
    model.body_quat[base] = T_world_base.wxyz


def body_pose(data: Any, body: int) -> FloatArray:
    """Return the pose of a body in the world, shape (4, 4)."""
    T = np.eye(4)
    T[:3, :3] = data.xmat[body].reshape(3, 3)
    T[:3, 3] = data.xpos[body]
    return T
