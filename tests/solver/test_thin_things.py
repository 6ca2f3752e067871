"""Blades of 0.1 mm, needles and passes that graze, between two curl planes and on one: never stepped through."""

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder
from clench.core.pose import Pose
from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import Body, GraspObject
from clench.models.shapes import Shape, ShapeKind

LENGTH, HALF_WIDTH, HALF_THICK = 0.06, 0.01, 0.004
#: Three planes lie at the middle and at both edges; these lie on one and between two.
ASIDE = [0.0, 0.004, -0.0073]
ORDERS = ["proximal-first", "together"]


def box_finger():
    """Return a finger of one box that turns from x towards z about the origin."""
    link = Shape(ShapeKind.BOX, (LENGTH / 2, HALF_WIDTH, HALF_THICK), Pose([LENGTH / 2, 0.0, 0.0]))
    return HandBuilder().finger("index", [link], [LENGTH], upper=2.5).hand()


def needle(apex, away, thick=1e-4):
    """Return a needle of 40 mm that points at an apex from the other side of it."""
    along = np.asarray(away) / np.linalg.norm(away)
    u = np.cross(along, [0.0, 1.0, 0.0])
    end = np.asarray(apex) + 0.04 * along
    ring = [end + thick * (np.cos(t) * u + np.sin(t) * np.array([0.0, 1.0, 0.0])) for t in (0.0, 2.1, 4.2)]
    mesh = TriangleMesh([apex, *ring], [[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]])
    return GraspObject.from_shape(Shape(ShapeKind.MESH, (0.0, 0.0, 0.0), Pose.identity(), mesh), name="needle")


def closed(obj, order):
    command = clench.GraspCommand(
        hand_pose=Pose.identity(), planes=3, order=clench.ClosingOrder(order), preshape="open"
    )
    solution = clench.solve(box_finger(), obj, command)
    assert solution.certified
    return solution


def touch_of(x, z):
    """Return the turn at which the face of the link that looks along z meets a point: r sin(α - θ) = half thickness."""
    return np.arctan2(z, x) - np.arcsin(HALF_THICK / np.hypot(x, z))


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("y", ASIDE)
@pytest.mark.parametrize(
    "sizes", [(0.005, 5e-5, 0.01), (5e-5, 0.0025, 0.01), (5e-5, 5e-5, 0.01), (0.005, 0.0025, 5e-5)]
)
def test_a_blade_stops_the_face_that_meets_its_edge(order, y, sizes):
    blade = GraspObject.from_shape(Shape(ShapeKind.BOX, sizes), pose=Pose([0.025, y, 0.05]), name="blade")
    solution = closed(blade, order)
    expected = touch_of(0.025 + sizes[0], 0.05 - sizes[2])
    assert solution.joint_angles["index_0"] == pytest.approx(expected, abs=1e-8)
    assert all(abs(c.gap) <= 1e-9 for c in solution.contacts)
    assert len(solution.contacts) == 1


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("y", ASIDE)
def test_a_needle_stops_the_face_that_meets_its_tip(order, y):
    solution = closed(needle([0.03, y, 0.03], [0.0, 0.0, 1.0]), order)
    assert solution.joint_angles["index_0"] == pytest.approx(touch_of(0.03, 0.03), abs=1e-8)
    assert len(solution.contacts) == 1


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("y", ASIDE)
@pytest.mark.parametrize("deep", [1e-4, 1e-6, 1e-8])
def test_a_needle_that_reaches_into_the_circle_of_the_tip_is_hit_and_one_outside_is_passed(order, y, deep):
    """The tip's corner turns on a circle; the needle points at the pivot and ends just inside of it, or outside."""
    radius, angle = np.hypot(LENGTH, HALF_THICK), 1.0
    toward = np.array([np.cos(angle), 0.0, np.sin(angle)])
    for sign, stops in ((-1.0, True), (1.0, False)):
        apex = (radius + sign * deep) * toward + np.array([0.0, y, 0.0])
        q = closed(needle(apex, toward), order).joint_angles["index_0"]
        if stops:
            # The needle's side, which is not quite straight on, is met a little before its tip.
            tip = touch_of(apex[0], apex[2])
            assert tip - 0.004 * deep / radius - 1e-8 <= q <= tip + 1e-8
        else:
            assert q == 2.5


@pytest.mark.parametrize("y", ASIDE)
def test_a_link_that_touches_something_else_by_now_does_not_say_that_it_holds_what_was_stopped(y):
    """A heel stops the base joint, and leaves when the toe curls back to a needle that the base would leave."""
    knuckle, toe, heel = 0.05, 0.03, 0.02
    box = ((toe + heel) / 2, HALF_WIDTH, HALF_THICK)
    shape = Shape(ShapeKind.BOX, box, Pose([(toe - heel) / 2, 0.0, 0.0]))
    hand = HandBuilder().finger("index", [None, shape], [knuckle, toe], upper=2.5).hand()
    first, second = np.array([0.035, y, 0.02]), np.array([0.0252, y, 0.0274])
    tips = [(first, [-1.0, 0.0, 0.0]), (second, [-1.0, 0.0, -0.2])]
    shapes = [needle(apex, away).bodies[0].shapes[0] for apex, away in tips]
    needles = GraspObject("needles", (Body("needles", tuple(shapes), closed=True),))
    solution = clench.solve(hand, needles, clench.GraspCommand(hand_pose=Pose.identity(), planes=3, preshape="open"))

    def seen(point, turn, pivot):
        c, s = np.cos(turn), np.sin(turn)
        return c * point[0] + s * point[2] - pivot, c * point[2] - s * point[0]

    base = touch_of(first[0], first[2])
    tip = touch_of(*seen(second, base, knuckle))
    x, z = seen(first, base, knuckle)
    assert tip > 2.0
    assert solution.joint_angles["index_0"] == pytest.approx(base, abs=1e-8)
    assert solution.joint_angles["index_1"] == pytest.approx(tip, abs=1e-8)
    left, held = (next(c for c in solution.contacts if c.stops_joint == f"index_{k}") for k in (0, 1))
    assert left.passed
    assert left.gap == pytest.approx(seen((x, 0.0, z), tip, 0.0)[1] - HALF_THICK, abs=1e-8)
    assert left.position == pytest.approx(first, abs=1e-8)
    assert not held.passed
    assert held.position == pytest.approx(second, abs=1e-8)
