"""Where convex bodies touch: as early as any pair of their elements, and no earlier."""

import math

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from clench.kernels.geometry.bodies import Elements, join_elements, pack_bodies
from clench.kernels.hulls import gjk, hull_meeting
from clench.kernels.hulls.enclosing_hulls import HullPart, pack_hulls
from clench.kernels.toi import core_motion
from clench.kernels.toi import toi_work as sweeping
from kernels.hulls.test_hull_sweep import drawn as drawn_parts
from kernels.hulls.test_hull_sweep import first_contact
from kernels.kernel_entries import entry
from kernels.plain_sweeps import clear_travel, sweep_body, touching_elements
from kernels.toi.test_toi_bodies import KINDS, TOUCH, drawn_chain, pose

make_sweep_work, move_core = entry(sweeping.make_sweep_work), entry(core_motion.move_core)
widest_gap, list_at = entry(gjk.widest_gap), entry(hull_meeting.list_at)
SOLIDS = ["box", "wedge", "ball", "rod", "point", "triangle"]


def solid(rng, kind):
    """Return the elements of a convex body about the origin."""
    if kind in ("rod", "point", "triangle"):
        corners = {"rod": 2, "point": 1, "triangle": 3}[kind]
        element = np.minimum(np.arange(3), corners - 1)[None]
        radius = 0.0 if kind == "triangle" else float(rng.uniform(0.001, 0.01))
        return Elements(0.02 * rng.normal(size=(corners, 3)), element.astype(np.int32), np.array([radius]))
    count = {"box": 8, "wedge": 6, "ball": 40}[kind]
    points = 0.02 * rng.normal(size=(count, 3))
    if kind == "box":
        points = np.array(np.meshgrid(*[[-s, s] for s in rng.uniform(0.004, 0.02, 3)])).reshape(3, -1).T
    if kind == "ball":
        points *= 0.02 / np.linalg.norm(points, axis=1, keepdims=True)
    return outside_of(points)


def outside_of(points):
    """Return the surface of the convex hull of points, with outward normals."""
    hull = ConvexHull(points)
    a, b, c = (points[hull.simplices[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    faces = hull.simplices.copy()
    faces[inward] = faces[inward][:, ::-1]
    return Elements(points, faces.astype(np.int32), np.zeros(len(faces)))


def drawn(seed, kinds):
    """Return two convex bodies, the chain of the first one, its travel and a workspace with their poses."""
    rng = np.random.default_rng(seed)
    moving, resting = (pack_bodies([solid(rng, kind)]) for kind in kinds)
    chain, best, work = drawn_chain(seed, rng), float(rng.uniform(0.5, 2.0)), make_sweep_work(8, 0)
    work.moving[:] = pose(rng, 0.15 * rng.normal(size=3))
    there = np.zeros((6, 3))
    move_core(np.tile(work.moving[:, 3], (3, 1)), 1, chain, len(chain), 0.6 * best, there)
    work.resting[:] = pose(rng, there[0] + 0.01 * rng.normal(size=3))
    return moving, resting, chain, best, work


@pytest.mark.parametrize("kinds", [(one, other) for one in SOLIDS for other in SOLIDS])
def test_hulls_touch_when_the_first_elements_do(kinds):
    told, near = 0, 0
    for seed in range(16):
        moving, resting, chain, best, work = drawn(seed, kinds)
        first = first_contact(moving, resting, chain, TOUCH, best, work).min()
        found = clear_travel(moving, 0, resting, 0, chain, len(chain), TOUCH, best, work)
        if first < 0.0 or first == best:
            assert found == math.inf if first == best else found <= 0.0
            continue
        near += 1
        assert found <= first + 1e-7
        if work.near[1] >= 0:
            told += 1
            assert found == pytest.approx(first, abs=1e-5)
            assert touching_elements(moving, 0, resting, 0, chain, len(chain), TOUCH, found, work)
            pair = work.pair.copy()
            alone = first_contact(
                *(body_of(body, e) for body, e in ((moving, pair[0]), (resting, pair[1]))), chain, TOUCH, best, work
            )
            assert alone[0] == pytest.approx(first, abs=1e-5)
    assert told >= 0.9 * near


def body_of(bodies, e):
    """Return one element of a body as a body."""
    corners = bodies.vertices[bodies.elements[e]]
    return pack_bodies([Elements(corners, np.arange(3, dtype=np.int32)[None], np.array([bodies.radius[e]]))])


def test_a_sweep_of_convex_bodies_is_that_of_their_elements():
    met = 0
    for seed in range(120):
        kinds = [SOLIDS[k] for k in np.random.default_rng(seed).integers(0, len(SOLIDS), 2)]
        moving, resting, chain, best, work = drawn(seed, kinds)
        first = first_contact(moving, resting, chain, TOUCH, best, work).min()
        found = sweep_body(moving, 0, resting, 0, chain, len(chain), TOUCH, best, work)
        assert (found < best) == (first < best)
        assert found == pytest.approx(first, abs=1e-5) or found < 0.0 > first
        met += 0.0 < found < best
    assert met >= 50


@pytest.mark.parametrize("gap", [1e-6, 1e-9, 1e-11])
def test_a_face_over_an_edge_is_as_far_away_as_it_is(gap):
    """The direction is across the face, however near: rounding of the nearest point would tilt it."""
    for seed in range(40):
        rng = np.random.default_rng(seed)
        face, edge = np.vstack([0.02 * rng.normal(size=(3, 2)).T, np.zeros(3)]).T, np.zeros((2, 3))
        weights = rng.dirichlet(np.ones(3), 2)
        edge[:] = weights @ face - [0.0, 0.0, gap]
        turned = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        hulls = pack_hulls([[HullPart(face @ turned.T + 0.05, 0.0)]])
        T, n = np.eye(3, 4), np.append(turned[:, 2] + 0.3 * rng.normal(size=3), 0.0)
        work = np.zeros((5, 6))
        found = widest_gap(hulls, 0, T, hulls, -1, edge @ turned.T + 0.05, (1e-3, 0.0), work, n)
        assert (1.0 - 2e-3) * gap - 1e-16 <= found <= gap + 1e-16


def test_a_search_goes_on_from_where_it_ended():
    rng = np.random.default_rng(3)
    one, other = (outside_of(0.02 * rng.normal(size=(60, 3))).vertices for _ in range(2))
    hulls, others = pack_hulls([[HullPart(one, 0.0)]]), pack_hulls([[HullPart(other, 0.0)]])
    T, n, none = np.column_stack([np.eye(3), [0.2, 0.0, 0.01]]), np.array([1.0, 0.0, 0.0, 0.0]), np.empty((0, 3))
    work = np.zeros((5, 6))
    cold = widest_gap(hulls, 0, T, others, 0, none, (1e-6, 0.0), work, n)
    assert work[4, 5] > 0
    T[:, 3] += 1e-4
    warm = widest_gap(hulls, 0, T, others, 0, none, (1e-6, 0.0), work, n)
    fresh = widest_gap(hulls, 0, T, others, 0, none, (1e-6, 0.0), np.zeros((5, 6)), n)
    assert warm == pytest.approx(fresh, rel=2e-6)
    assert warm != cold


def test_the_elements_at_a_point_are_listed():
    rng = np.random.default_rng(5)
    body = pack_bodies([solid(rng, "ball")])
    work, listed = make_sweep_work(2, 0), np.zeros(32, dtype=np.int64)
    for e in range(len(body.elements)):
        corners = body.vertices[body.elements[e]]
        count = list_at(body, 0, tuple(corners.mean(axis=0)), 1e-12, listed, work)
        assert list(listed[:count]) == [e]
        count = list_at(body, 0, tuple(corners[0]), 1e-12, listed, work)
        assert set(listed[:count]) == set(np.flatnonzero((body.elements == body.elements[e, 0]).any(axis=1)))
        assert list_at(body, 0, tuple(1.1 * corners.mean(axis=0)), 1e-6, listed, work) == 0


@pytest.mark.parametrize("share", [0.3, 0.5, 0.7, 0.9])
@pytest.mark.parametrize("wall_first", [True, False])
def test_a_part_slides_along_a_wall_that_it_touches_whatever_else_is_near(share, wall_first):
    """The box turns in the plane of the wall's face; beside it a sheet, 2 µm away, makes windows short."""
    moving = pack_bodies([outside_of(corners_of([0.04, 0.06], [share * TOUCH, 0.01], [-0.05, 0.0]))])
    wall = outside_of(corners_of([-0.2, 0.2], [-0.01, 0.0], [-0.2, 0.2]))
    x, top = 0.06 + 2e-6, -0.05 + 5e-7
    sheet = np.array([[x, 0.002, -0.07], [x, 0.008, -0.07], [x, 0.008, top], [x, 0.002, top]])
    parts = [wall, Elements(sheet, np.array([[0, 1, 2], [0, 2, 3]], np.int32), np.zeros(2))]
    resting = pack_bodies([join_elements(parts if wall_first else parts[::-1])])
    assert sorted(resting.hulls.convex) == [0, 1]
    work = make_sweep_work(8, 0)
    work.moving[:] = work.resting[:] = np.eye(3, 4)
    assert sweep_body(moving, 0, resting, 0, np.array([[1.0, 0.0, 0.0]]), 1, TOUCH, 1e-3, work) == 1e-3


def corners_of(*sides):
    """Return the corners of a box."""
    return np.array(np.meshgrid(*sides)).reshape(3, -1).T


@pytest.mark.parametrize("kinds", [(one, other) for one in KINDS for other in KINDS])
def test_a_part_that_is_wrongly_told_to_fill_its_hull_meets_the_same(kinds):
    """The elements that are named have to touch: else their own sweep decides."""
    met = 0
    for seed in range(16):
        moving, resting, chain, best, work = drawn_parts(seed, kinds, bool(seed % 2))
        right = sweep_body(moving, 0, resting, 0, chain, len(chain), TOUCH, best, work)
        bodies = [b._replace(hulls=b.hulls._replace(convex=np.ones_like(b.hulls.convex))) for b in (moving, resting)]
        found = sweep_body(bodies[0], 0, bodies[1], 0, chain, len(chain), TOUCH, best, work)
        assert found == pytest.approx(right, abs=1e-6)
        met += 0.0 < found < best
    assert met >= 1


@pytest.mark.parametrize("back", [False, True])
def test_bodies_that_touch_at_the_start_go_on_as_their_elements_do(back):
    """They begin where a sweep ended, and go on, or back until they meet on the other side."""
    begun, met = 0, 0
    for seed in range(150):
        kinds = [SOLIDS[k] for k in np.random.default_rng(seed).integers(0, len(SOLIDS), 2)]
        moving, resting, _, _, work = drawn(3 * seed, kinds)
        chain = np.array([[1.0, 0.0, 0.0]])
        at = sweep_body(moving, 0, resting, 0, chain, 1, TOUCH, 3.0, work)
        if not 0.0 < at < 3.0:
            continue
        c, s = np.cos(at), np.sin(at)
        work.moving[:] = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]) @ work.moving
        chain[0, 0], begun = -1.0 if back else 1.0, begun + 1
        first = first_contact(moving, resting, chain, TOUCH, 6.0, work).min()
        found = sweep_body(moving, 0, resting, 0, chain, 1, TOUCH, 6.0, work)
        assert found == pytest.approx(first, abs=1e-6)
        met += found < 6.0
    assert begun >= 40
    assert met >= 10
