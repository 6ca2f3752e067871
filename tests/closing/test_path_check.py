"""A path is free or not: judged by closed forms for capsules, and by depths at many postures for boxes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import clench
from chain_hands import HandBuilder, along_x, mount, turned
from clench.closing.collision.path_check import check_path, find_path_overlap, is_path_free, place_object
from clench.core.pose import FloatArray, Pose
from clench.models.hand.hand import Hand
from clench.models.hand.link_mesh import link_meshes, overlap_depth
from clench.models.objects.grasp_object import Body, BodyRole
from clench.models.shapes import CollisionSource, Shape, ShapeKind

SOURCE = CollisionSource.ENGINE
X, Y, Z = np.eye(3)
RADIUS, LENGTH = 0.006, 0.04
#: What a path may overlap by and still be free [m]; see `clench.kernels.toi.path_overlap`.
TOLERANCE = 1e-5
angles = st.lists(st.floats(-1.6, 1.6), min_size=4, max_size=4)


def two_chains(boxes: int = 0, apart: float = 0.05) -> Hand:
    """Return two fingers of two links each, whose axes are not parallel, so that they can meet anywhere.

    Args:
        boxes: end to end of each link; 0: it is a capsule. apart: of the fingers [m].
    """
    shape: Shape | tuple[Shape, ...] = along_x(RADIUS, LENGTH)
    if boxes:
        half = LENGTH / (2 * boxes)
        places = [Pose([(2 * k + 1) * half, 0.0, 0.0]) for k in range(boxes)]
        shape = tuple(Shape(ShapeKind.BOX, (half, RADIUS, RADIUS / 2), place) for place in places)
    builder = HandBuilder().finger("a", [shape, shape], [LENGTH, LENGTH], axes=[Y, Z], lower=-2.0)
    tilted = mount((0.0, apart, 0.01))
    return builder.finger("b", [shape, shape], [LENGTH, LENGTH], base=tilted, axes=[Z, Y], lower=-2.0).hand()


def segment_distance(p: FloatArray, u: FloatArray, q: FloatArray, v: FloatArray) -> float:
    """Distance of the segments p + s u and q + t v, s and t from 0 to 1: inside, or with one end in the other."""
    found = [np.inf]
    a, b, c, w = u @ u, u @ v, v @ v, p - q
    if a * c - b * b > 1e-15:
        s, t = np.linalg.solve([[a, -b], [b, -c]], [-u @ w, -v @ w])
        if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
            found.append(float(np.linalg.norm(w + s * u - t * v)))
    for end in (0.0, 1.0):
        t = np.clip((w + end * u) @ v / c, 0.0, 1.0)
        s = np.clip((end * v - w) @ u / a, 0.0, 1.0)
        found += [float(np.linalg.norm(w + end * u - t * v)), float(np.linalg.norm(w + s * u - end * v))]
    return min(found)


def capsule_depth(hand: Hand, q: FloatArray) -> float:
    """Deepest overlap of capsules of the two chains, and of links of one chain that do not follow each other."""
    poses = hand.link_poses(q)
    depths = []
    for i, j in ((1, 3), (1, 4), (2, 3), (2, 4)):
        (p, u), (r, v) = ((poses[k][:3, 3], poses[k][:3, 0] * LENGTH) for k in (i, j))
        depths.append(2 * RADIUS - segment_distance(p, u, r, v))
    return max(depths)


def box_depth(hand: Hand, q: FloatArray) -> float:
    meshes = {mesh.link: mesh for mesh in link_meshes(hand, SOURCE)}
    poses = hand.link_poses(q)
    return max(overlap_depth(meshes[i], meshes[j], poses) for i, j in ((1, 3), (1, 4), (2, 3), (2, 4)))


def along(path: FloatArray, place: float) -> FloatArray:
    k = min(int(place), len(path) - 2)
    return path[k] + (place - k) * (path[k + 1] - path[k])


@pytest.mark.parametrize("boxes", [0, 1, 2], ids=["capsules", "boxes", "pairs of boxes"])
@settings(max_examples=40, deadline=None)
@given(points=st.lists(angles, min_size=2, max_size=4))
@example(points=[[0.0, 0.0, -1.0, 0.0], [-1.0, 0.0, 0.0, 0.0]])  # edges cross, and are farther apart than they are deep
def test_a_free_path_has_no_overlap_and_the_first_one_is_found(boxes: int, points: list[list[float]]) -> None:
    hand, path = two_chains(boxes), np.array(points)
    depth = box_depth if boxes else capsule_depth
    if depth(hand, path[0]) > 0.0:
        return
    found = find_path_overlap(hand, path, SOURCE)
    end = float(len(path) - 1) if found is None else found.place
    before = [depth(hand, along(path, place)) for place in np.linspace(0.0, end, 150)[:-1]]
    assert max(before) <= TOLERANCE
    if found is not None:
        assert 1e-6 < depth(hand, along(path, found.place)) <= 2 * TOLERANCE
        assert not found.with_object
        # Farther on, the two are deeper in each other, or past each other.
        assert found.depth <= 2 * TOLERANCE


def test_a_thin_thing_is_not_stepped_over() -> None:
    """A finger turns by 2 rad past a needle 0.1 mm thick; postures at both ends are free."""
    hand = HandBuilder().finger("a", [along_x(RADIUS, LENGTH)], [LENGTH], lower=-2.0).hand()
    needle = clench.GraspObject.from_shape(
        Shape(ShapeKind.BOX, (5e-5, 0.1, 5e-5), Pose([0.03, 0.0, 0.0])), name="needle"
    )
    around = place_object(needle, np.eye(4))
    found = find_path_overlap(hand, np.array([[-1.0], [1.0]]), SOURCE, around)
    assert found is not None
    assert (found.link, found.other, found.with_object) == ("a_link_0", "needle", True)
    # The link's side is as far above the needle as its radius.
    clear = np.arcsin((RADIUS + 5e-5) / 0.03)
    assert 2.0 * found.place - 1.0 == pytest.approx(-clear, abs=2e-3)
    assert find_path_overlap(hand, np.array([[-1.0], [-1.01 * clear]]), SOURCE, around) is None


#: A cube, and its faces but for that towards z.
CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
OPEN = [[4, 6, 7], [4, 7, 5], [0, 1, 3], [0, 3, 2], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4]]


def test_a_link_that_touches_an_open_shell_from_within_is_in_it() -> None:
    """A closed surface has to be crossed; what lies inside an open one is said by the faces around."""
    hand = HandBuilder().finger("a", [along_x(RADIUS, LENGTH)], [LENGTH], axes=[Y]).hand()
    low = LENGTH + RADIUS - 5e-7
    shell = clench.GraspObject.from_meshes([([0.06, 0.06, 0.02] * CORNERS + [0.0, 0.0, 0.02 - low], np.array(OPEN))])
    found = find_path_overlap(hand, np.array([[0.0], [2.0]]), SOURCE, place_object(shell, np.eye(4)))
    assert found is not None
    # The tip goes through the bottom by half a micrometre. It is found where the sweep ends, just before.
    assert found.place < np.arcsin((low - RADIUS) / LENGTH) / 2.0


@pytest.mark.parametrize("gap", [0.0, 1e-9, 1e-7, 1e-6, 2e-6, 4e-6, 1e-5, 2e-5, 5e-5])
@pytest.mark.parametrize("shape", ["capsule", "box", "two boxes"])
def test_fingers_that_slide_along_each_other_are_free(shape: str, gap: float) -> None:
    """Side by side at a gap that never changes, for the whole motion, even where they touch."""
    shapes: dict[str, Shape | tuple[Shape, ...]] = {"capsule": along_x(RADIUS, LENGTH)}
    for name, count in (("box", 1), ("two boxes", 2)):
        half = LENGTH / (2 * count)
        places = [Pose([(2 * k + 1) * half, 0.0, 0.0]) for k in range(count)]
        shapes[name] = tuple(Shape(ShapeKind.BOX, (half, RADIUS, RADIUS), place) for place in places)
    builder = HandBuilder().finger("a", [shapes[shape]], [LENGTH])
    hand = builder.finger("b", [shapes[shape]], [LENGTH], base=mount((0.0, 2 * RADIUS + gap, 0.0))).hand()
    assert find_path_overlap(hand, np.array([[0.0, 0.0], [1.0, 0.4], [0.2, 1.2]]), SOURCE) is None


def test_links_that_overlap_at_the_start_may_part_but_not_come_back() -> None:
    builder = HandBuilder().finger("a", [along_x(RADIUS, LENGTH)], [LENGTH])
    leaning = mount((0.0, 2.5 * RADIUS, 0.0), turned(Z, -np.arcsin(RADIUS / LENGTH)))
    hand = builder.finger("b", [along_x(RADIUS, LENGTH)], [LENGTH], base=leaning, axes=[-Z]).hand()
    assert find_path_overlap(hand, np.array([[0.0, 0.0], [0.0, -0.5]]), SOURCE) is None
    back = find_path_overlap(hand, np.array([[0.0, 0.0], [0.0, -0.5], [0.0, 0.0]]), SOURCE)
    assert back is not None
    assert back.place > 1.0
    deeper = find_path_overlap(hand, np.array([[0.0, 0.0], [0.0, 0.5]]), SOURCE)
    assert deeper is not None
    assert {deeper.link, deeper.other} == {"a_link_0", "b_link_0"}


def test_way_points_on_a_straight_line_change_nothing() -> None:
    hand = two_chains(apart=0.02)
    ends = np.array([[0.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0]])
    many = np.array([along(ends, s) for s in np.linspace(0.0, 1.0, 11)])
    one, other = find_path_overlap(hand, ends, SOURCE), find_path_overlap(hand, many, SOURCE)
    assert one is not None
    assert other is not None
    assert other.place == pytest.approx(10.0 * one.place, rel=1e-9)
    assert (one.link, one.other) == (other.link, other.other)


def test_a_path_of_one_posture() -> None:
    hand = two_chains()
    assert find_path_overlap(hand, np.zeros((1, 4)), SOURCE) is None


def test_links_that_rub_against_each_other_for_long_end_the_proof() -> None:
    """Two links overlap at their bases in every posture, and turn a hundred times: no proof goes on for ever."""
    builder = HandBuilder().finger("a", [along_x(RADIUS, LENGTH)], [LENGTH])
    base = mount((0.0, 1.5 * RADIUS, 0.0))
    hand = builder.finger("b", [along_x(RADIUS, LENGTH)], [LENGTH], base=base, axes=[Y]).hand()
    path = np.array([[0.0, 0.0], [0.0, 600.0]])
    found = find_path_overlap(hand, path, SOURCE)
    assert found is not None
    assert np.isnan(found.depth)
    assert 0.0 < found.place < 1.0
    assert "cannot be proven that they stay apart" in found.sentence


def crowded() -> clench.GraspObject:
    """Return a box beside a finger, and a needle in its way."""
    box = clench.GraspObject.from_shape(Shape(ShapeKind.BOX, (0.01, 0.01, 0.01), Pose([0.05, 0.0, 0.03])), name="box")
    needle = Shape(ShapeKind.BOX, (5e-5, 0.1, 5e-5), Pose([0.03, 0.0, -0.02]))
    return replace(box, bodies=(*box.bodies, Body("needle", (needle,), BodyRole.OBSTACLE)))


@pytest.mark.parametrize("boxes", [0, 1, 2], ids=["capsules", "boxes", "pairs of boxes"])
@pytest.mark.parametrize("with_object", [False, True], ids=["alone", "object"])
def test_a_path_is_free_where_no_overlap_is_found_whatever_is_suspected(boxes: int, with_object: bool) -> None:
    hand, rng = two_chains(boxes), np.random.default_rng(7)
    around = place_object(crowded(), np.eye(4)) if with_object else None
    paths = [rng.uniform(-0.6, 0.6, (3, len(hand.joints))) for _ in range(40)]
    found = [find_path_overlap(hand, path, SOURCE, around) for path in paths]
    assert any(found)
    assert not all(found)
    suspects = [overlap for overlap in found[:5] if overlap is not None]
    for path, overlap in zip(paths, found, strict=True):
        known = list(suspects)
        assert is_path_free(hand, path, SOURCE, around, known) == (overlap is None)
        # A suspect that overlaps is known; another one is added.
        assert known in (suspects, [*suspects, overlap])
        assert is_path_free(hand, path, SOURCE, around, []) == (overlap is None)
        assert check_path(hand, path, SOURCE, around, suspects)[0] == overlap
        assert check_path(hand, path, SOURCE, around)[0] == overlap


@pytest.mark.parametrize("boxes", [0, 1, 2], ids=["capsules", "boxes", "pairs of boxes"])
def test_a_free_path_that_begins_without_an_overlap_is_free_backwards(boxes: int) -> None:
    hand, rng, free = two_chains(boxes), np.random.default_rng(11), 0
    around = place_object(crowded(), np.eye(4))
    for path in rng.uniform(-0.6, 0.6, (60, 2, len(hand.joints))):
        overlap, begun = check_path(hand, path, SOURCE, around)
        if overlap is None and not begun:
            free += 1
            assert find_path_overlap(hand, path[::-1], SOURCE, around) is None
    assert free > 5


def test_an_overlap_where_the_path_begins_is_told() -> None:
    builder = HandBuilder().finger("a", [along_x(RADIUS, LENGTH)], [LENGTH])
    leaning = mount((0.0, 2.5 * RADIUS, 0.0), turned(Z, -np.arcsin(RADIUS / LENGTH)))
    hand = builder.finger("b", [along_x(RADIUS, LENGTH)], [LENGTH], base=leaning, axes=[-Z]).hand()
    assert check_path(hand, np.array([[0.0, 0.0], [0.0, -0.5]]), SOURCE) == (None, True)
    assert check_path(hand, np.array([[0.0, -0.5], [0.0, -0.6]]), SOURCE) == (None, False)
    # Backwards, the links would meet.
    assert find_path_overlap(hand, np.array([[0.0, -0.5], [0.0, 0.0]]), SOURCE) is not None


def test_joints_that_move_neither_body_change_no_place() -> None:
    """A finger goes straight to a box, another one far away goes there and back: way-points of its own."""
    builder = HandBuilder().finger("a", [along_x(RADIUS, LENGTH)], [LENGTH], lower=-2.0)
    hand = builder.finger("b", [along_x(RADIUS, LENGTH)], [LENGTH], base=mount((0.0, 0.5, 0.0)), lower=-2.0).hand()
    around = place_object(crowded(), np.eye(4))
    straight = np.array([[0.0, 0.0], [1.5, 0.0]])
    shares = np.array([0.0, 0.1, 0.35, 0.5, 0.8, 1.0])
    busy = np.stack([1.5 * shares, [0.0, 0.3, -0.2, 0.4, 0.1, 0.0]], axis=1)
    one, other = (find_path_overlap(hand, path, SOURCE, around) for path in (straight, busy))
    assert one is not None
    assert other is not None
    assert (one.link, one.other) == (other.link, other.other) == ("a_link_0", "box")
    assert np.interp(other.place, np.arange(6), shares) == pytest.approx(one.place, abs=1e-12)
    assert other.depth == pytest.approx(one.depth, abs=1e-12)


def test_a_finger_that_slides_over_a_corner_is_followed_plane_by_plane() -> None:
    """A box link slides on the rim of a box: at every posture a depth judges, and 0.02 rad farther down it is in it."""
    link = Shape(ShapeKind.BOX, (LENGTH / 2, RADIUS, RADIUS / 2), Pose([LENGTH / 2, 0.0, 0.0]))
    hand = HandBuilder().finger("a", [link, link], [LENGTH, LENGTH], axes=[Y, Z], lower=-2.0).hand()
    rim = clench.GraspObject.from_shape(
        Shape(ShapeKind.BOX, (0.01, 0.1, 0.01), Pose([0.07, 0.0, 0.01 + RADIUS / 2])), name="rim"
    )
    around = place_object(rim, np.eye(4))
    slide = np.array([[0.0, -0.5], [0.0, 0.5]])
    assert find_path_overlap(hand, slide, SOURCE, around) is None
    found = [find_path_overlap(hand, slide + np.array([turn, 0.0]), SOURCE, around) for turn in (-0.02, 0.02)]
    assert sum(overlap is None for overlap in found) == 1
