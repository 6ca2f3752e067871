"""Sensitivities against central differences of the solver itself, for random poses, hands and objects."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, along_x, one_link, three_links
from clench.core.pose import Pose
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import Shape, ShapeKind
from clench.solver.analysis.pose_error import displaced
from oracle.width import make_case
from solver.test_invariance import two_fingers

STEP = 1e-5
#: Central differences of an answer that is true to 1e-11 m are true to this [rad/m].
NOISE = 1e-3


def angles(solution):
    return np.array(list(solution.joint_angles.values()))


def differences(hand, obj, command, solution):
    """Return central differences (J, 6), and whether each looks smooth: the same from both sides and at half a step."""
    at, q = angles(solution), []
    for step in (STEP, 0.5 * STEP):
        for k in range(6):
            for sign in (1.0, -1.0):
                error = np.zeros(6)
                error[k] = sign * step
                there = replace(command, object_pose=displaced(solution.object_pose, error))
                q.append(angles(clench.solve(hand, obj, there)))
    q = np.array(q).reshape(2, 6, 2, -1)
    whole, half = ((q[n, :, 0] - q[n, :, 1]).T / (2.0 * step) for n, step in enumerate((STEP, 0.5 * STEP)))
    onward, back = (q[0, :, 0] - at).T / STEP, (at - q[0, :, 1]).T / STEP
    size = largest(whole) + NOISE
    smooth = (np.abs(whole - half) < 1e-3 * size + NOISE) & (np.abs(onward - back) < 0.02 * size + NOISE)
    return whole, smooth


def largest(rows):
    """Return the largest entry of each row's translation and of its rotation, at their places."""
    return np.repeat(np.abs(rows).reshape(len(rows), 2, 3).max(axis=2), 3, axis=1)


def judge(hand, obj, command, tolerance=1e-3):
    """Compare all entries; return how many were compared, and how many are not numbers."""
    solution = clench.solve(hand, obj, command)
    found = clench.sensitivity(solution, hand, obj)
    measured, smooth = differences(hand, obj, command, solution)
    known = np.isfinite(found.matrix)
    assert set(found.reasons) == {name for name, row in zip(found.joints, known, strict=True) if not row.all()}
    size = largest(measured) + 0.1
    wrong = known & smooth & (np.abs(found.matrix - measured) > tolerance * size + NOISE)
    assert not wrong.any(), (found.matrix[wrong], measured[wrong], found.stopped_by, found.reasons)
    # Where the solver jumps or has a kink there is nothing to compare.
    return Counter(
        compared=int((known & smooth & (np.abs(measured) > NOISE)).sum()),
        unknown=int((~known & smooth).sum()),
        rough=int((known & ~smooth).sum()),
        entries=known.size,
    )


def test_random_chains():
    seen = Counter()
    for seed in range(40):
        case = make_case(seed)
        command = clench.GraspCommand(hand_pose=Pose.identity(), object_pose=case.place, planes=1, preshape="open")
        seen += judge(case.hand, case.obj, command)
    assert seen["compared"] > 200, seen
    assert seen["unknown"] + seen["rough"] < 0.1 * seen["compared"], seen


@pytest.mark.parametrize("tilted", [False, True])
def test_random_chains_whose_joints_move_at_once(tilted):
    """At speeds of their own; their axes are parallel or not."""
    seen, order = Counter(), clench.ClosingOrder.TOGETHER
    for seed in range(30):
        case = make_case(seed, tilted)
        followers = {c.follower for c in case.hand.couplings}
        free = [name for i, name in enumerate(case.hand.joint_names) if i not in followers]
        speeds = {name: 0.5 + k for k, name in enumerate(free)}
        command = clench.GraspCommand(
            hand_pose=Pose.identity(), object_pose=case.place, planes=1, order=order, speeds=speeds, preshape="open"
        )
        seen += judge(case.hand, case.obj, command)
    assert seen["compared"] > 150, seen
    assert seen["unknown"] + seen["rough"] < 0.1 * seen["compared"], seen


@pytest.mark.parametrize("name", ["robonaut2", "patent15"])
def test_built_in_hands(name):
    hand, mug = clench.Hand.load(name), GraspObject.load("mug")
    seen = Counter()
    for pose in clench.approach_poses(hand, mug, 3, seed=5):
        seen += judge(hand, mug, clench.GraspCommand(hand_pose=pose, planes=1, preshape="open"))
    assert seen["compared"] > 60, seen
    assert seen["unknown"] + seen["rough"] < 0.3 * seen["compared"], seen


@pytest.mark.parametrize("shape", ["box:x=0.05,y=0.07,z=0.02", "sphere:r=0.02", "capsule:r=0.015,h=0.06"])
def test_fingers_one_after_another_with_a_coupled_one(shape):
    pose = Pose([0.02, 0.003, 0.033], wxyz=np.array([0.9, 0.1, 0.4, 0.13]) / np.linalg.norm([0.9, 0.1, 0.4, 0.13]))
    seen = judge(
        two_fingers(),
        GraspObject.load(shape, pose=pose),
        clench.GraspCommand(hand_pose=Pose.identity(), preshape="open"),
    )
    assert seen["compared"] > 10, seen


@pytest.mark.parametrize("shape", ["ellipsoid:a=0.02,b=0.03,c=0.015", "cylinder:r=0.02,h=0.09"])
def test_shapes_that_are_swept_as_polyhedra(shape):
    """Their facets are a hundredth of a radian off: so are the normals, and so may be the changes."""
    hand, command = two_fingers(), clench.GraspCommand(hand_pose=Pose.identity(), preshape="open")
    obj = GraspObject.load(shape, pose=Pose([0.02, 0.003, 0.031], wxyz=[0.6, 0.64, 0.48, 0.0]))
    solution = clench.solve(hand, obj, command)
    found = clench.sensitivity(solution, hand, obj)
    assert not found.reasons
    step = 2e-4
    for k in range(3):
        error = np.eye(6)[k] * step
        q = [
            angles(clench.solve(hand, obj, replace(command, object_pose=displaced(obj.pose, sign * error))))
            for sign in (1.0, -1.0)
        ]
        np.testing.assert_allclose(found.translation[:, k], (q[0] - q[1]) / (2.0 * step), rtol=0.05, atol=1.0)


def test_one_link_on_a_ball_in_closed_form():
    """theta = gamma - asin((R + w) / D), docs/method.md section 3: its derivatives by the ball's place."""
    radius, w = 0.02, 0.008
    x, z = 0.05, 0.05
    hand, ball = one_link(w), GraspObject.load(f"sphere:r={radius}", pose=Pose([x, 0.0, z]))
    solution = clench.solve(hand, ball, clench.GraspCommand(hand_pose=Pose.identity(), preshape="open"))
    found = clench.sensitivity(solution, hand, ball)
    D = np.hypot(x, z)
    along = (radius + w) / (D * np.sqrt(D**2 - (radius + w) ** 2))
    expected = [-z / D**2 + along * x / D, 0.0, x / D**2 + along * z / D]
    np.testing.assert_allclose(found.translation[0], expected, atol=1e-6)
    np.testing.assert_allclose(found.rotation[0], 0.0, atol=1e-9)
    assert found.stopped_by == {"index_0": ball.name}
    np.testing.assert_allclose(found.change([1e-3, 0.0, -2e-3]), [1e-3 * (expected[0] - 2.0 * expected[2])], atol=1e-8)
    np.testing.assert_allclose(found.worst_change(1e-3, 0.1), [1e-3 * (abs(expected[0]) + abs(expected[2]))], atol=1e-8)


def test_a_moved_world_changes_only_the_axes():
    hand, motion = one_link(), Pose([0.3, -0.2, 0.5], wxyz=[0.5, -0.1, 0.7, 0.5])
    box = GraspObject.load("box:x=0.03,y=0.04,z=0.02", pose=Pose([0.06, 0.004, 0.04], wxyz=[0.96, 0.0, 0.28, 0.0]))
    here = clench.sensitivity(
        clench.solve(hand, box, clench.GraspCommand(hand_pose=Pose.identity(), preshape="open")), hand, box
    )
    moved = box.posed(motion @ box.pose)
    there = clench.sensitivity(
        clench.solve(hand, moved, clench.GraspCommand(hand_pose=motion, preshape="open")), hand, moved
    )
    known = np.isfinite(here.translation).all() and np.isfinite(there.translation).all()
    assert known
    np.testing.assert_allclose(here.translation @ motion.rotation.T, there.translation, atol=1e-6)


def test_limits_do_not_change():
    hand, ball = three_links(upper=0.3), GraspObject.load("sphere:r=0.02", pose=Pose([0.03, 0.3, 0.0]))
    solution = clench.solve(hand, ball, clench.GraspCommand(hand_pose=Pose.identity(), preshape="open"))
    found = clench.sensitivity(solution, hand, ball)
    assert set(found.stopped_by.values()) == {"limit"}
    assert not found.matrix.any()
    assert not found.reasons


def test_a_grazing_touch_is_said_to_be_one():
    """The tip's circle cuts into the ball by a nanometre: where it stops, the ball's surface runs along its path."""
    w, length, radius = 0.008, 0.1, 0.02
    hand, far = one_link(w, length), length + w + radius - 2e-9
    ball = GraspObject.load(f"sphere:r={radius}", pose=Pose([far * np.cos(1.0), 0.0, far * np.sin(1.0)]))
    solution = clench.solve(hand, ball, clench.GraspCommand(hand_pose=Pose.identity(), preshape="open"))
    assert solution.joint_angles["index_0"] == pytest.approx(1.0, abs=1e-3)
    found = clench.sensitivity(solution, hand, ball)
    assert found.reasons == {"index_0": "index_0: it grazes what stops it."}
    assert np.isinf(found.matrix).all()
    assert found.to_dict()["translation"] == {"index_0": [None, None, None]}
    assert np.isinf(found.change([1e-3, 0.0, 0.0])).all()
    assert not found.change().any()


def test_a_joint_that_is_stopped_before_it_moves():
    """The ball lies against the open finger: pushed towards it, it would overlap; drawn back, the finger follows."""
    hand, ball = one_link(0.008), GraspObject.load("sphere:r=0.02", pose=Pose([0.05, 0.0, 0.028 + 1e-12]))
    solution = clench.solve(hand, ball, clench.GraspCommand(hand_pose=Pose.identity(), preshape="open"))
    assert solution.joint_angles["index_0"] == pytest.approx(0.0, abs=1e-9)
    found = clench.sensitivity(solution, hand, ball)
    assert np.isinf(found.translation[0]).tolist() == [False, False, True]
    assert found.reasons == {"index_0": "index_0: it is stopped before it moves."}


def test_a_joint_that_the_touch_of_an_earlier_one_holds_stays():
    """The distal link touched while the proximal joint moved: whatever the ball does, the distal joint stays open."""
    hand = three_links(lengths=(0.03, 0.03, 0.03))
    ball = GraspObject.load("sphere:r=0.01", pose=Pose([0.05, 0.0, 0.06]))
    command = clench.GraspCommand(hand_pose=Pose.identity(), preshape="open")
    found = clench.sensitivity(clench.solve(hand, ball, command), hand, ball)
    assert found.stopped_by["index_2"] == ball.name
    assert not found.reasons
    assert judge(hand, ball, command)["compared"] >= 2


def test_parallel_features_give_what_is_the_same_at_both_ends():
    """A flat finger comes down on a level edge: a turn about the finger's axis lets go of one end or the other."""
    link = Shape(ShapeKind.BOX, (0.05, 0.01, 0.005), Pose([0.05, 0.0, 0.0]))
    hand = HandBuilder().finger("index", [link], [0.1]).hand()
    box = GraspObject.load("box:x=0.02,y=0.06,z=0.02", pose=Pose([0.06, 0.003, 0.05]))
    command = clench.GraspCommand(hand_pose=Pose.identity(), preshape="open")
    solution = clench.solve(hand, box, command)
    found = clench.sensitivity(solution, hand, box)
    measured, smooth = differences(hand, box, command, solution)
    known = np.isfinite(found.matrix)
    assert known[0].tolist() == smooth[0].tolist() == [True, True, True, False, True, False]
    np.testing.assert_allclose(found.matrix[known], measured[known], atol=NOISE)
    assert found.reasons == {"index_0": "index_0: it touches at several places at once."}


def test_a_joint_that_is_stopped_by_the_hand_itself():
    """The thumb comes up to a finger that the ball stopped: it changes with the finger."""
    builder = HandBuilder().finger("index", [along_x(0.006, 0.08)], [0.08])
    builder.finger("thumb", [along_x(0.006, 0.07)], [0.07], base=mount_below(), thumb=True)
    hand, ball = builder.hand(), GraspObject.load("sphere:r=0.015", pose=Pose([0.06, 0.002, 0.05]))
    command = clench.GraspCommand(hand_pose=Pose.identity(), preshape="open")
    solution = clench.solve(hand, ball, command)
    found = clench.sensitivity(solution, hand, ball)
    assert found.stopped_by == {"index_0": ball.name, "thumb_0": "index_link_0"}
    assert judge(hand, ball, command)["compared"] >= 4
    assert np.abs(found.translation[1]).max() > 1.0


def mount_below():
    """Return a base below the index finger, from where a finger along y turns up and across it."""
    T = np.eye(4)
    T[:3, :3] = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    T[:3, 3] = 0.02, -0.03, -0.03
    return T


def test_another_hand_or_object_is_refused():
    hand, ball = three_links(), GraspObject.load("sphere:r=0.02", pose=Pose([0.05, 0.0, 0.05]))
    solution = clench.solve(hand, ball, clench.GraspCommand(hand_pose=Pose.identity(), preshape="open"))
    with pytest.raises(clench.ClenchError, match=r"hand 'chain' is not the one that the solution"):
        clench.sensitivity(solution, three_links(0.005), ball)
    with pytest.raises(clench.ClenchError, match=r"the object is not the 'sphere.*' that the solution"):
        clench.sensitivity(solution, hand, GraspObject.load("sphere:r=0.03"))


def test_a_candidate_of_one_plane_says_so():
    case = make_case(3)
    command = clench.GraspCommand(
        hand_pose=Pose.identity(), object_pose=case.place, planes=2, full_width=False, preshape="open"
    )
    solution = clench.solve(case.hand, case.obj, command)
    found = clench.sensitivity(solution, case.hand, case.obj)
    unknown = [name for name, row in zip(found.joints, found.matrix, strict=True) if not np.isfinite(row).all()]
    assert unknown == list(found.reasons)


def test_a_small_error_does_what_was_predicted():
    case = make_case(12)
    command = clench.GraspCommand(hand_pose=Pose.identity(), object_pose=case.place, preshape="open")
    error = clench.pose_error(case.hand, case.obj, command, 1e-5, 1e-5)
    assert len(error.corners) == 64
    assert error.predicted.max() > 1e-5
    np.testing.assert_allclose(error.measured, error.predicted, rtol=0.01, atol=1e-8)
    assert set(error.kept.values()) == {1.0}
    assert error.gained == {}


def test_a_large_error_loses_touches():
    hand, ball = three_links(), GraspObject.load("sphere:r=0.02", pose=Pose([0.06, 0.0, 0.05]))
    error = clench.pose_error(hand, ball, clench.GraspCommand(hand_pose=Pose.identity(), preshape="open"), 0.01, 0.0)
    assert sum(error.statuses.values()) == 64
    assert min(error.kept.values()) < 1.0
    for corner in error.corners:
        assert not set(corner.lost) & set(corner.gained)
    document = error.to_dict()
    assert set(document["kept"]) == set(error.touching)


@pytest.mark.parametrize(
    ("translation", "rotation", "what"),
    [(-1.0, 0.0, "translation"), (np.nan, 0.0, "translation"), (0.0, 4.0, "rotation")],
)
def test_an_error_that_is_none_is_refused(translation, rotation, what):
    case = make_case(12)
    with pytest.raises(clench.CommandError, match=f"pose error: expected a {what} of 0 or more"):
        clench.pose_error(
            case.hand, case.obj, clench.GraspCommand(Pose.identity(), preshape="open"), translation, rotation
        )


def test_a_solution_that_was_tampered_with_is_refused_in_a_sentence():
    hand, ball = three_links(), GraspObject.load("sphere:r=0.02", pose=Pose([0.05, 0.0, 0.05]))
    solution = clench.solve(hand, ball, clench.GraspCommand(hand_pose=Pose.identity(), planes=1, preshape="open"))
    with pytest.raises(clench.ClenchError, match="Collision source 'x' is not in clench"):
        clench.sensitivity(replace(solution, collision_source="x"), hand, ball)
    with pytest.raises(clench.ClenchError, match="joint_angles: the solution has no angle of joint 'index_0'"):
        clench.sensitivity(replace(solution, joint_angles={}), hand, ball)


def test_a_finger_without_candidates_has_changes_that_are_not_known():
    hand, ball = three_links(), GraspObject.load("sphere:r=0.02", pose=Pose([0.05, 0.0, 0.05]))
    solution = clench.solve(hand, ball, clench.GraspCommand(hand_pose=Pose.identity(), planes=1, preshape="open"))
    bare = replace(solution, fingers={n: replace(f, candidates=()) for n, f in solution.fingers.items()})
    found = clench.sensitivity(bare, hand, ball)
    assert np.isinf(found.translation).all()
    assert "has no candidate of index" in found.reasons["index_0"]
