"""Links that slide, roll and lie flush: neither stopped nor refused where they touch what is beside them at most."""

from dataclasses import replace

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, X, Y, Z, along_x, bipyramid, mount, turned
from clench.core.pose import Pose
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import Shape, ShapeKind

RADIUS, LENGTH = 0.008, 0.1


@pytest.mark.parametrize("planes", [1, 3, 5])
@pytest.mark.parametrize("tilt", [0.0, -0.3])
def test_a_link_that_rolls_on_what_it_touches_still_touches_it(planes, tilt):
    """The base joint closes a capsule on the end of a box's lower face; the next joint rolls it about its own axis."""
    axes = [-Y, turned(Y, tilt) @ X]
    shapes = [None, along_x(RADIUS, LENGTH)]
    hand = HandBuilder().finger("index", shapes, [0.0, LENGTH], axes=axes, upper=1.0).hand()
    command = clench.GraspCommand(
        hand_pose=Pose.identity(), object_pose=Pose([0.07, 0.0, 0.04]), planes=planes, preshape="open"
    )
    solution = clench.solve(hand, GraspObject.load("box:x=0.04,y=0.08,z=0.02"), command)
    # The capsule's side meets the edge at (0.09, 0.03): r sin(α - θ) = radius.
    expected = np.arctan2(0.03, 0.09) - np.arcsin(RADIUS / np.hypot(0.03, 0.09))
    assert solution.joint_angles["index_0"] == pytest.approx(expected, abs=1e-8)
    assert solution.status == "grasp"
    held = next(c for c in solution.contacts if c.stops_joint == "index_0")
    assert not held.passed
    assert abs(held.gap) <= 1e-9
    assert held.position[[0, 2]] == pytest.approx([0.09, 0.03], abs=1e-8)


@pytest.mark.parametrize("gap", [1e-12, 5.327e-10, 6.161e-10, 8.325e-10, 1.283e-9, 1e-8])
def test_a_finger_slides_past_a_parallel_one_however_close(gap):
    """Their sides are parallel, so the gap between them never changes, and both meet the box at the same angle."""
    link = Shape(ShapeKind.BOX, (0.02, 0.01, 0.004), Pose([0.02, 0.0, 0.0]))
    builder = HandBuilder().finger("one", [link], [0.04], upper=1.2)
    hand = builder.finger("other", [link], [0.04], upper=1.2, base=mount((0.0, 0.02 + gap, 0.0))).hand()
    command = clench.GraspCommand(hand_pose=Pose.identity(), object_pose=Pose([0.03, 0.01, 0.03]), preshape="open")
    solution = clench.solve(hand, GraspObject.load("box:x=0.02,y=0.06,z=0.02"), command)
    assert solution.certified
    assert solution.status == "grasp"
    assert solution.joint_angles["other_0"] == pytest.approx(solution.joint_angles["one_0"], abs=1e-9)


@pytest.mark.parametrize("turn", [0.0, 0.5, 0.8])
def test_a_link_that_ends_with_its_side_flush_to_a_face_overlaps_nothing(turn):
    hand = HandBuilder().finger(
        "index", [Shape(ShapeKind.BOX, (0.03, 0.01, 0.005), Pose([0.03, 0.0, 0.0]))], [0.06], upper=0.3
    )
    pose = Pose([0.05, 0.02, 0.03], wxyz=[np.cos(turn / 2), 0.0, np.sin(turn / 2), 0.0])
    command = clench.GraspCommand(hand_pose=Pose.identity(), object_pose=pose, preshape="open")
    solution = clench.solve(hand.hand(), GraspObject.from_shape(Shape(ShapeKind.BOX, (0.01, 0.01, 0.02))), command)
    assert solution.joint_angles["index_0"] == 0.3
    assert solution.certified, solution.certificate


@pytest.mark.parametrize("corners", [3, 4, 12])
def test_links_that_share_a_ring_of_edges_and_most_of_their_volume_are_refused(corners):
    """Every two of their faces are on either side of some plane, but the bodies are not."""
    one, other = bipyramid(75.0, 60.0, corners), bipyramid(60.0, 75.0, corners)
    builder = HandBuilder(palm=one).finger("idle", [None, along_x(0.002, 0.02)], [0.1, 0.02], upper=0.1)
    hand = builder.finger("spinning", [other], [0.02], axes=[Z], upper=0.1).hand()
    hand = replace(hand, allowed_pairs=())
    command = clench.GraspCommand(hand_pose=Pose.identity(), object_pose=Pose([0.1, 0.1, 0.3]), preshape="open")
    assert not clench.solve(hand, GraspObject.load("ball"), command).certified


def test_fingers_of_one_section_that_lie_in_each_other_are_refused():
    """All four sides of each are flush with the other's, so that no face goes through another."""
    link = Shape(ShapeKind.BOX, (0.02, 0.01, 0.004), Pose([0.02, 0.0, 0.0]))
    opposite = mount((0.06, 0.0, 0.0), turned(np.array([0.0, 0.0, 1.0]), np.pi))
    builder = HandBuilder().finger("one", [link], [0.04], upper=1.2)
    hand = builder.finger("other", [link], [0.04], upper=1.2, base=opposite).hand()
    command = clench.GraspCommand(hand_pose=Pose.identity(), object_pose=Pose([0.03, 0.0, 0.05]), preshape="open")
    solution = clench.solve(
        hand,
        GraspObject.load("ball"),
        command,
    )
    assert not solution.certified
    assert solution.certificate["code"] == "self_collision_at_start"
