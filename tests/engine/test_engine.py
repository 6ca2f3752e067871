"""Contacts of real hands judged by python-fcl; `statistics.py` beside this file prints the full statistics."""

import numpy as np
import pytest

import clench
from clench.closing.collision.depths import hand_depths
from clench.closing.collision.packed_object import pack_object
from clench.core.pose import Pose
from clench.models.shapes import Shape, ShapeKind
from engine.collisions import Collisions
from engine.statistics import HANDS, OBJECTS, Judge
from engine.surfaces import ShapeSurface, brute_distance, distance_to_tree, volume_tree

ONE_MICROMETRE = 1e-6


def test_the_engine_measures_points_exactly():
    """Points on, near and far from a mesh: the engine and a look at every triangle agree to rounding."""
    import trimesh

    mesh = trimesh.creation.torus(0.03, 0.01, major_sections=24, minor_sections=12)
    tree = volume_tree(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    rng = np.random.default_rng(0)
    on, _ = trimesh.sample.sample_surface(mesh, 15, seed=0)
    points = [*on, *(on + 1e-6), *rng.normal(scale=0.03, size=(15, 3)), *mesh.vertices[:5]]
    for point in points:
        expected = brute_distance(np.asarray(mesh.vertices), np.asarray(mesh.faces), point)
        assert distance_to_tree(tree, point) == pytest.approx(expected, abs=1e-12)
    assert max(distance_to_tree(tree, p) for p in on) < 1e-12


@pytest.mark.parametrize("kind", [ShapeKind.SPHERE, ShapeKind.CAPSULE, ShapeKind.CYLINDER, ShapeKind.BOX])
def test_distances_to_primitives(kind):
    """Against a fine mesh of the shape, up to its deviation."""
    shape = Shape(kind, (0.01, 0.02, 0.015), Pose([0.01, 0.0, 0.02], wxyz=[0.6, 0.0, 0.8, 0.0]))
    mesh = shape.to_mesh(1e-5)
    surface = ShapeSurface(shape)
    for point in np.random.default_rng(1).normal(scale=0.03, size=(30, 3)):
        expected = brute_distance(mesh.vertices, mesh.triangles, point)
        assert surface.distance(point) == pytest.approx(expected, abs=1.1e-5)


@pytest.mark.shared
@pytest.mark.parametrize("model", HANDS.values(), ids=HANDS)
def test_contact_points_lie_on_object_and_link(shared_data, model):
    hand = clench.Hand.load(shared_data / model)
    seen = 0
    for name in ("mug", "scissors", "torus"):
        obj = clench.GraspObject.load(shared_data / OBJECTS[name])
        judge = Judge(hand, obj)
        for pose in clench.approach_poses(hand, obj, 2, seed=5):
            for check in judge.contacts(clench.solve(hand, obj, clench.GraspCommand(hand_pose=pose, preshape="open"))):
                assert check.to_object <= ONE_MICROMETRE, check
                assert check.to_link <= ONE_MICROMETRE, check
                seen += 1
    assert seen > 15


@pytest.mark.shared
@pytest.mark.parametrize(
    ("names", "poses", "least"), [(("mug",), 1, 1), pytest.param(("mug", "torus"), 2, 4, marks=pytest.mark.long)]
)
@pytest.mark.parametrize("model", HANDS.values(), ids=HANDS)
def test_a_certified_grasp_overlaps_nothing_and_stops_at_what_it_touches(shared_data, model, names, poses, least):
    """Along the path, the last 1e-5 rad of each joint left out, and at its end; a little further they collide."""
    hand, seen = clench.Hand.load(shared_data / model), 0
    for name in names:
        obj = clench.GraspObject.load(shared_data / OBJECTS[name])
        collisions = Collisions(hand, obj)
        for pose in clench.approach_poses(hand, obj, poses, seed=1):
            solution = clench.solve(hand, obj, clench.GraspCommand(hand_pose=pose, preshape="open"))
            if solution.certified:
                seen += collisions.check(solution)
    assert seen >= least


@pytest.mark.shared
@pytest.mark.parametrize(
    "model",
    [pytest.param(m, id=n, marks=() if n in ("LEAP", "Barrett") else pytest.mark.long) for n, m in HANDS.items()],
)
def test_a_certified_grasp_of_fingers_that_move_at_once_overlaps_nothing(shared_data, model):
    """Fingers whose closing joints are not parallel (LEAP) among them; links of the hand count as well."""
    hand = clench.Hand.load(shared_data / model)
    obj = clench.GraspObject.load(shared_data / OBJECTS["mug"])
    collisions, seen = Collisions(hand, obj), 0
    for pose in clench.approach_poses(hand, obj, 2, seed=1):
        command = clench.GraspCommand(hand_pose=pose, order=clench.ClosingOrder.TOGETHER, preshape="open")
        solution = clench.solve(hand, obj, command)
        if solution.certified:
            counted, wrong = collisions.wrong_at_once(solution)
            assert not wrong, wrong
            seen += counted["contacts"]
    assert seen >= 1


@pytest.mark.shared
@pytest.mark.parametrize("model", ["Barrett", "D'Claw"])
def test_nothing_is_left_between_the_planes(shared_data, model):
    """On a single plane each, fingers overlap the glass; the full width does not, with as few planes."""
    hand = clench.Hand.load(shared_data / HANDS[model])
    obj = clench.GraspObject.load(shared_data / OBJECTS["wineglass"])
    plane, full = [], []
    for pose in clench.approach_poses(hand, obj, 4, seed=0):
        for full_width, depths in ((False, plane), (True, full)):
            command = clench.GraspCommand(hand_pose=pose, planes=3, full_width=full_width, preshape="open")
            solution = clench.solve(hand, obj, command)
            q = np.array([solution.joint_angles[name] for name in hand.joint_names])
            T_palm_object = np.linalg.inv(solution.hand_pose.matrix) @ solution.object_pose.matrix
            depths.append(max((d.depth for d in hand_depths(hand, q, pack_object(obj), T_palm_object)), default=0.0))
    assert max(plane) > 2e-5
    assert max(full) <= ONE_MICROMETRE


@pytest.mark.shared
def test_depth_is_there_where_the_engine_sees_a_collision(shared_data):
    """A depth of more than rounding is a collision of triangles, unless one lies wholly inside the other."""
    import fcl

    hand = clench.Hand.load(shared_data / HANDS["Barrett"])
    obj = clench.GraspObject.load(shared_data / OBJECTS["torus"])
    judge = Judge(hand, obj)
    seen = set()
    for pose in clench.approach_poses(hand, obj, 6, seed=2):
        solution = clench.solve(hand, obj, clench.GraspCommand(hand_pose=pose, full_width=False, preshape="open"))
        q = np.array([solution.joint_angles[name] for name in hand.joint_names])
        T_object_palm = np.linalg.inv(solution.object_pose.matrix) @ solution.hand_pose.matrix
        collides = False
        for link, T in zip(hand.links, T_object_palm @ hand.link_poses(q), strict=True):
            for shape in link.shapes.get(hand.default_source, ()):
                mesh = shape.to_mesh(1e-5)
                placed = volume_tree(mesh.vertices @ T[:3, :3].T + T[:3, 3], mesh.triangles)
                collides |= fcl.collide(fcl.CollisionObject(placed), fcl.CollisionObject(judge.trees[0])) > 0
        if solution.max_penetration > 1e-6:
            assert collides
        seen.add(bool(collides))
    assert True in seen
