"""Boxes around links: what they keep apart does not touch, and what touches they do not keep apart."""

import numpy as np
import pytest

from chain_hands import HandBuilder, along_x, mount
from clench.closing.link_bodies import HandBodies, hand_bodies
from clench.core.pose import Pose
from clench.kernels.geometry.bodies import pack_bodies
from clench.kernels.geometry.link_boxes import mark_meeting
from clench.kernels.geometry.smallest_gap import link_gap
from clench.models.shapes import CollisionSource, Shape, ShapeKind


def bodies_of(*shapes: Shape) -> HandBodies:
    builder = HandBuilder()
    for i, shape in enumerate(shapes):
        builder.finger(f"f{i}", [shape], [0.05], base=mount())
    return hand_bodies(builder.hand(), CollisionSource.ENGINE)


def placed(*poses: Pose) -> np.ndarray:
    return np.ascontiguousarray([np.eye(4)[:3], *(p.matrix[:3] for p in poses)])


def boxes_meet(bodies: HandBodies, poses: np.ndarray) -> np.ndarray:
    meet = np.full((len(poses),) * 2, -1, dtype=np.int64)
    mark_meeting(bodies.links.box, poses, meet)
    return meet


def gap(bodies: HandBodies, poses: np.ndarray) -> float:
    return float(link_gap(bodies.links, 1, 2, poses, 1e9, 1.0, np.empty(6)))


@pytest.mark.parametrize("seed", range(4))
def test_what_boxes_keep_apart_is_apart(seed):
    rng = np.random.default_rng(seed)
    box = Shape(ShapeKind.BOX, tuple(rng.uniform(0.002, 0.03, 3)), Pose(rng.normal(scale=0.01, size=3)))
    bodies = bodies_of(along_x(0.006, 0.05), box)
    said = {True: 0, False: 0}
    for _ in range(300):
        quaternions = rng.normal(size=(2, 4))
        quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
        away = rng.normal(scale=0.03, size=3)
        poses = placed(Pose(np.zeros(3), wxyz=quaternions[0]), Pose(away, wxyz=quaternions[1]))
        near = bool(boxes_meet(bodies, poses)[1, 2])
        assert near or gap(bodies, poses) > 0.0
        said[near] += 1
    assert min(said.values()) > 30


def test_boxes_that_touch_meet_and_those_a_little_apart_do_not():
    bodies = bodies_of(*[Shape(ShapeKind.BOX, (0.01, 0.02, 0.03))] * 2)
    for away, meet in ((0.02, 1), (0.02 + 1e-10, 1), (0.02 + 1e-6, 0)):
        found = boxes_meet(bodies, placed(Pose.identity(), Pose([away, 0.0, 0.0])))
        assert found[1, 2] == found[2, 1] == meet


def test_links_without_shapes_meet_nothing():
    bodies = bodies_of(*[Shape(ShapeKind.BOX, (0.01, 0.02, 0.03))] * 2)
    assert bodies.links.root[0] == -1
    found = boxes_meet(bodies, placed(Pose.identity(), Pose.identity()))
    assert not found[0].any()
    assert not found[:, 0].any()
    empty = HandBodies(pack_bodies([]), np.zeros((0, 0)), np.zeros((0, 0)))
    assert boxes_meet(empty, np.zeros((0, 3, 4))).shape == (0, 0)
