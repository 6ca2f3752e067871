"""Images of hands and objects under scaling and in a mirror, written out field by field."""

from dataclasses import replace

import numpy as np

from clench.core.pose import FloatArray, Pose
from clench.models.hand.hand import Hand
from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import Shape, ShapeKind

FLIP = np.diag([1.0, -1.0, 1.0])


def mirrored_pose(pose: Pose) -> Pose:
    """Return a pose seen in the plane y = 0 of both of its frames."""
    w, x, y, z = pose.wxyz
    return Pose(FLIP @ pose.position, wxyz=[w, -x, y, -z])


def mirrored_hand(hand: Hand) -> Hand:
    """Return a hand seen in the plane y = 0 of every frame; angles keep their sign."""
    links = tuple(
        replace(
            link,
            T_parent_link=_flipped(link.T_parent_link),
            shapes={source: tuple(map(mirrored_shape, shapes)) for source, shapes in link.shapes.items()},
        )
        for link in hand.links
    )
    joints = tuple(replace(j, axis=-(FLIP @ j.axis), anchor=FLIP @ j.anchor) for j in hand.joints)
    return replace(
        hand, links=links, joints=joints, palm_center=FLIP @ hand.palm_center, palm_normal=FLIP @ hand.palm_normal
    )


def mirrored_shape(shape: Shape) -> Shape:
    """Return a shape seen in the plane y = 0 of its link; a mesh is turned right side out."""
    mesh = shape.mesh
    if mesh is not None:
        mesh = TriangleMesh(mesh.vertices @ FLIP, mesh.triangles[:, ::-1])
    return replace(shape, pose=mirrored_pose(shape.pose), mesh=mesh)


def mirrored_object(obj: GraspObject) -> GraspObject:
    """Return an object and its place seen in the plane y = 0."""
    bodies = tuple(replace(b, shapes=tuple(map(mirrored_shape, b.shapes)), pieces=()) for b in obj.bodies)
    return replace(obj, bodies=bodies, pose=mirrored_pose(obj.pose))


def scaled_pose(pose: Pose, factor: float) -> Pose:
    """Return a pose with its lengths multiplied."""
    return Pose(pose.position * factor, wxyz=pose.wxyz)


def scaled_hand(hand: Hand, factor: float) -> Hand:
    """Return a hand with every length multiplied."""
    links = tuple(
        replace(
            link,
            T_parent_link=_grown(link.T_parent_link, factor),
            shapes={s: tuple(scaled_shape(p, factor) for p in shapes) for s, shapes in link.shapes.items()},
        )
        for link in hand.links
    )
    joints = tuple(replace(j, anchor=j.anchor * factor) for j in hand.joints)
    return replace(hand, links=links, joints=joints, palm_center=hand.palm_center * factor)


def scaled_shape(shape: Shape, factor: float) -> Shape:
    """Return a shape with every length multiplied."""
    a, b, c = (factor * s for s in shape.size)
    mesh = None if shape.kind is not ShapeKind.MESH or shape.mesh is None else shape.mesh
    if mesh is not None:
        mesh = TriangleMesh(mesh.vertices * factor, mesh.triangles)
    return replace(shape, size=(a, b, c), pose=scaled_pose(shape.pose, factor), mesh=mesh)


def scaled_object(obj: GraspObject, factor: float) -> GraspObject:
    """Return an object with every length multiplied."""
    bodies = tuple(replace(b, shapes=tuple(scaled_shape(s, factor) for s in b.shapes), pieces=()) for b in obj.bodies)
    return replace(obj, bodies=bodies, pose=scaled_pose(obj.pose, factor))


def _flipped(T: FloatArray) -> FloatArray:
    image = T.copy()
    image[:3, :3] = FLIP @ T[:3, :3] @ FLIP
    image[:3, 3] = FLIP @ T[:3, 3]
    return image


def _grown(T: FloatArray, factor: float) -> FloatArray:
    image = T.copy()
    image[:3, 3] *= factor
    return image
