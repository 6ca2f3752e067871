"""Approach poses are free, near, tilted as promised, and the same for a seed."""

import numpy as np
import pytest
from block_hands import block_hand

from clench.closing.collision.approach import BACK_OFF, MAX_TILT, approach_poses
from clench.closing.collision.depths import first_touch, hand_depths, travel_to_touch
from clench.closing.collision.packed_object import pack_object
from clench.core.exceptions import CommandError, ObjectError, UnknownNameError
from clench.core.pose import Pose
from clench.models.hand.hand import Hand
from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import Body, BodyRole, GraspObject
from clench.models.objects.obstacles import table
from clench.models.shapes import Shape, ShapeKind
from clench.solver.batch.solve_batch import solve_batch

BALL = GraspObject("ball", (Body("ball", (Shape(ShapeKind.SPHERE, (0.03, 0.0, 0.0)),)),), pose=Pose([0.4, 0.5, 0.6]))
TABLE = Body("table", (Shape(ShapeKind.BOX, (1.0, 1.0, 0.1), Pose([0.0, 0.0, -0.13])),), role=BodyRole.OBSTACLE)


def travels(hand, obj, poses, q=None):
    packed, q = pack_object(obj), hand.open_angles() if q is None else q
    for pose in poses:
        T_palm_object = (pose.inverse() @ obj.pose).matrix
        assert all(depth.place is None for depth in hand_depths(hand, q, packed, T_palm_object))
        yield travel_to_touch(hand, q, packed, T_palm_object, hand.palm_normal)


def test_poses_are_free_and_backed_off():
    hand = block_hand()
    back = np.array(list(travels(hand, BALL, approach_poses(hand, BALL, 200, 1))))
    assert back.min() >= BACK_OFF[0] - 1e-9
    assert back.max() <= BACK_OFF[1] + 1e-9
    # Uniform between them: the mean of 200 is within four standard errors.
    assert back.mean() == pytest.approx(np.mean(BACK_OFF), abs=4 * np.ptp(BACK_OFF) / np.sqrt(12 * 200))


def test_the_normal_points_into_the_surface_tilted_by_up_to_30_degrees():
    hand = block_hand()
    poses = approach_poses(hand, BALL, 300, 2)
    tilts = []
    for pose in poses:
        start, normal = pose.position - BALL.pose.position, pose.rotation[:, 2]
        along = start @ normal
        # The line of the palm's centre meets the ball where it was drawn, or at its far side.
        root = np.sqrt(max(0.03**2 - (start @ start - along**2), 0.0))
        tilts.append(np.arccos(np.clip(-(start + (-along - root) * normal) @ normal / 0.03, -1.0, 1.0)))
    assert max(tilts) <= MAX_TILT + 0.05
    assert max(tilts) > 0.9 * MAX_TILT
    # Uniform over the cap: the cosine is uniform.
    assert np.cos(tilts).mean() == pytest.approx((1.0 + np.cos(MAX_TILT)) / 2.0, abs=0.01)
    assert np.linalg.norm(np.mean([p.rotation[:, 2] for p in poses], axis=0)) < 0.2


def test_the_same_seed_gives_the_same_poses_and_count_does_not_matter():
    hand = block_hand()
    six = approach_poses(hand, BALL, 6, 3)
    assert approach_poses(hand, BALL, 6, 3) == six
    assert approach_poses(hand, BALL, 2, 3) == six[:2]
    assert approach_poses(hand, BALL, 0, 3) == []
    assert not set(approach_poses(hand, BALL, 6, 4)) & set(six)


def test_the_poses_move_with_the_object():
    hand, move = block_hand(), Pose([1.0, -2.0, 0.5], [0.5, -0.5, 0.5, 0.5])
    here = approach_poses(hand, BALL, 4, 5)
    there = approach_poses(hand, BALL.posed(move @ BALL.pose), 4, 5)
    for one, other in zip(here, there, strict=True):
        np.testing.assert_allclose((move @ one).matrix, other.matrix, atol=1e-12)


def touched_first(hand, obj, poses):
    """Return the role of the body that the open hand touches first from each pose, and how far it goes until then."""
    packed = pack_object(obj)
    for pose in poses:
        T_palm_object = (pose.inverse() @ obj.pose).matrix
        travel, body = first_touch(hand, hand.open_angles(), packed, T_palm_object, hand.palm_normal)
        yield packed.body_roles[body], travel


def test_a_pose_that_touches_an_obstacle_first_is_drawn_again():
    hand, obj = block_hand(), BALL.with_body(TABLE)
    poses = approach_poses(hand, obj, 60, 6)
    assert min(travels(hand, obj, poses)) >= BACK_OFF[0] - 1e-9
    roles, travelled = zip(*touched_first(hand, obj, poses), strict=True)
    assert set(roles) == {BodyRole.GRASPABLE}
    assert max(travelled) <= BACK_OFF[1] + 1e-9
    # The table's upper face is 80 mm below the centre of the ball: from there the ball cannot be reached.
    assert min(pose.position[2] for pose in poses) > BALL.pose.position[2] - 0.08
    # Draws that touch the ball first are those without the table.
    free = np.array([pose.wxyz_xyz for pose in approach_poses(hand, BALL, 60, 6)])
    same = [np.abs(free - pose.wxyz_xyz).max(axis=1).min() < 1e-12 for pose in poses]
    assert 5 < sum(same) < 55
    aims = [np.linalg.norm(np.cross(BALL.pose.position - p.position, p.rotation[:, 2])) for p in poses]
    assert max(aims) <= 0.03 + 1e-9


def test_where_obstacles_always_come_first_the_nearest_stop_is_kept():
    # The ball stands in a box that leaves 1 mm around it: the hand is stopped by the box wherever it comes from.
    cage = Body("cage", (Shape(ShapeKind.BOX, (0.031, 0.031, 0.031)),), role=BodyRole.OBSTACLE)
    hand, obj = block_hand(), BALL.with_body(cage)
    poses = approach_poses(hand, obj, 20, 6)
    roles, travelled = zip(*touched_first(hand, obj, poses), strict=True)
    assert set(roles) == {BodyRole.OBSTACLE}
    assert BACK_OFF[0] - 1e-9 <= min(travelled)
    assert max(travelled) <= BACK_OFF[1] + 1e-9
    # The nearest of a hundred stops is over the middle of a face, 1 mm off the ball; corners are 24 mm off.
    near = [np.linalg.norm(p.position - obj.pose.position) - t for p, t in zip(poses, travelled, strict=True)]
    assert max(near) < 0.04


def test_a_table_costs_few_grasps_of_a_real_hand():
    hand, mug = Hand.load("robonaut2"), GraspObject.load("mug")
    scene = mug.with_body(table())
    counts = [solve_batch(hand, obj, approach_poses(hand, obj, 40, 0)).counts()["grasp"] for obj in (mug, scene)]
    assert counts[0] >= 25
    assert counts[1] >= 0.75 * counts[0]


def test_a_preshape_changes_what_touches_first():
    hand = block_hand()
    block = GraspObject("block", (Body("block", (Shape(ShapeKind.BOX, (0.2, 0.2, 0.2)),)),))
    flat, straight = approach_poses(hand, block, 20, 7, preshape={"bend": 1.5}), approach_poses(hand, block, 20, 7)
    # The same draws; only the first touch differs, and a finger out of the way lets the palm come no less near.
    gained = [(one.position - other.position) @ one.rotation[:, 2] for one, other in zip(flat, straight, strict=True)]
    assert max(gained) > 0.02
    assert min(travels(hand, block, flat, np.array([1.5]))) >= BACK_OFF[0] - 1e-9


def test_bad_input_is_named():
    hand = block_hand()
    with pytest.raises(UnknownNameError, match=r"'bent' is not in hand 'block'\. Did you mean 'bend'"):
        approach_poses(hand, BALL, 1, 0, preshape={"bent": 0.0})
    with pytest.raises(CommandError, match=r"preshape\.bend: expected a finite angle"):
        approach_poses(hand, BALL, 1, 0, preshape={"bend": np.nan})
    with pytest.raises(CommandError, match=r"preshape\.bend: expected a finite angle"):
        approach_poses(hand, BALL, 1, 0, preshape={"bend": 10**400})
    with pytest.raises(CommandError, match=r"count of 0 or more, got -1\."):
        approach_poses(hand, BALL, -1, 0)
    with pytest.raises(CommandError, match=r"seed: expected a whole number of at least 0, got -1\."):
        approach_poses(hand, BALL, 0, -1)
    needle = Shape(ShapeKind.MESH, mesh=TriangleMesh([[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0]], [[0, 1, 2]]))
    with pytest.raises(ObjectError, match="object 'needle': expected a graspable body with a surface"):
        approach_poses(hand, GraspObject("needle", (Body("needle", (needle,)),)), 1, 0)


@pytest.mark.shared
@pytest.mark.parametrize("model", ["shadow_hand_mjcf/right_hand.xml", "leap_hand_urdf/leap_hand_right.urdf"])
def test_real_hands_are_free_of_a_real_object_by_an_independent_engine(shared_data, model):
    import fcl

    from clench.models.hand.link_mesh import link_meshes

    hand = Hand.load(shared_data / "hands" / model)
    obj = GraspObject.load(shared_data / "objects" / "ycb_mug" / "textured.obj")
    tree = pack_object(obj).full_tree

    def volumes(tree):
        model = fcl.BVHModel()
        model.beginModel(len(tree.vertices), len(tree.triangles))
        model.addSubModel(tree.vertices, tree.triangles)
        model.endModel()
        return model

    mug = fcl.CollisionObject(volumes(tree), fcl.Transform())
    links = [(mesh.link, volumes(mesh.tree)) for mesh in link_meshes(hand)]
    poses = hand.link_poses(hand.open_angles())
    for pose in approach_poses(hand, obj, 5, 8):
        gaps = []
        for link, volume in links:
            T = pose.matrix @ poses[link]
            placed = fcl.CollisionObject(volume, fcl.Transform(T[:3, :3], T[:3, 3]))
            gaps.append(fcl.distance(placed, mug, fcl.DistanceRequest(), fcl.DistanceResult()))
        assert 0.0 < min(gaps) <= BACK_OFF[1] + 1e-9
