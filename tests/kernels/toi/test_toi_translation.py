"""The first contact of a translation: by hand for each kind of event, by conservative advancement for any mesh."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from clench.kernels.toi.passing_planes import COLUMNS, PLANES
from clench.kernels.toi.toi_translation import PAIRS, first_contact
from clench.kernels.trees.bvh import build_tree, feature_owners
from clench.models.mesh import TriangleMesh
from kernels.kernel_solids import bounding_volumes, box, gap, hull, moved, star, torus


def travel(moving, rest, T, direction, limit=np.inf):
    one, two = build_tree(moving.vertices, moving.triangles), build_tree(rest.vertices, rest.triangles)
    return first_contact(
        one,
        feature_owners(one),
        np.ascontiguousarray(T[:3]),
        two,
        feature_owners(two),
        np.array(direction, dtype=float),
        limit,
        np.empty((PAIRS, 2), dtype=np.int32),
        np.empty((PLANES, COLUMNS)),
    )


def first_event(moving, rest, T, direction):
    """Return the least way after which two meshes touch, infinite for none: every corner, face and edge in turn.

    The corners and edges of the one are followed to the faces and edges of the other; each pair is a system of three
    equations.
    """
    one, two = moved(moving, T).vertices[moving.triangles], rest.vertices[rest.triangles]
    ways = [corners_to_faces(one.reshape(-1, 3), two, direction), corners_to_faces(two.reshape(-1, 3), one, -direction)]
    a, u = one.reshape(-1, 3), (np.roll(one, -1, axis=1) - one).reshape(-1, 3)
    c, v = two.reshape(-1, 3), (np.roll(two, -1, axis=1) - two).reshape(-1, 3)
    # a + s u + way d = c + r v
    s, r, way = solved(u[:, None], -v[None], direction, c[None] - a[:, None])
    ways.append(way[(s >= 0.0) & (s <= 1.0) & (r >= 0.0) & (r <= 1.0) & (way >= 0.0)])
    return min((w.min() for w in ways if w.size), default=np.inf)


def corners_to_faces(corners, faces, d):
    """Return the ways at which corners that move along d meet faces."""
    a, b, c = (faces[None, :, k] for k in range(3))
    # p + way d = a + s (b - a) + r (c - a)
    s, r, way = solved(b - a, c - a, -np.asarray(d), corners[:, None] - a)
    return way[(s >= 0.0) & (r >= 0.0) & (s + r <= 1.0) & (way >= 0.0)]


def solved(u, v, w, right):
    """Return the coefficients of u, v and w that give a vector, by Cramer's rule; not finite where there are none."""
    det = np.einsum("...i,...i", np.cross(u, v), w)
    with np.errstate(all="ignore"):
        return (
            np.einsum("...i,...i", np.cross(right, v), w) / det,
            np.einsum("...i,...i", np.cross(u, right), w) / det,
            np.einsum("...i,...i", np.cross(u, v), right) / det,
        )


def pose(x=0.0, y=0.0, z=0.0, rotation=None):
    T = np.eye(4)
    T[:3, 3] = x, y, z
    if rotation is not None:
        T[:3, :3] = rotation.as_matrix()
    return T


CORNER_DOWN = Rotation.align_vectors([[0, 0, -1]], [[1, 1, 1]])[0]
RIDGE_X = Rotation.from_euler("x", 45, degrees=True)
RIDGE_Y = Rotation.from_euler("y", 45, degrees=True)


@pytest.mark.parametrize(
    ("moving", "rest", "expected"),
    [
        (None, None, 9.0),
        (CORNER_DOWN, None, 9.5 - np.sqrt(3.0) / 2.0),
        (None, CORNER_DOWN.inv() * Rotation.from_euler("x", 180, degrees=True), None),
        (RIDGE_X, RIDGE_Y, 10.0 - np.sqrt(2.0)),
        (RIDGE_X, RIDGE_X, 10.0 - np.sqrt(2.0)),
        (RIDGE_X, None, 9.5 - np.sqrt(0.5)),
    ],
    ids=["face-face", "vertex-face", "face-vertex", "edge-edge", "parallel edges", "edge-face"],
)
def test_unit_boxes_falling(moving, rest, expected):
    below = box(1, 1, 1)
    if rest is not None:
        below = moved(below, pose(rotation=rest))
    if expected is None:
        expected = 9.5 - below.vertices[:, 2].max()
    distance, _, _ = travel(box(1, 1, 1), below, pose(z=10.0, rotation=moving), [0, 0, -1])
    assert distance == pytest.approx(expected, abs=1e-14)


def test_vertex_on_vertex():
    up = moved(box(1, 1, 1), pose(rotation=Rotation.align_vectors([[0, 0, 1]], [[1, 1, 1]])[0]))
    distance, _, _ = travel(box(1, 1, 1), up, pose(z=10.0, rotation=CORNER_DOWN), [0, 0, -1])
    assert distance == pytest.approx(10.0 - np.sqrt(3.0), abs=1e-12)


@pytest.mark.parametrize("aside", [0.0, 0.25, 0.999999])
def test_needle_and_blade_are_not_missed(aside):
    needle, blade = box(1e-6, 1e-6, 1.0), box(2.0, 1e-6, 1.0)
    assert travel(needle, blade, pose(x=aside, z=5.0), [0, 0, -1])[0] == pytest.approx(4.0, abs=1e-12)
    assert travel(blade, needle, pose(x=-aside, z=5.0), [0, 0, -1])[0] == pytest.approx(4.0, abs=1e-12)


def test_passing_by_through_a_hole_and_away():
    ring = torus(1.0, 0.3)
    assert travel(box(0.5, 0.5, 0.5), ring, pose(z=5.0), [0, 0, -1]) == (np.inf, -1, -1)
    assert travel(box(0.5, 0.5, 0.5), ring, pose(x=1.0, z=5.0), [0, 0, 1]) == (np.inf, -1, -1)
    assert travel(box(0.5, 0.5, 0.5), ring, pose(x=1.0, z=5.0), [0, 0, -1])[0] < 5.0
    nothing = TriangleMesh(np.empty((0, 3)), np.empty((0, 3)))
    assert travel(nothing, ring, pose(z=5.0), [0, 0, -1]) == (np.inf, -1, -1)


def test_limit_cuts_off_later_contacts_only():
    assert travel(box(1, 1, 1), box(1, 1, 1), pose(z=10.0), [0, 0, -1], 8.9) == (np.inf, -1, -1)
    assert travel(box(1, 1, 1), box(1, 1, 1), pose(z=10.0), [0, 0, -1], 9.1)[0] == pytest.approx(9.0)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_touching_at_the_start_is_no_travel(scale):
    assert travel(box(scale, scale, scale), box(scale, scale, scale), pose(z=scale), [0, 0, -1])[0] == 0.0
    # The same, with a rounding error of one unit in the last place.
    just_in = pose(z=np.nextafter(scale, 0.0))
    assert travel(box(scale, scale, scale), box(scale, scale, scale), just_in, [0, 0, -1])[0] == 0.0


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_touching_at_the_start_where_the_mesh_itself_holds_the_place(scale):
    """Of rounding there is as much as the coordinates have, and none comes from the pose."""
    below = np.nextafter(scale, 0.0) - scale
    lifted = moved(box(scale, scale, scale), pose(z=scale + below))
    for aside in (0.0, 0.3 * scale):
        assert travel(lifted, box(scale, scale, scale), pose(x=aside), [0, 0, -1])[0] == 0.0


@pytest.mark.parametrize("share", [0.0, 1e-12, 1e-6, 1.0, 1e3])
def test_a_slanting_plate_that_is_past_another_goes_free(share):
    """Their heights overlap all the same. The one below is placed by its pose or by its own coordinates."""
    plate = moved(box(4.0, 4.0, 0.1), pose(rotation=RIDGE_X))
    below = moved(plate, pose(z=-1.0 - share))
    assert travel(below, plate, pose(z=share), [0, 0, -1]) == (np.inf, -1, -1)
    assert travel(below, plate, pose(z=share), [0, 0, 1])[0] == pytest.approx(1.0 - 0.1 * np.sqrt(2.0), abs=1e-12)


@pytest.mark.parametrize("aside", [(0.1, 0.2), (-0.3, 0.15), (0.05, -0.4)])
def test_a_corner_comes_down_inside_of_a_triangle_of_a_face(aside):
    x, y = aside
    assert travel(box(1, 1, 1), box(1, 1, 1), pose(x, y, 10.0, CORNER_DOWN), [0, 0, -1])[0] == pytest.approx(
        9.5 - np.sqrt(3.0) / 2.0, abs=1e-14
    )
    up = moved(box(1, 1, 1), pose(rotation=CORNER_DOWN.inv() * Rotation.from_euler("x", 180, degrees=True)))
    top = up.vertices[up.vertices[:, 2].argmax()]
    assert travel(box(1, 1, 1), up, pose(top[0] - x, top[1] - y, 10.0), [0, 0, -1])[0] == pytest.approx(
        9.5 - top[2], abs=1e-14
    )


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kinds", [(hull, hull), (star, hull), (hull, star), (star, star)])
def test_no_event_is_earlier_and_none_is_made_up(seed, kinds):
    moving, rest = kinds[0](seed, 0.3), kinds[1](seed + 100, 0.5)
    rng = np.random.default_rng([3, seed])
    frame = Rotation.random(random_state=seed).as_matrix()
    start = pose(*(rng.uniform(0.0, 0.9) * frame[1] - 4.0 * frame[0]), rotation=Rotation.random(random_state=seed + 1))
    distance, one, two = travel(moving, rest, start, frame[0])
    expected = first_event(moving, rest, start, frame[0])
    assert distance == pytest.approx(expected, abs=1e-12)
    assert (one < 0) == (two < 0) == (expected == np.inf)


@settings(max_examples=80, deadline=None)
@given(st.integers(0, 2**31), st.sampled_from(["hull", "star", "torus"]), st.floats(0.0, 1.8))
def test_gap_is_closed_there_and_open_before(seed, kind, aside):
    rest = torus(1.0, 0.4) if kind == "torus" else {"hull": hull, "star": star}[kind](seed, 1.0)
    moving = star(seed + 1, 0.5)
    frame = Rotation.random(random_state=seed).as_matrix()
    direction = frame[0]
    start = pose(*(aside * frame[1] - 6.0 * direction), rotation=Rotation.random(random_state=seed + 1))
    distance, one, two = travel(moving, rest, start, direction)
    volumes = bounding_volumes(moving), bounding_volumes(rest)

    def gap_after(way):
        T = start.copy()
        T[:3, 3] += way * direction
        return gap(volumes[0], T, volumes[1], np.eye(4))

    # Conservative advancement: the gap shrinks no faster than the way grows.
    way, gap_now = 0.0, gap_after(0.0)
    while gap_now > 1e-9 and way < 12.0:
        way += gap_now
        gap_now = gap_after(way)
    if way >= 12.0:
        assert distance == np.inf
        return
    assert way <= distance + 1e-9
    if np.isfinite(distance):
        assert one >= 0
        assert two >= 0
        assert gap_after(distance) <= 1e-9
        # Where the motion grazes, the gap stays below 1e-9 for some way before it closes.
        assert all(gap_after(w) <= 1e-9 for w in np.linspace(way, distance, 5))


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e3])
def test_distance_scales(scale):
    expected = travel(star(4, 0.5), torus(1.0, 0.4), pose(x=0.7, z=5.0), [0, 0, -1])
    scaled = travel(
        moved(star(4, 0.5), np.eye(4), scale),
        moved(torus(1.0, 0.4), np.eye(4), scale),
        pose(x=0.7 * scale, z=5.0 * scale),
        [0, 0, -1],
    )
    assert scaled[0] == pytest.approx(expected[0] * scale, rel=1e-13)
    assert scaled[1:] == expected[1:]


def test_distance_does_not_depend_on_the_frame_or_on_the_vertices_shared():
    one, two = star(4, 0.5), star(5, 1.0)
    G = pose(3.0, -2.0, 1.0, Rotation.random(random_state=8))
    expected, _, _ = travel(one, two, pose(z=5.0), [0, 0, -1])
    turned, _, _ = travel(one, moved(two, G), G @ pose(z=5.0), -G[:3, 2])
    assert turned == pytest.approx(expected, abs=1e-13)
    soup = TriangleMesh(one.vertices[one.triangles], np.arange(one.triangles.size))
    assert travel(soup, two, pose(z=5.0), [0, 0, -1])[0] == expected
