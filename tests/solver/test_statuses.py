"""Whatever the object is and wherever it stands, the answer is a status with a reason whose numbers are true."""

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, along_x, mount, one_link, three_links, turned
from clench.core.pose import Pose
from clench.models.hand.hand import JointRole
from clench.models.shapes import Shape, ShapeKind

Y, Z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
HALF = np.sqrt(0.5)


def command(**changes):
    return clench.GraspCommand(**{"hand_pose": Pose.identity(), "planes": 5, "preshape": "open", **changes})


def palm_and_finger():
    palm = Shape(ShapeKind.BOX, (0.04, 0.03, 0.01), Pose([0, 0, -0.01]))
    builder = HandBuilder(palm)
    return builder.finger(
        "index", [along_x(0.007, 0.05), along_x(0.007, 0.04)], [0.05, 0.04], base=mount((0.05, 0, 0))
    ).hand()


def test_out_of_reach_of_every_finger():
    ball = far_ball()
    solution = clench.solve(three_links(upper=1.2), ball, command())
    assert solution.status == "no_contact"
    assert solution.fingers["index"].status == "limit"
    assert "index" in solution.reason["text"]
    assert solution.contacts == ()
    assert set(solution.joint_angles.values()) == {1.2}
    assert solution.max_penetration == 0.0
    assert not solution.is_valid()


def test_a_finger_that_curls_into_itself_stops_there():
    ball = clench.GraspObject.load("sphere:r=0.01", pose=Pose([1.0, 0, 0]))
    solution = clench.solve(three_links(), ball, command())
    assert solution.status == "no_contact"
    assert "stopped by the hand's own index_link_0" in solution.fingers["index"].reason
    assert solution.contacts == ()
    assert solution.joint_angles["index_1"] < 3.0
    assert solution.certified


def test_a_finger_stopped_by_a_fine_link_of_its_own_near_a_coarse_object():
    """A link has many more elements than the object has triangles."""
    fine = Shape(ShapeKind.MESH, mesh=along_x(0.006, 0.04).to_mesh(1e-5))
    shapes = [fine, along_x(0.006, 0.03), along_x(0.006, 0.04)]
    hand = HandBuilder().finger("index", shapes, [0.04, 0.03, 0.04], upper=2.6).hand()
    corners = np.array([[1.0, 0, 0], [1.01, 0, 0], [1.0, 0.01, 0], [1.0, 0, 0.01]])
    obj = clench.GraspObject.from_meshes([(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])])
    solution = clench.solve(hand, obj, command())
    assert "index_link_0" in solution.fingers["index"].reason


def far_ball():
    return clench.GraspObject.load("sphere:r=0.01", pose=Pose([1.0, 0, 0]))


def test_coupled_links_stop_each_other():
    """Three links of one degree of freedom curl until the last meets the first."""
    shapes = [along_x(0.006, 0.04), along_x(0.006, 0.03), along_x(0.006, 0.04)]
    builder = HandBuilder().finger("index", shapes, [0.04, 0.03, 0.04], upper=2.6)
    hand = builder.couple("index_0", "index_1", 1.0).couple("index_0", "index_2", 1.0).hand()
    solution = clench.solve(hand, far_ball(), command())
    assert solution.certified
    assert solution.joint_angles["index_0"] < 2.5
    assert "index_link_0" in solution.fingers["index"].reason


@pytest.mark.parametrize("role", [JointRole.CLOSING, JointRole.POSTURE])
def test_nothing_is_certified_around_a_finger_that_rests_in_the_object(role):
    builder = HandBuilder().finger("a", [along_x(0.006, 0.05)], [0.05])
    hand = builder.finger("b", [along_x(0.006, 0.05)], [0.05], base=mount((0, 0.05, 0)), roles=[role]).hand()
    ball = clench.GraspObject.load("sphere:r=0.01", pose=Pose([0.03, 0.05, 0]))
    solution = clench.solve(hand, ball, command(fingers=("a",)))
    assert not solution.certified
    assert "b_link_0" in solution.certificate["text"]
    assert (solution.certificate["code"], solution.certificate["links"]) == ("blocked_at_start", ["b_link_0"])


def test_nothing_is_certified_where_resting_links_overlap():
    palm = Shape(ShapeKind.BOX, (0.01, 0.05, 0.01), Pose([0.06, 0, 0]))
    builder = HandBuilder(palm).finger("a", [along_x(0.006, 0.02)], [0.05])
    hand = builder.finger("b", [None, along_x(0.006, 0.07)], [0.01, 0.07], base=mount((0, 0.03, 0))).hand()
    solution = clench.solve(hand, far_ball(), command(fingers=("a",)))
    assert not solution.certified
    assert "b_link_1 overlaps palm" in solution.certificate["text"]
    assert "before anything moves" in solution.certificate["text"]
    certificate = solution.certificate
    assert (certificate["code"], certificate["links"]) == ("self_collision_at_start", ["b_link_1", "palm"])


def test_nothing_is_certified_for_links_that_overlap_before_they_move(tmp_path):
    palm = Shape(ShapeKind.BOX, (0.01, 0.05, 0.01), Pose([0.06, 0, 0]))
    hand = HandBuilder(palm).finger("a", [None, along_x(0.006, 0.07)], [0.01, 0.07]).hand()
    solution = clench.solve(hand, far_ball(), command())
    assert not solution.certified
    assert solution.certificate["code"] == "self_collision_at_start"
    assert sorted(solution.certificate["links"]) == ["a_link_1", "palm"]
    assert solution.certificate["finger"] == "a"
    solution.save(tmp_path / "s.json")
    assert clench.GraspSolution.load(tmp_path / "s.json").certificate == solution.certificate


@pytest.mark.parametrize(("full_width", "code"), [(True, "certified"), (False, "one_plane")])
def test_the_certificate_says_what_it_is_about(full_width, code):
    solution = clench.solve(three_links(upper=1.2), far_ball(), command(full_width=full_width))
    assert solution.certificate["code"] == code
    assert solution.certified == (code == "certified")


def test_a_touch_of_joints_that_cancel_blocks():
    """A parallelogram comes down on a point that it touches: the link keeps its direction, and still presses."""
    point = 5.0 * np.array([[0, 0, 0], [2, 2, 10], [-2, 2, 10], [-2, -2, 10], [2, -2, 10]]) / 1000
    link = Shape(ShapeKind.BOX, (0.1, 0.05, 0.025), Pose([0.1, 0, 0]))
    builder = HandBuilder().finger("a", [None, link], [0.2, 0.2], lower=-3.0).couple("a_0", "a_1", -1.0)
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1], [1, 4, 3], [1, 3, 2]])
    obj = clench.GraspObject.from_meshes([(point, faces)], pose=Pose([0.3, 0.04, 0.025]))
    solution = clench.solve(builder.hand(), obj, command(planes=1))
    assert solution.joint_angles["a_0"] < 1e-7


def test_a_finger_without_travel_cannot_move():
    hand = HandBuilder().finger("index", [along_x(0.007, 0.05)], [0.05], upper=0.0).hand()
    solution = clench.solve(hand, clench.GraspObject.load("sphere:r=0.01", pose=Pose([0.03, 0, 0.05])), command())
    assert solution.fingers["index"].status == "no_motion"
    assert solution.status == "no_contact"


@pytest.mark.parametrize(
    ("text", "position", "link"),
    [
        ("sphere:r=0.01", [0.03, 0.0, 0.005], "index_link_0"),
        ("box:x=0.03,y=0.03,z=0.03", [0.12, 0.0, 0.0], "index_link_2"),
        ("box:x=0.002,y=0.1,z=0.0005", [0.02, 0.0, 0.0], "index_link_0"),
        ("ellipsoid:a=0.001,b=0.002,c=0.001", [0.07, 0.0, 0.0], "index_link_1"),
    ],
    ids=["ball", "tip in a box", "blade in a thick finger", "bead inside the finger"],
)
def test_finger_that_starts_inside_is_blocked_with_link_and_depth(text, position, link):
    solution = clench.solve(three_links(), clench.GraspObject.load(text, pose=Pose(position)), command())
    finger = solution.fingers["index"]
    assert (solution.status, finger.status) == ("blocked", "blocked")
    assert solution.reason["link"] == link
    assert solution.reason["depth"] > 1e-4
    assert link in finger.reason
    assert "mm" in finger.reason
    assert solution.contacts == ()
    assert set(solution.joint_angles.values()) == {0.0}
    assert not solution.is_valid()


@pytest.mark.parametrize(
    "rotation", [[1, 0, 0, 0], [HALF, HALF, 0, 0], [HALF, 0, HALF, 0], [0.96, 0.16, 0.2, 0.107703]]
)
@pytest.mark.parametrize(
    "text",
    [
        "cylinder:r=0.3,h=0.8",
        "capsule:r=0.3,h=0.8",
        "box:x=0.8,y=0.8,z=0.8",
        "sphere:r=0.4",
        "ellipsoid:a=0.4,b=0.3,c=0.5",
    ],
)
def test_finger_wholly_inside_is_blocked(text, rotation):
    """No curve crosses there: only a test of inside tells."""
    obj = clench.GraspObject.load(
        text, pose=Pose([0.02, 0.01, 0.03], wxyz=np.array(rotation) / np.linalg.norm(rotation))
    )
    solution = clench.solve(one_link(), obj, command(planes=1))
    assert solution.status == "blocked"
    # More than the link's own size, which is as much as is measured.
    assert solution.reason["depth"] > 0.05
    assert "by at least" in solution.reason["text"]


def test_one_blocked_finger_does_not_block_the_others():
    builder = HandBuilder().finger("index", [along_x(0.007, 0.05)], [0.05], base=mount((0, 0.03, 0)))
    hand = builder.finger("ring", [along_x(0.007, 0.05)], [0.05], base=mount((0, -0.03, 0))).hand()
    obj = clench.GraspObject.load("cylinder:r=0.008,h=0.03", pose=Pose([0.03, -0.03, 0.02], wxyz=[HALF, HALF, 0, 0]))
    thorn = clench.GraspObject.load("sphere:r=0.004").bodies[0].moved(obj.pose.inverse() @ Pose([0.03, 0.03, 0.005]))
    solution = clench.solve(hand, obj.with_body(thorn), command())
    assert solution.status == "partial"
    assert {n: f.status for n, f in solution.fingers.items()} == {"index": "blocked", "ring": "touch"}
    assert solution.joint_angles["index_0"] == 0.0


def test_a_link_that_only_a_posture_joint_moves_blocks_its_finger():
    shapes = [Shape(ShapeKind.SPHERE, (0.02, 0, 0)), along_x(0.007, 0.05), along_x(0.007, 0.04)]
    roles = [clench.JointRole.POSTURE, clench.JointRole.CLOSING, clench.JointRole.CLOSING]
    hand = HandBuilder().finger("index", shapes, [0.03, 0.05, 0.04], axes=[Z, -Y, -Y], roles=roles).hand()
    solution = clench.solve(hand, clench.GraspObject.load("sphere:r=0.01", pose=Pose([0, 0, 0.015])), command())
    assert solution.fingers["index"].status == "blocked"
    assert solution.reason["link"] == "index_link_0"


def two_axis_groups():
    """Return a hand whose tip turns about an axis of its own, and is narrower than the link before it."""
    shapes = [Shape(ShapeKind.BOX, (0.025, y, 0.004), Pose([0.025, 0.0, 0.0])) for y in (0.012, 0.01)]
    axes = [-Y, turned(np.array([1.0, 0.0, 0.0]), 0.01) @ -Y]
    return HandBuilder().finger("index", shapes, [0.05, 0.05], axes=axes, upper=0.4).hand()


def test_a_plane_on_which_other_joints_bring_a_link_into_the_object_has_no_candidate():
    """On the outermost planes the first joint meets nothing: the tip is on none of them, but on those of its own."""
    hand, obj = two_axis_groups(), clench.GraspObject.load("sphere:r=0.02", pose=Pose([0.08, 0.0, 0.03]))
    index = clench.solve(hand, obj, command(planes=3, full_width=False)).fingers["index"]
    for c in (index.candidates[0], index.candidates[-1]):
        assert (c.status, c.feasible, c.contacts) == ("blocked", False, ())
        assert c.reason.startswith("index_link_1 overlaps sphere:r=0.02 on this plane, where joints about another axis")
        assert c.penetration is None
        assert c.joint_angles == {"index_0": 0.0, "index_1": 0.0}
    assert (index.status, index.chosen) == ("touch", len(index.candidates) // 2)


@pytest.mark.parametrize("tilt", [0.0, 1e-7, 3.7e-6, 1e-4, 1e-2])
@pytest.mark.parametrize("kind", [ShapeKind.BOX, ShapeKind.CAPSULE])
@pytest.mark.parametrize("place", [[0.08, 0.0, 0.03], [0.075, 0.004, 0.035], [0.09, -0.003, 0.028]])
def test_a_link_that_touched_holds_joints_about_another_axis_as_it_holds_those_about_the_same(tilt, kind, place):
    """Their plane shows it a little off the object or inside it; so does the one plane of a hand without tilt not."""
    box = Shape(kind, (0.025, 0.01, 0.004), Pose([0.025, 0.0, 0.0]))
    links = [box, box] if kind is ShapeKind.BOX else [along_x(0.004, 0.05)] * 2
    axes = [-Y, turned(np.array([1.0, 0.0, 0.0]), tilt) @ -Y]
    hand = HandBuilder().finger("index", links, [0.05, 0.05], axes=axes, upper=1.6).hand()
    obj = clench.GraspObject.load("sphere:r=0.02", pose=Pose(place))
    solution = clench.solve(hand, obj, command(planes=1, full_width=False))
    assert solution.fingers["index"].status == "touch"
    assert solution.joint_angles["index_1"] == 0.0
    assert {c.link for c in solution.contacts} == {"index_link_1"}
    assert clench.solve_batch(hand, obj, [Pose.identity()], command(planes=1, full_width=False)).status[0] == "grasp"


@pytest.mark.parametrize("text", ["cylinder:r=0.02,h=0.1", "ellipsoid:a=0.02,b=0.02,c=0.03"])
def test_the_full_width_is_not_spoiled_by_its_one_plane(text):
    """Swept as a polyhedron, it ends a little inside the round shape that the plane of the next axis group shows."""
    lying = Pose([0.08, 0.0, 0.03], wxyz=[HALF, HALF, 0.0, 0.0])
    obj = clench.GraspObject.load(text, pose=lying)
    for place in (0.0, 1e-3, 2.3e-3):
        index = clench.solve(two_axis_groups(), obj, command(planes=1, hand_pose=Pose([place, 0.0, 0.0]))).fingers[
            "index"
        ]
        assert (index.status, index.candidates[index.chosen].plane) == ("touch", None)


def test_what_a_link_would_be_brought_into_may_be_an_obstacle():
    obj = clench.GraspObject.load("sphere:r=0.005", pose=Pose([-0.1, 0.0, 0.03]))
    ball = clench.GraspObject.load("sphere:r=0.02", pose=Pose([0.08, 0.0, 0.03]))
    obj = obj.with_body(clench.Body("ball", ball.bodies[0].moved(obj.pose.inverse() @ ball.pose).shapes))
    index = clench.solve(two_axis_groups(), obj, command(planes=2, full_width=False)).fingers["index"]
    assert index.status == "blocked"
    assert index.cause["other"] == "sphere:r=0.005 or an obstacle"
    assert "overlaps sphere:r=0.005 or an obstacle on this plane" in index.reason


def test_a_finger_without_a_candidate_on_any_plane_does_not_move():
    hand, obj = two_axis_groups(), clench.GraspObject.load("sphere:r=0.02", pose=Pose([0.08, 0.0, 0.03]))
    asked = command(planes=2, full_width=False)
    solution = clench.solve(hand, obj, asked)
    assert (solution.status, solution.fingers["index"].status) == ("no_contact", "blocked")
    assert set(solution.joint_angles.values()) == {0.0}
    cause = solution.fingers["index"].cause
    assert (cause["code"], cause["link"]) == ("blocked_on_the_way", "index_link_1")
    said = "joints of index about another axis would bring index_link_1 into sphere:r=0.02"
    assert cause["text"] == f"On the plane, {said}: close over the full width."
    assert solution.certificate["code"] == "one_plane"
    batch = clench.solve_batch(hand, obj, [asked.hand_pose], asked)
    assert (batch.status[0], batch.finger_status[0, 0]) == ("no_contact", "blocked")
    assert not batch.joint_angles.any()
    assert clench.solve(hand, obj, command(planes=2)).status == "grasp"


@pytest.mark.parametrize(
    ("text", "position"),
    [
        ("sphere:r=0.02", [0, 0, 0.01]),
        ("box:x=0.03,y=0.02,z=0.02", [0, 0.01, 0.005]),
        ("cylinder:r=0.01,h=0.05", [0.01, 0, 0.004]),
    ],
)
def test_the_retreat_of_an_overlapping_palm_frees_it(text, position):
    obj, hand = clench.GraspObject.load(text, pose=Pose(position)), palm_and_finger()
    solution = clench.solve(hand, obj, command())
    assert solution.status == "blocked"
    assert solution.reason["link"] == "palm"
    assert solution.reason["depth"] > 0.001
    retreat = solution.reason["retreat"]
    back = clench.solve(hand, obj, command(hand_pose=Pose([0, 0, -retreat - 1e-7])))
    assert back.status != "blocked"
    assert clench.solve(hand, obj, command(hand_pose=Pose([0, 0, -retreat + 1e-5]))).status == "blocked"


@pytest.mark.parametrize("tilt", [0.3, 1.3])
def test_blades_stop_a_finger_however_thin(tilt):
    """A blade of thickness 0 is the limit: the answers come closer to each other in proportion to the thickness."""
    place = Pose.from_matrix(mount((0.03, 0, 0.03), turned(Y, tilt)))
    angles = []
    for thickness in (1e-5, 1e-7, 1e-9, 1e-12):
        obj = clench.GraspObject.load(f"box:x=0.04,y=0.1,z={thickness}", pose=place)
        solution = clench.solve(three_links(), obj, command())
        assert solution.status == "grasp"
        assert solution.max_penetration <= 1e-9
        angles.append(np.array(list(solution.joint_angles.values())))
    assert np.abs(angles[0] - angles[-1]).max() < 2e-3
    assert np.abs(angles[1] - angles[-1]).max() < 2e-5
    assert np.abs(angles[2] - angles[-1]).max() < 2e-7


SHEET = np.array([[0.02, -0.05, 0.02], [0.06, -0.05, 0.02], [0.06, 0.05, 0.02], [0.02, 0.05, 0.02]])


@pytest.mark.parametrize(
    "faces", [[[0, 1, 2], [0, 2, 3]], [[0, 2, 1], [0, 3, 2]], [[0, 1, 2], [0, 3, 2]]], ids=["up", "down", "mixed"]
)
def test_open_sheets_stop_a_finger_from_either_side(faces):
    """Winding means nothing on an open mesh; a sheet at z = 20 mm meets the link at its far corner or its near edge."""
    solution = clench.solve(one_link(0.005, 0.2), clench.GraspObject.from_meshes([(SHEET, faces)]), command())
    corner = np.array([0.06, 0.02])
    expected = np.arctan2(corner[1], corner[0]) - np.arcsin(0.005 / np.hypot(*corner))
    assert solution.joint_angles["index_0"] == pytest.approx(expected, abs=1e-9)
    assert solution.status == "grasp"


@pytest.mark.parametrize("faces", [[[0, 1, 2], [0, 2, 3]], [[0, 2, 1], [0, 3, 2]]], ids=["up", "down"])
def test_an_open_sheet_flush_with_a_link_between_the_planes_stops_it(faces):
    link = Shape(ShapeKind.BOX, (0.02, 0.01, 0.005), Pose([0.06, 0, 0]))
    hand = HandBuilder().finger("index", [link], [0.08]).hand()
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * 0.002 + [0.06, 0.006, 0.005]
    solution = clench.solve(hand, clench.GraspObject.from_meshes([(corners, faces)]), command(planes=1))
    assert solution.joint_angles["index_0"] == pytest.approx(0.0, abs=1e-9)
    assert solution.status == "grasp"


@pytest.mark.parametrize("gap", [0.0, 1e-15, 1e-12, 1e-6])
def test_a_link_slides_along_a_wall_beside_it(gap):
    """The wall is made of large triangles that the link enters as it goes; beyond them a bar stops it."""
    link = Shape(ShapeKind.BOX, (0.02, 0.01, 0.005), Pose([0.06, 0, 0]))
    hand = HandBuilder().finger("index", [link], [0.08]).hand()
    wall = clench.GraspObject.load("box:x=0.3,y=0.02,z=0.06").bodies[0].shapes[0].to_mesh()
    bar = clench.GraspObject.load("box:x=0.02,y=0.1,z=0.02").bodies[0].shapes[0].to_mesh()
    both = [
        (wall.vertices + np.array([0.0, 0.02 + gap, 0.035]), wall.triangles),
        (bar.vertices + np.array([0.0, 0.0, 0.07]), bar.triangles),
    ]
    alone = clench.solve(hand, clench.GraspObject.from_meshes(both[1:]), command())
    beside = clench.solve(hand, clench.GraspObject.from_meshes(both), command())
    assert alone.status == "grasp"
    assert beside.joint_angles["index_0"] == pytest.approx(alone.joint_angles["index_0"], abs=1e-9)


def test_triangles_without_area_change_nothing():
    box = clench.GraspObject.load("box:x=0.02,y=0.1,z=0.02").bodies[0].shapes[0].to_mesh()
    vertices = np.vstack([box.vertices, box.vertices[:1], 0.5 * (box.vertices[0] + box.vertices[1])])
    slivers = [[0, 1, 9], [0, 8, 3], [8, 0, 0]]
    place = Pose([0.05, 0.0, 0.04])
    plain = clench.GraspObject.from_meshes([(box.vertices, box.triangles)], pose=place)
    worse = clench.GraspObject.from_meshes([(vertices, np.vstack([box.triangles, slivers]))], pose=place)
    a, b = (clench.solve(three_links(), obj, command()) for obj in (plain, worse))
    assert a.joint_angles == pytest.approx(b.joint_angles, abs=1e-9)
    assert b.status == "grasp"


@pytest.mark.parametrize("shift", [0.0, 1e-15, -1e-13, 1e-12])
def test_vertices_on_the_curl_planes(shift):
    """A grid whose rows of vertices lie in the planes, to rounding; a flat plate has one answer."""
    hand = one_link(0.007, 0.2)
    plain = clench.GraspObject.load("box:x=0.04,y=0.2,z=0.02", pose=Pose([0.05, 0, 0.03]))
    offsets = [
        c.offset for c in clench.solve(hand, plain, command()).fingers["index"].candidates if c.offset is not None
    ]
    rows = np.array([-0.02, *offsets, 0.02]) + shift
    vertices = np.array([[x, y, 0.02] for x in (0.03, 0.05, 0.07) for y in rows])
    n = len(rows)
    squares = [(i * n + j, (i + 1) * n + j, (i + 1) * n + j + 1, i * n + j + 1) for i in range(2) for j in range(n - 1)]
    faces = [t for a, b, c, d in squares for t in ((a, c, b), (a, d, c))]
    solution = clench.solve(hand, clench.GraspObject.from_meshes([(vertices, faces)]), command())
    corner = np.array([0.07, 0.02])
    for candidate in solution.fingers["index"].candidates:
        offset = 0.0 if candidate.offset is None else candidate.offset
        thick = np.sqrt(0.007**2 - offset**2)
        expected = np.arctan2(corner[1], corner[0]) - np.arcsin(thick / np.hypot(*corner))
        assert candidate.joint_angles["index_0"] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("size", [1e-6, 1e-4, 1e3])
def test_objects_much_smaller_or_larger_than_the_finger(size):
    """A speck in front of the finger stops it; a wall larger than everything does too."""
    lower = 0.02
    obj = clench.GraspObject.load(f"box:x={size},y={max(size, 0.02)},z={size}", pose=Pose([0.05, 0, lower + size / 2]))
    solution = clench.solve(one_link(0.007, 0.1), obj, command(planes=1))
    assert solution.status == "grasp"
    if size < 1.0:
        corner = np.array([0.05 + size / 2, lower])
        expected = np.arctan2(corner[1], corner[0]) - np.arcsin(0.007 / np.hypot(*corner))
    else:
        expected = np.arcsin((lower - 0.007) / 0.1)
    assert solution.joint_angles["index_0"] == pytest.approx(expected, abs=1e-9)


def test_an_obstacle_stops_a_finger_but_is_no_grasp():
    obj = clench.GraspObject.load("sphere:r=0.01", pose=Pose([0.5, 0, 0.5]))
    wall = (
        clench.GraspObject.load("box:x=0.05,y=0.1,z=0.01").bodies[0].moved(obj.pose.inverse() @ Pose([0.05, 0, 0.04]))
    )
    from dataclasses import replace

    wall = replace(wall, role=clench.BodyRole.OBSTACLE, name="table")
    solution = clench.solve(three_links(), obj.with_body(wall), command())
    assert solution.status == "no_contact"
    assert solution.fingers["index"].status == "limit"
    assert "table" in solution.fingers["index"].reason
