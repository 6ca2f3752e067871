"""Whole solves against closed forms: circle, ellipse, box and tip (docs/method.md section 3), to 1e-9 rad."""

import numpy as np
import pytest
from scipy.optimize import brentq

import clench
from chain_hands import HandBuilder, along_x, mount, one_link, three_links, turned
from clench.core.pose import Pose
from clench.models.shapes import Shape, ShapeKind

EXACT = 1e-9
THICK = 0.008
LONG = 0.2
X, Y, _ = np.eye(3)


def command(**changes):
    return clench.GraspCommand(**{"hand_pose": Pose.identity(), "planes": 1, "preshape": "open", **changes})


def upright(radius, center):
    """Return a cylinder whose axis is normal to the curl planes: its section is a circle."""
    half = np.sqrt(0.5)
    return clench.GraspObject.load(f"cylinder:r={radius!r},h=0.1", pose=Pose(center, wxyz=[half, half, 0, 0]))


def ball(radius, center):
    return clench.GraspObject.load(f"sphere:r={radius!r}", pose=Pose(center))


@pytest.mark.parametrize("up", [True, False], ids=["up", "down"])
@pytest.mark.parametrize("make", [upright, ball])
@pytest.mark.parametrize(("distance", "angle", "radius"), [(0.07, 0.9, 0.02), (0.05, 2.2, 0.03), (0.15, 1.4, 0.001)])
def test_circle(up, make, distance, angle, radius):
    sign = 1.0 if up else -1.0
    obj = make(radius, [distance * np.cos(angle), 0.0, sign * distance * np.sin(angle)])
    solution = clench.solve(one_link(THICK, LONG, up=up), obj, command(full_width=make is ball))
    theta = angle - np.arcsin((radius + THICK) / distance)
    assert solution.joint_angles["index_0"] == pytest.approx(theta, abs=EXACT)
    (contact,) = solution.contacts
    assert contact.kind == "side"
    along = np.sqrt(distance**2 - (radius + THICK) ** 2)
    core = np.array([np.cos(theta), 0.0, sign * np.sin(theta)])
    out = np.array([-np.sin(theta), 0.0, sign * np.cos(theta)])
    np.testing.assert_allclose(contact.position, along * core + THICK * out, atol=1e-9)
    np.testing.assert_allclose(contact.normal, -out, atol=1e-9)
    assert abs(contact.gap) <= 1e-10
    assert solution.is_valid()


@pytest.mark.parametrize(("distance", "angle", "radius"), [(0.07, 0.9, 0.02), (0.05, 2.2, 0.03), (0.15, 1.4, 0.001)])
def test_full_width_meets_a_cylinder_at_its_polyhedron(distance, angle, radius):
    """The finger stops inside the true circle, by no more than the deviation that the certificate states."""
    obj = upright(radius, [distance * np.cos(angle), 0.0, distance * np.sin(angle)])
    solution = clench.solve(one_link(THICK, LONG), obj, command())
    theta = angle - np.arcsin((radius + THICK) / distance)
    deviation = solution.certificate["deviation"]
    beyond = solution.joint_angles["index_0"] - theta
    assert deviation == pytest.approx(2e-5 * max(radius, 0.05))
    assert -EXACT <= beyond <= 1.01 * deviation / np.sqrt(distance**2 - (radius + THICK) ** 2)
    (contact,) = solution.contacts
    center = np.array(obj.pose.position)
    assert np.hypot(*(contact.position - center)[[0, 2]]) == pytest.approx(radius, abs=deviation)


def test_tip_meets_a_circle_beyond_the_links_side():
    length, radius, distance = 0.1, 0.02, 0.115
    obj = ball(radius, [0.0, 0.0, distance])
    solution = clench.solve(one_link(THICK, length), obj, command())
    reach = THICK + radius
    between = np.arccos((length**2 + distance**2 - reach**2) / (2 * length * distance))
    assert solution.joint_angles["index_0"] == pytest.approx(np.pi / 2 - between, abs=EXACT)
    (contact,) = solution.contacts
    assert contact.kind == "tip"
    assert contact.link_angle is None


def test_a_circle_beyond_the_tip_is_not_touched():
    solution = clench.solve(one_link(THICK, 0.1), ball(0.02, [0.0, 0.0, 0.1281]), command())
    assert solution.status == "no_contact"
    assert solution.joint_angles["index_0"] == 3.0
    assert clench.solve(one_link(THICK, 0.1), ball(0.02, [0.0, 0.0, 0.1279]), command()).status == "grasp"


def test_a_circle_around_the_pivot_never_stops_a_turn():
    far = HandBuilder().finger("index", [Shape(ShapeKind.SPHERE, (THICK, 0, 0), Pose([0.05, 0, 0]))], [0.05]).hand()
    assert clench.solve(far, ball(0.02, [0, 0, 0]), command()).status == "no_contact"


def ellipse_turn(center, shape, thick, up):
    """Return the turn at which a side at `thick` from the pivot meets an ellipse with matrix `shape`, by bisection."""
    s = 1.0 if up else -1.0

    def gap(theta):
        inward = np.array([np.sin(theta), -s * np.cos(theta)])
        return -(inward @ center) - thick - np.sqrt(inward @ shape @ inward)

    return brentq(gap, 0.0, np.arctan2(s * center[1], center[0]), xtol=1e-15, rtol=1e-15)


@pytest.mark.parametrize("seed", range(12))
def test_cylinder_cut_obliquely_is_an_ellipse(seed):
    rng = np.random.default_rng([1, seed])
    up = bool(seed % 2)
    radius, tilt, spin = rng.uniform(0.01, 0.02), rng.uniform(0.05, 1.0), rng.uniform(0, np.pi)
    distance, angle = rng.uniform(0.055, 0.07), rng.uniform(0.8, 1.4)
    center = distance * np.array([np.cos(angle), (1 if up else -1) * np.sin(angle)])
    axis = np.array([np.sin(tilt) * np.cos(spin), np.cos(tilt), np.sin(tilt) * np.sin(spin)])
    x = np.cross(Y, axis) / np.sin(tilt)
    pose = Pose.from_matrix(mount((center[0], 0.0, center[1]), np.column_stack([x, np.cross(axis, x), axis])))
    obj = clench.GraspObject.load(f"cylinder:r={radius!r},h=1.0", pose=pose)
    solution = clench.solve(one_link(THICK, LONG, up=up), obj, command(full_width=False))
    u = np.array([np.cos(spin), np.sin(spin)])
    shape = radius**2 * np.eye(2) + ((radius / np.cos(tilt)) ** 2 - radius**2) * np.outer(u, u)
    assert solution.joint_angles["index_0"] == pytest.approx(ellipse_turn(center, shape, THICK, up), abs=EXACT)
    assert [c.kind for c in solution.contacts] == ["side"]


@pytest.mark.parametrize("seed", range(12))
def test_ellipsoid(seed):
    rng = np.random.default_rng([2, seed])
    up = bool(seed % 2)
    semi = rng.uniform(0.008, 0.02, 3)
    distance, angle, height = rng.uniform(0.055, 0.07), rng.uniform(0.8, 1.4), rng.uniform(-0.6, 0.6) * semi.min()
    center = distance * np.array([np.cos(angle), (1 if up else -1) * np.sin(angle)])
    rotation = turned(rng.normal(size=3) / 2.0, 1.0)
    rotation = np.linalg.qr(rotation)[0]
    rotation *= np.linalg.det(rotation)
    pose = Pose.from_matrix(mount((center[0], height, center[1]), rotation))
    text = ",".join(f"{k}={float(v)!r}" for k, v in zip("abc", semi, strict=True))
    solution = clench.solve(
        one_link(THICK, LONG, up=up), clench.GraspObject.load(f"ellipsoid:{text}", pose=pose), command(full_width=False)
    )
    quadric = rotation @ np.diag(semi**-2.0) @ rotation.T
    flat, mixed = quadric[np.ix_([0, 2], [0, 2])], -height * quadric[[0, 2], 1]
    middle = center - np.linalg.solve(flat, mixed)
    level = 1.0 - quadric[1, 1] * height**2 + mixed @ np.linalg.solve(flat, mixed)
    expected = ellipse_turn(middle, np.linalg.inv(flat) * level, THICK, up)
    assert solution.joint_angles["index_0"] == pytest.approx(expected, abs=EXACT)


@pytest.mark.parametrize("planes", [1, 5])
def test_box_corner_on_the_side_of_a_link(planes):
    obj = clench.GraspObject.load("box:x=0.04,y=0.1,z=0.02", pose=Pose([0.06, 0.0, 0.05]))
    solution = clench.solve(one_link(THICK, 0.1), obj, command(planes=planes))
    corner = np.array([0.08, 0.04])
    theta = np.arctan2(*corner[::-1]) - np.arcsin(THICK / np.hypot(*corner))
    middle = [c for c in solution.fingers["index"].candidates if c.offset is None or abs(c.offset) < 1e-12]
    for candidate in middle:
        assert candidate.joint_angles["index_0"] == pytest.approx(theta, abs=EXACT)
    assert solution.joint_angles["index_0"] == pytest.approx(theta, abs=EXACT)
    assert {c.kind for c in solution.contacts} == {"side"}


def test_link_corner_on_the_face_of_a_box():
    """A box link twice 8 mm thick, 60 mm long, below a wide box at z = 30 mm: its upper corner hits the face."""
    link = Shape(ShapeKind.BOX, (0.03, 0.01, 0.008), Pose([0.03, 0.0, 0.0]))
    hand = HandBuilder().finger("index", [link], [0.06]).hand()
    obj = clench.GraspObject.load("box:x=0.5,y=0.5,z=0.02", pose=Pose([0.0, 0.0, 0.04]))
    solution = clench.solve(hand, obj, command())
    theta = np.arcsin(0.03 / np.hypot(0.06, 0.008)) - np.arctan2(0.008, 0.06)
    assert solution.joint_angles["index_0"] == pytest.approx(theta, abs=EXACT)
    assert {c.kind for c in solution.contacts} == {"vertex"}
    on_plane = clench.solve(hand, obj, command(full_width=False))
    assert on_plane.joint_angles["index_0"] == pytest.approx(theta, abs=EXACT)
    assert {c.kind for c in on_plane.contacts} == {"edge"}


def test_flat_side_on_flat_face():
    """A box tilted such that its face meets the side of a box link all along, at exactly 0.5 rad."""
    link = Shape(ShapeKind.BOX, (0.03, 0.01, 0.008), Pose([0.03, 0.0, 0.0]))
    hand = HandBuilder().finger("index", [link], [0.06]).hand()
    rotation = turned(-Y, 0.5)
    center = rotation @ np.array([0.03, 0.0, 0.008 + 0.01])
    obj = clench.GraspObject.load("box:x=0.02,y=0.1,z=0.02", pose=Pose.from_matrix(mount(center, rotation)))
    solution = clench.solve(hand, obj, command())
    assert solution.joint_angles["index_0"] == pytest.approx(0.5, abs=EXACT)


def test_three_links_wrap_a_circle():
    """Each link in turn is tangent: the closed form holds in the frame of each pivot."""
    lengths, thick, radius = (0.05, 0.035, 0.025), 0.007, 0.02
    center = np.hypot(0.03, radius + thick) * np.array([np.cos(1.1), np.sin(1.1)])
    solution = clench.solve(three_links(thick, lengths), ball(radius, [center[0], 0, center[1]]), command())
    pivot, total = np.zeros(2), 0.0
    for i, length in enumerate(lengths):
        away = center - pivot
        distance = np.hypot(*away)
        theta = np.arctan2(away[1], away[0]) - np.arcsin((radius + thick) / distance)
        theta += 2 * np.pi * (theta < total)
        assert solution.joint_angles[f"index_{i}"] == pytest.approx(theta - total, abs=EXACT)
        total = theta
        pivot = pivot + length * np.array([np.cos(theta), np.sin(theta)])
    assert [c.stops_joint for c in solution.contacts] == ["index_0", "index_1", "index_2"]
    assert solution.status == "grasp"


@pytest.mark.parametrize("ratio", [1.0, 0.6, -0.4])
def test_coupled_joints_against_bisection(ratio):
    """Two joints move as one; the gap of both links is followed finely and its first zero bisected."""
    lengths, thick, radius, center = (0.05, 0.05), 0.006, 0.015, np.array([0.06, 0.05])
    shapes = [along_x(thick, length) for length in lengths]
    builder = HandBuilder().finger("index", shapes, lengths, lower=-2.0, upper=2.0)
    hand = builder.couple("index_0", "index_1", ratio).hand()
    solution = clench.solve(hand, ball(radius, [center[0], 0, center[1]]), command())

    def gap(q):
        pivot, heading, best = np.zeros(2), 0.0, np.inf
        for angle, length in zip((q, ratio * q), lengths, strict=True):
            heading += angle
            run = np.array([np.cos(heading), np.sin(heading)])
            t = np.clip((center - pivot) @ run, 0.0, length)
            best = min(best, np.linalg.norm(center - pivot - t * run) - thick - radius)
            pivot = pivot + length * run
        return best

    grid = np.linspace(0.0, 2.0, 20001)
    after = next(i for i, q in enumerate(grid) if gap(q) < 0.0)
    expected = brentq(gap, grid[after - 1], grid[after], xtol=1e-15)
    assert solution.joint_angles["index_0"] == pytest.approx(expected, abs=EXACT)
    assert solution.joint_angles["index_1"] == pytest.approx(ratio * expected, abs=EXACT)


def test_axis_that_turns_between_joints_gives_axis_groups_of_their_own():
    """A posture joint yaws the distal half: its circle is cut by a plane through the yawed finger."""
    yaw, radius, thick = 0.4, 0.02, 0.006
    roles = [clench.JointRole.CLOSING, clench.JointRole.POSTURE, clench.JointRole.CLOSING]
    base = Shape(ShapeKind.BOX, (0.025, 0.006, thick), Pose([0.025, 0.0, 0.0]))
    links, axes = [base, None, along_x(thick, 0.06)], [-Y, [0.0, 0.0, 1.0], -Y]
    builder = HandBuilder().finger("index", links, [0.05, 0.0, 0.06], axes=axes, roles=roles)
    distance, angle = 0.045, 1.0
    across = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    center = np.array([0.05, 0.0, 0.0]) + distance * (np.cos(angle) * across + np.sin(angle) * np.array([0, 0, 1.0]))
    wall = clench.GraspObject.load("box:x=0.01,y=0.1,z=0.002", pose=Pose([0.025, 0.0, thick + 0.001]))
    obj = ball(radius, center)
    obj = obj.with_body(clench.Body("wall", wall.bodies[0].moved(obj.pose.inverse() @ wall.pose).shapes))
    solution = clench.solve(builder.hand(), obj, command(preshape={"index_1": yaw}, planes=5))
    assert solution.joint_angles["index_0"] == pytest.approx(0.0, abs=EXACT)
    expected = angle - np.arcsin((radius + thick) / distance)
    assert solution.joint_angles["index_2"] == pytest.approx(expected, abs=EXACT)


@pytest.mark.parametrize("kind", ["capsule", "cylinder"])
@pytest.mark.parametrize("full_width", [True, False])
@pytest.mark.parametrize("place", [(0.0, 0.0, 0.09), (-0.04, -0.006, 0.09), (0.01, 0.0, 0.03), (0.022, 0.003, 0.02)])
def test_a_rod_almost_in_the_planes_is_met_where_one_in_them_is(kind, full_width, place):
    """Its section is a part of an ellipse that may be kilometres long; the finger stops at the part alone."""
    box = Shape(ShapeKind.BOX, (0.0145, 0.0045, 0.0056), Pose([0.016, 0, 0]))
    obj = clench.GraspObject.load(f"{kind}:r=0.006,h=0.04", pose=Pose(place))
    angles = []
    for tilt in (0.0, 1e-10, 1e-9, 4e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3):
        axis = turned(X, tilt) @ -Y
        hand = HandBuilder().finger("index", [box], [0.03], axes=[axis], upper=2.2).hand()
        solution = clench.solve(hand, obj, command(planes=3, full_width=full_width))
        angles.append(solution.joint_angles["index_0"])
        assert angles[-1] == pytest.approx(angles[0], abs=5.0 * tilt + 1e-8)
    assert (angles[0] == 2.2) == (place[2] > 0.05)


@pytest.mark.parametrize("thing", ["object", "link"])
def test_a_short_capsule_across_the_planes(thing):
    """Both of its caps reach to the plane through its middle: three disks of one shape."""
    half = np.sqrt(0.5)
    across = Pose([0.03, 0.0, 0.04], wxyz=[half, half, 0, 0])
    if thing == "object":
        hand = HandBuilder().finger("index", [along_x(0.006, 0.05)], [0.05], upper=2.0).hand()
        solution = clench.solve(hand, clench.GraspObject.load("capsule:r=0.01,h=0.012", pose=across), command(planes=5))
        expected = np.arctan2(0.04, 0.03) - np.arcsin(0.016 / 0.05)
        assert solution.joint_angles["index_0"] == pytest.approx(expected, abs=EXACT)
    else:
        hand = HandBuilder().finger("index", [along_x(0.0064, 0.01)], [0.01], axes=[[1.0, 0, 0]], upper=2.0).hand()
        assert clench.solve(hand, ball(0.01, (0.0, 0.0, 0.05)), command(planes=5)).joint_angles["index_0"] == 2.0


def test_an_arena_has_room_for_the_sections_of_short_capsules():
    from clench.kernels.closing.layout import RoundArrays
    from clench.kernels.sections.plane_sections import cut_rounds, make_sections

    pose = turned(X, np.pi / 2.0)
    rounds = RoundArrays(np.array([1]), np.array([[0.01, 0.006, 0.0]]), np.column_stack([pose, np.zeros(3)])[None])
    sections = make_sections(1, 0, 1)
    cut_rounds(rounds, np.eye(4)[:3].copy(), 0.0, 0, sections, np.empty((3, 4)))
    assert sections.counts[0, 1] == 3 <= sections.disks.shape[1] == sections.disk_sources.shape[1]
