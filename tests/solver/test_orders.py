"""Closing orders other than proximal first, breakaway, and rounds until rest: closed forms and what they promise."""

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, along_x, mount, three_links, turned
from clench.core.pose import Pose
from clench.execution.trajectory import plan_trajectory
from clench.models.hand.hand import JointRole
from clench.models.shapes import Shape, ShapeKind
from clench.solver.alternatives import finger_candidates
from clench.solver.orders import best_order
from clench.solver.problem import make_problem
from handmade import make_solution

RADIUS = 0.007


def solve(hand, obj, **changes):
    return clench.solve(
        hand, obj, clench.GraspCommand(hand_pose=Pose.identity(), planes=3, **{"preshape": "open", **changes})
    )


def bar(x, z, r=0.004):
    """Return a rod across the finger, along y: a capsule, which is swept as it is."""
    half = np.sqrt(0.5)
    return clench.GraspObject.load(f"capsule:r={r},h=0.1", pose=Pose([x, 0, z], wxyz=[half, half, 0, 0]))


def angle_to_bar(x, z, r=0.004):
    """Return at which turn a straight capsule from the origin along x touches the rod."""
    return np.arctan2(z, x) - np.arcsin((RADIUS + r) / np.hypot(x, z))


def angles(solution):
    return np.array(list(solution.joint_angles.values()))


def test_a_contact_holds_the_joints_before_it_and_the_others_go_on():
    solution = solve(three_links(upper=1.2), bar(0.03, 0.02), order="together")
    first = angle_to_bar(0.03, 0.02)
    q = angles(solution)
    assert q[0] == pytest.approx(first, abs=1e-7)
    assert solution.contacts[0].stops_joint == "index_0"
    assert (q[1:] > first).all()
    assert solution.certified


def test_speeds_set_the_path():
    """The far link leads: with the distal joint slow, the first link touches alone; every joint stops in proportion."""
    free = clench.GraspObject.load("sphere:r=0.01", pose=Pose([1.0, 0, 0]))
    hand = three_links(upper=1.0)
    assert angles(solve(hand, free, order="together", speeds={"index_0": 3.0})) == pytest.approx([1.0, 1.0, 1.0])
    tip = solve(three_links(upper=2.0), bar(0.1, 0.03), order="together", speeds={"index_1": 0.25, "index_2": 0.125})
    q = angles(tip)
    assert tip.contacts[0].link == "index_link_2"
    assert q[1] == pytest.approx(0.25 * q[0], rel=1e-12)
    assert q[2] == pytest.approx(0.125 * q[0], rel=1e-12)


@pytest.mark.parametrize(("short", "touches"), [(1e-10, True), (2e-8, False)])
@pytest.mark.parametrize("speed", [1.0, 100.0])
def test_a_limit_just_short_of_a_contact_is_no_touch_however_fast(short, touches, speed):
    angle = angle_to_bar(0.03, 0.02)
    hand = HandBuilder().finger("index", [along_x(RADIUS, 0.05)], [0.05], upper=angle - short).hand()
    solution = solve(hand, bar(0.03, 0.02), order="together", speeds={"index_0": speed})
    assert bool(solution.contacts) == touches


def test_only_the_tip_counts():
    hand = three_links(upper=1.2)
    missed = solve(hand, bar(0.03, 0.02), order="fingertip")
    assert missed.fingers["index"].status == "missed"
    assert missed.status == "no_contact"
    assert "index_link_0" in missed.fingers["index"].reason
    touched = solve(hand, bar(0.09, 0.03), order="fingertip")
    assert touched.fingers["index"].status == "touch"
    assert [c.link for c in touched.contacts] == ["index_link_2"]


def breaking(breaks):
    """Return a finger whose second joint follows the first, and may break away from it."""
    shapes = [along_x(RADIUS, 0.05), along_x(RADIUS, 0.04)]
    builder = HandBuilder().finger("index", shapes, [0.05, 0.04], upper=2.0)
    return builder.couple("index_0", "index_1", 0.5, breakaway=breaks).hand()


def test_the_distal_joint_goes_on_when_the_proximal_one_is_blocked():
    rod = bar(0.03, 0.02)
    first = angle_to_bar(0.03, 0.02)
    rigid, loose = (angles(solve(breaking(b), rod)) for b in (False, True))
    assert rigid == pytest.approx([first, 0.5 * first], abs=1e-7)
    assert loose[0] == pytest.approx(first, abs=1e-7)
    # It goes on with the actuator, up to the actuator's limit.
    assert loose[1] == pytest.approx(0.5 * 2.0, abs=1e-9)


def test_a_link_that_broke_away_stops_at_its_own_contact():
    rods = [(0.03, 0.02), (0.055, 0.035)]
    obj = clench.GraspObject.from_shape(bar(*rods[0]).bodies[0].shapes[0], pose=bar(*rods[0]).pose, name="rods")
    solution = solve(breaking(True), obj)
    both = clench.GraspObject.from_meshes([two_bars(rods)])
    solution = solve(breaking(True), both)
    assert [c.stops_joint for c in solution.contacts] == ["index_0", "index_1"]
    assert [c.link for c in solution.contacts] == ["index_link_0", "index_link_1"]
    assert max(abs(c.gap) for c in solution.contacts) < 1e-9
    assert solution.certified


def two_bars(places):
    """Return square rods along y as one mesh."""
    vertices, triangles = [], []
    for n, (x, z) in enumerate(places):
        mesh = clench.GraspObject.load("box:x=0.006,y=0.1,z=0.006").bodies[0].shapes[0].to_mesh()
        vertices.append(mesh.vertices + np.array([x, 0, z]))
        triangles.append(mesh.triangles + 8 * n)
    return np.vstack(vertices), np.vstack(triangles)


@pytest.mark.parametrize("order", ["together", "proximal-first"])
def test_rounds_until_rest_end(order):
    rounds = 1 if order == "together" else 0
    solution = solve(three_links(upper=1.5), bar(0.06, 0.02), order=order, rounds=rounds)
    again = solve(three_links(upper=1.5), bar(0.06, 0.02), order=order, rounds=rounds)
    assert solution.certified
    assert (angles(solution) == angles(again)).all()


def facing(apart):
    """Return two fingers, one above the other, that close towards each other."""
    shapes, lengths = [along_x(RADIUS, 0.05), along_x(RADIUS, 0.04)], [0.05, 0.04]
    builder = HandBuilder().finger("index", shapes, lengths, upper=1.5)
    down = [np.array([0.0, 1.0, 0.0])] * 2
    return builder.finger("thumb", shapes, lengths, base=mount((0, 0, apart)), axes=down, upper=1.5, thumb=True).hand()


def test_fingers_that_meet_on_their_way_hold_each_other():
    hand = facing(0.1)
    free = clench.GraspObject.load("sphere:r=0.01", pose=Pose([1.0, 0, 0]))
    solution = solve(hand, free, order="together")
    q = angles(solution)
    # Mirror images move alike and meet on the plane between them, where their distal links' highest points touch.
    assert q[:2] == pytest.approx(q[2:], abs=1e-6)
    assert q[0] == pytest.approx(q[1], abs=1e-12)
    tip = 0.05 * np.sin(q[0]) + 0.04 * np.sin(2.0 * q[0])
    assert tip + RADIUS == pytest.approx(0.05, abs=1e-8)
    assert solution.certified
    assert "thumb" in solution.fingers["index"].reason
    assert solution.contacts == ()


def test_fingers_that_overlap_before_they_move_are_not_certified():
    free = clench.GraspObject.load("sphere:r=0.01", pose=Pose([1.0, 0, 0]))
    assert not solve(facing(0.01), free, order="together").certified


def crossed():
    """Return two fingers whose bars cross like a plus sign; no edges are nearer than 0.5 mm."""
    bars = [
        Shape(ShapeKind.BOX, size, Pose([0.05, 0, z]))
        for size, z in (((0.05, 0.004, 0.004), 0.002), ((0.05, 0.006, 0.008), 0.0))
    ]
    builder = HandBuilder().finger("index", [bars[0]], [0.1], upper=1.5)
    base = mount((0.05, -0.05, 0.0), turned(np.array([0.0, 0.0, 1.0]), np.pi / 2))
    return builder.finger(
        "thumb", [bars[1]], [0.1], base=base, axes=[np.array([0.0, 1.0, 0.0])], upper=1.5, thumb=True
    ).hand()


def test_fingers_whose_sharp_links_cross_before_they_move_are_left_alone():
    free = clench.GraspObject.load("sphere:r=0.01", pose=Pose([1.0, 0, 0]))
    solution = solve(crossed(), free, order="together")
    assert solution.certificate["code"] == "self_collision_at_start"
    assert angles(solution) == pytest.approx([1.5, 1.5])
    assert "thumb" not in solution.fingers["index"].reason


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"order": "together", "rounds": 2}, "rounds"),
        ({"speeds": {"index_0": 0.0}}, "above 0"),
        ({"speeds": {"index_0": np.nan}}, "speeds.index_0"),
        ({"speeds": {"nothing": 1.0}}, "nothing"),
        ({"order": "sideways"}, "together"),
        ({"rounds": -1}, "at least 0"),
    ],
)
def test_what_makes_no_sense_is_refused(changes, words):
    with pytest.raises(clench.ClenchError, match=words):
        solve(three_links(), bar(0.03, 0.02), **changes)


LENGTHS = (0.05, 0.04)


def tilted(angle=0.7):
    """Return the builder of a finger whose second axis leans out of the direction of the first one."""
    axes = [[0.0, -1.0, 0.0], [np.sin(angle), -np.cos(angle), 0.0]]
    return HandBuilder().finger("index", [along_x(RADIUS, x) for x in LENGTHS], LENGTHS, axes=axes, upper=2.0)


def links_of(hand, q):
    """Return the two ends of every link's axis at a posture, shape (2, 2, 3)."""
    poses = hand.link_poses(np.asarray(q))[1:]
    return np.stack([poses[:, :3, 3], poses[:, :3, 3] + poses[:, :3, 0] * np.array(LENGTHS)[:, None]], axis=1)


def gap_to_ball(hand, q, ball, radius):
    """Return the gap of the finger to a ball [m]."""
    ends = links_of(hand, q)
    run = ends[:, 1] - ends[:, 0]
    t = np.clip(np.einsum("ij,ij->i", ball - ends[:, 0], run) / np.array(LENGTHS) ** 2, 0.0, 1.0)
    return np.linalg.norm(ends[:, 0] + t[:, None] * run - ball, axis=1).min() - RADIUS - radius


def first_touch(hand, ratio, ball, radius, limit=2.0):
    """Return the first travel at which the finger touches a ball, the second joint turning `ratio` as fast."""
    from scipy.optimize import brentq

    def gap(s):
        return gap_to_ball(hand, [s, ratio * s], ball, radius)

    grid = np.linspace(0.0, limit, 4001)
    after = next(k for k, s in enumerate(grid) if gap(s) < 0.0)
    return brentq(gap, grid[after - 1], grid[after], xtol=1e-15)


@pytest.mark.parametrize("ball", [(0.062, 0.004, 0.037), (0.029, 0.0, 0.042), (0.071, -0.008, 0.026)])
@pytest.mark.parametrize("how", ["together", "speeds", "coupled"])
def test_joints_that_are_not_parallel_move_at_once(ball, how):
    ratio = {"together": 1.0, "speeds": 0.8, "coupled": 0.6}[how]
    builder = tilted()
    hand = (builder.couple("index_0", "index_1", ratio) if how == "coupled" else builder).hand()
    obj = clench.GraspObject.load("sphere:r=0.008", pose=Pose(ball))
    order = {} if how == "coupled" else {"order": clench.ClosingOrder.TOGETHER}
    solution = solve(hand, obj, **order, **({"speeds": {"index_1": ratio}} if how == "speeds" else {}))
    expected = first_touch(hand, ratio, np.array(ball), 0.008)
    assert angles(solution)[0] == pytest.approx(expected, abs=1e-7)
    assert solution.certified
    assert 0.0 <= solution.contacts[0].gap <= 1e-9
    if how == "coupled" or solution.contacts[0].link == "index_link_1":
        assert angles(solution)[1] == pytest.approx(ratio * expected, abs=1e-7)
    (only,) = solution.fingers["index"].candidates
    assert only.plane is None


@pytest.mark.parametrize("ball", [(0.021, 0.009, 0.056), (0.029, 0.0, 0.042), (0.045, -0.006, 0.026)])
def test_joints_that_are_not_parallel_move_again_until_none_can(ball):
    hand, obj = tilted().hand(), clench.GraspObject.load("sphere:r=0.008", pose=Pose(ball))
    once, thrice, rest = (angles(solve(hand, obj, rounds=n)) for n in (1, 3, 0))
    assert (thrice >= once - 1e-12).all()
    assert (rest >= thrice - 1e-12).all()
    assert gap_to_ball(hand, rest, np.array(ball), 0.008) == pytest.approx(0.0, abs=1e-9)
    for k in range(2):
        further = rest.copy()
        further[k] += 1e-4
        assert gap_to_ball(hand, further, np.array(ball), 0.008) < 0.0


@pytest.mark.parametrize(
    ("changes", "what"),
    [({"order": clench.ClosingOrder.TOGETHER}, "order together"), ({"rounds": 0}, "rounds"), ({}, "coupled joints")],
)
def test_planes_alone_do_not_tell_of_joints_that_are_not_parallel(changes, what):
    hand = (tilted() if changes else tilted().couple("index_0", "index_1", 1.0)).hand()
    with pytest.raises(clench.ClenchError, match=f"{what}: finger 'index' closes about axes that are not parallel"):
        solve(hand, bar(0.03, 0.02), full_width=False, **changes)


@pytest.mark.parametrize("speeds", [{}, {"index_0": 2.0, "index_2": 0.5}])
def test_the_trajectory_moves_as_it_was_closed(speeds):
    """Between way-points joints go in proportion to their speeds, and each stops where it was held."""
    hand = three_links(upper=1.2)
    solution = solve(hand, bar(0.03, 0.02), order="together", speeds=speeds)
    positions = plan_trajectory(solution, hand).positions
    rate = np.array([speeds.get(name, 1.0) for name in hand.joint_names])
    ends = np.array(list(solution.joint_angles.values()))
    place = (positions / rate).max(axis=1)
    expected = np.minimum(place[:, None] * rate, ends)
    assert positions == pytest.approx(expected, abs=1e-12)
    assert positions[-1] == pytest.approx(ends, abs=0.0)
    assert len(set(np.round(ends / rate, 6))) > 1
    assert clench.GraspSolution.from_dict(solution.to_dict()).speeds == speeds


def test_links_that_rest_do_not_keep_fingers_from_meeting():
    """Fingers whose first links only the posture moves meet as those without such links do."""
    shapes, lengths = [along_x(RADIUS, 0.02), along_x(RADIUS, 0.05), along_x(RADIUS, 0.04)], [0.02, 0.05, 0.04]
    roles = [JointRole.POSTURE, JointRole.CLOSING, JointRole.CLOSING]
    builder = HandBuilder().finger("index", shapes, lengths, upper=1.5, roles=roles)
    down = [np.array([0.0, 1.0, 0.0])] * 3
    base = mount((0, 0, 0.1))
    hand = builder.finger("thumb", shapes, lengths, base=base, axes=down, upper=1.5, roles=roles, thumb=True).hand()
    free = clench.GraspObject.load("sphere:r=0.01", pose=Pose([1.0, 0, 0]))
    solution = solve(hand, free, order="together")
    q = solution.joint_angles["index_1"]
    assert q == pytest.approx(solution.joint_angles["thumb_2"], abs=1e-6)
    assert 0.05 * np.sin(q) + 0.04 * np.sin(2.0 * q) + RADIUS == pytest.approx(0.05, abs=1e-8)
    assert solution.certified


def test_followers_that_are_held_before_they_start_end_the_search_for_meetings():
    """A joint that breaks away from its coupling starts late, and its finger meets another one before."""
    shapes, lengths = [along_x(RADIUS, 0.05), along_x(RADIUS, 0.04)], [0.05, 0.04]
    builder = HandBuilder().finger("index", shapes, lengths, upper=1.5)
    builder.couple("index_0", "index_1", 1.0, -0.8, breakaway=True)
    down = [np.array([0.0, 1.0, 0.0])] * 2
    base = mount((0, 0, 0.06))
    hand = builder.finger("thumb", shapes, lengths, base=base, axes=down, upper=1.5, thumb=True).hand()
    free = clench.GraspObject.load("sphere:r=0.01", pose=Pose([1.0, 0, 0]))
    solution = solve(hand, free, order="together")
    assert solution.joint_angles["index_0"] < 0.8
    assert solution.joint_angles["index_1"] == 0.0
    assert solution.certified


def test_the_trajectory_lets_a_follower_wait_where_it_was_computed_to_wait():
    """A follower whose coupled angle lies below its limit stands still until the leader has brought it there."""
    shapes, lengths = [along_x(RADIUS, 0.05), along_x(RADIUS, 0.04)], [0.05, 0.04]
    hand = HandBuilder().finger("index", shapes, lengths, upper=1.5).couple("index_0", "index_1", 1.0, -0.8).hand()
    free = clench.GraspObject.load("sphere:r=0.01", pose=Pose([1.0, 0, 0]))
    positions = plan_trajectory(solve(hand, free, order="together"), hand).positions
    assert positions[:, 1] == pytest.approx(np.maximum(positions[:, 0] - 0.8, 0.0), abs=1e-12)
    assert positions[-1] == pytest.approx([1.5, 0.7])


def test_the_trajectory_does_not_take_a_joint_past_where_it_broke_away():
    """The distal joint leads, and goes on when the proximal one, which follows it, is blocked."""
    shapes, lengths = [along_x(RADIUS, 0.05), along_x(RADIUS, 0.04)], [0.05, 0.04]
    builder = HandBuilder().finger("index", shapes, lengths, upper=1.5)
    hand = builder.couple("index_1", "index_0", 1.0, breakaway=True).hand()
    solution = solve(hand, bar(0.03, 0.02))
    positions = plan_trajectory(solution, hand).positions
    first = solution.joint_angles["index_0"]
    assert first == pytest.approx(angle_to_bar(0.03, 0.02), abs=1e-7)
    assert positions[:, 0].max() == pytest.approx(first, abs=1e-12)
    assert positions[:, 0] == pytest.approx(np.minimum(positions[:, 1], first), abs=1e-9)


def test_a_finger_that_meets_a_resting_link_of_another_is_held_alone():
    """The thumb's first link only rests; what it holds is the finger that runs into it."""
    builder = HandBuilder().finger("index", [along_x(RADIUS, 0.05)], [0.05], upper=1.5)
    shapes, lengths = [along_x(RADIUS, 0.05), along_x(RADIUS, 0.01)], [0.05, 0.01]
    roles = [JointRole.POSTURE, JointRole.CLOSING]
    axes = [np.array([0.0, 1.0, 0.0])] * 2
    # The thumb's second link turns away from the index finger.
    axes[1] = -axes[1]
    base = mount((0.0, 0.0, 0.03))
    hand = builder.finger("thumb", shapes, lengths, base=base, axes=axes, upper=1.0, roles=roles, thumb=True).hand()
    free = clench.GraspObject.load("sphere:r=0.01", pose=Pose([1.0, 0, 0]))
    solution = solve(hand, free, order="together")
    assert 0.05 * np.sin(solution.joint_angles["index_0"]) + 2.0 * RADIUS == pytest.approx(0.03, abs=1e-8)
    assert solution.joint_angles["thumb_1"] == pytest.approx(1.0)
    assert "thumb_link_0" in solution.fingers["index"].reason
    assert solution.certified


def test_the_change_with_the_pose_is_not_guessed_for_paths_that_cannot_be_found_again():
    hand, rod = breaking(True), bar(0.03, 0.02)
    found = clench.sensitivity(solve(hand, rod), hand, rod)
    assert np.isinf(found.translation).all()
    assert np.isinf(found.rotation).all()
    assert all("break away" in found.reasons[name] for name in hand.joint_names)


def test_candidates_with_joints_that_break_away_are_judged_where_these_were_held():
    """The actuator goes to its limit on every plane; where the first joint was held tells the sets apart."""
    ball = clench.GraspObject.load("sphere:r=0.004", pose=Pose([0.03, 0.005, 0.02]))
    command = clench.GraspCommand(hand_pose=Pose.identity(), planes=3, check_candidates=True, preshape="open")
    (sets,) = finger_candidates(make_problem(breaking(True), ball, command))
    full = next(c for c in sets if c.plane is None)
    free = [c for c in sets if c.q[0] > full.q[0] + 1e-3]
    assert free
    assert not any(c.clear for c in free)
    across = solve(breaking(True), bar(0.03, 0.02), check_candidates=True).fingers["index"].candidates
    # The middle of a round link touches first; its own plane's set is the full width's.
    assert [c.feasible for c in across if c.plane in (1, None)] == [True, True]


def test_no_trajectory_is_made_up_where_joints_were_gone_through_again():
    """A straight line, or one round, could meet the object on the way."""
    hand = three_links(upper=1.5)
    solution = solve(hand, bar(0.06, 0.02), rounds=2)
    again = clench.GraspSolution.from_dict(solution.to_dict())
    assert again.rounds == 2
    with pytest.raises(clench.ClenchError, match="rounds"):
        plan_trajectory(again, hand)
    assert clench.complete(again, hand, bar(0.06, 0.02)).pregrasp is None


ORDERS = ("proximal-first", "together", "fingertip")
WEIGHTS = {"range_of_motion": 1.0, "touching_links": 0.1}


def summed(solution):
    """Return the weighted sum of the chosen sets' scores, worked out anew."""
    chosen = [f.candidates[f.chosen].scores for f in solution.fingers.values()]
    return sum(0.1 * s["touching_links"] - s["range_of_motion"] for s in chosen)


@pytest.mark.parametrize("orders", [ORDERS, ORDERS[::-1], ORDERS[1:]])
def test_of_several_orders_the_best_solution_is_kept(orders):
    pose = Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5])
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    command = clench.GraspCommand(hand_pose=pose, planes=1, criteria=WEIGHTS, orders=orders, preshape="open")
    alone = {
        o: clench.solve(hand, mug, clench.GraspCommand(pose, planes=1, criteria=WEIGHTS, order=o, preshape="open"))
        for o in orders
    }
    solution = clench.solve(hand, mug, command)
    said = solution.choice["orders"]
    statuses = ["grasp", "partial", "no_contact", "blocked"]
    best = max(
        orders, key=lambda o: (alone[o].is_valid(), -statuses.index(alone[o].status.value), round(summed(alone[o]), 9))
    )
    assert said["chosen"] == best
    assert solution.joint_angles == alone[best].joint_angles
    assert {o: c["total"] for o, c in said["compared"].items()} == pytest.approx({o: summed(alone[o]) for o in orders})
    assert {c.order for f in solution.fingers.values() for c in f.candidates} == {best}
    assert said["text"].startswith(f"{best} ")
    assert clench.GraspSolution.from_dict(solution.to_dict()).choice["orders"] == said


def test_a_touch_that_only_one_order_allows_wins():
    """The rod is met by the first link: with `fingertip` that is a miss, whatever the motion costs."""
    solution = solve(three_links(upper=1.2), bar(0.03, 0.02), orders=("fingertip", "together"))
    assert solution.choice["orders"]["chosen"] == "together"
    assert solution.choice["orders"]["text"] == (
        f"together comes before fingertip because it is a valid {solution.status.value}."
    )


def test_equal_orders_keep_the_first():
    free = clench.GraspObject.load("sphere:r=0.01", pose=Pose([1.0, 0, 0]))
    for orders in (("proximal-first", "together"), ("together", "proximal-first")):
        said = solve(three_links(upper=1.0), free, orders=orders).choice["orders"]
        assert said["chosen"] == orders[0]
        assert said["text"] == f"{orders[0]} and {orders[1]} score the same; the first goes before the second."


def test_an_order_that_the_hand_does_not_allow_is_left_out_and_said():
    builder = HandBuilder().finger(
        "index",
        [along_x(0.007, 0.04)] * 2,
        [0.04, 0.04],
        base=mount((0, 0, 0)),
        upper=1.2,
        axes=[[0, 1, 0], [0, 1, 0.3]],
    )
    hand, rod = builder.hand(), bar(0.03, 0.02)
    with pytest.raises(clench.ClenchError, match="not parallel"):
        solve(hand, rod, order="together", full_width=False)
    said = solve(hand, rod, orders=("together", "proximal-first"), full_width=False).choice["orders"]
    assert said["chosen"] == "proximal-first"
    assert "not parallel" in said["compared"]["together"]["refused"]
    assert said["text"] == "proximal-first is the only order that could be solved."
    with pytest.raises(clench.ClenchError, match="not parallel"):
        solve(hand, rod, orders=("together", "fingertip"), full_width=False)


def test_a_record_has_one_entry_and_an_error_of_the_pose_keeps_the_order(tmp_path):
    hand, rod = three_links(upper=1.2), bar(0.06, 0.02)
    command = clench.GraspCommand(
        hand_pose=Pose.identity(), planes=3, orders=("proximal-first", "together"), preshape="open"
    )
    with clench.Record(tmp_path / "r.sqlite") as record:
        solution = clench.solve(hand, rod, command, record=record)
        assert len(record) == 1
    report = clench.pose_error(hand, rod, command, 1e-3, 0.0, solution=solution)
    single = clench.GraspCommand(
        hand_pose=Pose.identity(), planes=3, order=solution.choice["orders"]["chosen"], preshape="open"
    )
    assert report.measured == pytest.approx(clench.pose_error(hand, rod, single, 1e-3, 0.0).measured)


def test_what_is_wrong_with_the_command_is_said_once():
    with pytest.raises(clench.ClenchError, match="preshape"):
        solve(three_links(), bar(0.03, 0.02), orders=("proximal-first", "together"), preshape={"index_0": 9.0})
    with pytest.raises(clench.ClenchError, match="steadines"):
        solve(three_links(), bar(0.03, 0.02), orders=("proximal-first",), criteria={"steadines": 1.0})


def test_an_order_without_a_value_is_not_inside_its_limit():
    """One needs more force than allowed, the other cannot hold at all: the first is the lesser evil."""
    force = {"weight": 0.0, "scale": 0.02, "limit": 0.05, "unit": "Nm/N", "better": "less", "source": "x"}
    strained = make_solution(
        choice={"criteria": {"actuation_force": force}, "final_hand_scores": {"actuation_force": 1}}
    )
    loose = make_solution(choice={"criteria": {}, "final_hand_scores": {}})
    found = {"proximal-first": loose, "together": strained}
    command = clench.GraspCommand(hand_pose=Pose.identity(), orders=tuple(found), preshape="open")
    said = best_order(command, lambda single: found[single.order]).choice["orders"]
    assert said["chosen"] == "together"
    assert said["text"] == "together comes before proximal-first because it has a value for every criterion."


@pytest.mark.parametrize("order", ["together", "fingertip"])
def test_fingers_that_touch_at_the_start_do_not_go_through_each_other(order):
    """The closed posture of a solve, in which fingers meet, is where another one begins."""
    hand, obj = clench.Hand.load("robonaut2"), clench.GraspObject.load("cylinder:r=0.004,h=0.2")
    followers, closed = {hand.joints[c.follower].name for c in hand.couplings}, 0
    for pose in clench.approach_poses(hand, obj, 8, 3):
        first = clench.solve(hand, obj, clench.GraspCommand(hand_pose=pose, preshape="open"))
        names = [j.name for j in hand.joints if j.role != "upstream" and j.name not in followers]
        start = {name: float(first.joint_angles[name]) for name in names}
        command = clench.GraspCommand(hand_pose=pose, preshape=start, order=clench.ClosingOrder(order))
        again = clench.solve(hand, obj, command)
        assert first.certified
        assert again.certified, again.certificate["text"]
        closed += 1
    assert closed == 8


def two_parallel(gap, lower):
    """Return a solve of two parallel capsules that close side by side, the upper one at 1 rad per unit.

    Args:
        gap: between them at the start [m]. lower: how fast and how far the lower one closes [rad].
    """
    half = np.sqrt(0.5)
    capsule = Shape(ShapeKind.CAPSULE, (0.007, 0.025, 0.0), Pose([0.075, 0.0, 0.0], wxyz=[half, 0.0, half, 0.0]))
    builder = HandBuilder().finger("lower", [capsule], [0.1], upper=lower)
    hand = builder.finger("upper", [capsule], [0.1], base=mount((0.0, 0.0, 0.014 + gap)), upper=1.0).hand()
    command = clench.GraspCommand(
        hand_pose=Pose([0.0, 0.0, -1.0]),
        preshape="open",
        planes=1,
        order=clench.ClosingOrder.TOGETHER,
        speeds={"lower_0": lower},
    )
    return clench.solve(hand, clench.GraspObject.load("sphere:r=0.01"), command)


@pytest.mark.parametrize("gap", [1e-12, 5e-12, 9e-12, 1e-9])
@pytest.mark.parametrize("speed", [0.2, 0.5, 0.8])
def test_fingers_that_touch_at_the_start_go_on_if_they_part(gap, speed):
    """The upper one is faster. At the least gaps links count as meeting."""
    assert list(two_parallel(gap, speed).joint_angles.values()) == pytest.approx([speed, 1.0], abs=1e-9)


@pytest.mark.parametrize("gap", [1e-12, 5e-12, 9e-12])
def test_fingers_that_touch_at_the_start_hold_each_other_if_they_do_not_part(gap):
    """The lower one is faster."""
    solution = two_parallel(gap, 1.5)
    assert list(solution.joint_angles.values()) == pytest.approx([0.0, 0.0], abs=1e-8)
    assert solution.certified
