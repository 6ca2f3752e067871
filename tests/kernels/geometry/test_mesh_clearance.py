"""Surfaces that lie apart have no point in common; depths are those of the meshes without that look."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from clench.kernels.geometry import mesh_clearance as apart
from clench.kernels.geometry.link_meshes import LinkMeshArrays, ObjectMesh, measure_depths
from clench.kernels.geometry.penetration import CROSSINGS, penetration
from clench.kernels.sections import plane_pose
from clench.kernels.trees.bvh import STACK_SIZE, build_tree, feature_owners
from kernels.kernel_entries import entry
from kernels.kernel_solids import ball, bounding_volumes, box, gap, star

surfaces_apart, compose_inverse = entry(apart.surfaces_apart), entry(plane_pose.compose_inverse)

SOLIDS = {
    "slab": box(1.0, 2.0, 0.3),
    "ball": ball(3, 0.7),
    "star": star(5, 0.6),
    "blade": box(1e-6, 1.0, 1.0),
    "room": box(9.0, 9.0, 9.0),
}
TREES = {name: build_tree(mesh.vertices, mesh.triangles) for name, mesh in SOLIDS.items()}
VOLUMES = {name: bounding_volumes(mesh) for name, mesh in SOLIDS.items()}

name, number = st.sampled_from(list(SOLIDS)), st.floats(-2.0, 2.0)
pose = st.builds(
    lambda turn, place: np.block(
        [[Rotation.from_rotvec(turn).as_matrix(), np.array(place)[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]]
    ),
    st.tuples(number, number, number),
    st.tuples(number, number, number),
)

#: One of a room's faces stays in its plane.
turned_about_x = np.eye(4)
turned_about_x[:3, :3] = Rotation.from_rotvec([-0.25, 0.0, 0.0]).as_matrix()
turned_about_x[2, 3] = 1.0


def are_apart(one, other, T):
    return surfaces_apart(TREES[one], TREES[other], np.ascontiguousarray(T[:3]), *scratch())


def scratch():
    return np.empty((apart.PAIRS, 2), dtype=np.int32), np.empty((6, 3))


@given(name, name, pose)
@settings(max_examples=300, deadline=None)
def test_what_lies_apart_does_not_touch(one, other, T):
    distance = gap(VOLUMES[one], T, VOLUMES[other], np.eye(4))
    if are_apart(one, other, T):
        assert distance > 0.0
    if distance > 1e-9:
        assert are_apart(one, other, T)


@pytest.mark.parametrize(("shift", "expected"), [(1.0 + 1e-9, True), (1.0 - 1e-9, False), (1.0, False)])
@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e6])
def test_boxes_side_by_side(shift, scale, expected):
    mesh = box(scale, scale, scale)
    tree, T = build_tree(mesh.vertices, mesh.triangles), np.eye(4)[:3]
    T[1, 3] = shift * scale
    assert surfaces_apart(tree, tree, T, *scratch()) == expected


def link_arrays(one, closed):
    tree, mesh = TREES[one], SOLIDS[one]
    counts = [np.array([0, n]) for n in (1, len(tree.vertices), len(tree.triangles), len(tree.low), len(tree.moments))]
    radius = np.linalg.norm(mesh.vertices, axis=1).max()
    return LinkMeshArrays(
        np.array([0]),
        np.array([int(closed)]),
        np.zeros((1, 3)),
        np.array([radius]),
        counts[0],
        mesh.vertices[:1],
        *counts[1:],
        tree,
        feature_owners(tree),
    )


@given(name, name, pose, st.booleans(), st.booleans())
@example("room", "room", turned_about_x, False, False)
@settings(max_examples=300, deadline=None)
def test_depths_are_those_of_the_meshes(one, other, T, link_closed, object_closed):
    link, obj = TREES[one], TREES[other]
    owners = feature_owners(obj)
    solid, out = ObjectMesh(obj, owners, object_closed, SOLIDS[other].vertices[:1]), np.empty((1, 4))
    meshes = link_arrays(one, link_closed)
    measure_depths(meshes, np.ones(1, dtype=np.int64), np.array([T[:3]]), solid, np.eye(4)[:3], out)
    # The same bits: which edges cross a face that they lie in is a matter of rounding, and depth is looked for there.
    forth, back = np.empty((2, 3, 4))
    compose_inverse(np.eye(4)[:3], T[:3], forth)
    compose_inverse(T[:3], np.eye(4)[:3], back)
    scratch = np.empty(CROSSINGS), np.empty(STACK_SIZE, dtype=np.int32)
    sides = link, feature_owners(link), link_closed, obj, owners, object_closed
    depth, *_ = penetration(*sides, forth, back, np.inf, scratch)
    assert out[0, 0] == pytest.approx(min(depth, 2.0 * meshes.radius[0]), abs=1e-12)
    if one == other == "room":
        return
    lies_in = "room" in (one, other) and np.abs(T[:3, 3]).max() < 1.0
    assert depth > 0.0 or not lies_in
