"""How far a hull moves along a line: by fcl's distance, by what two meshes meet first, and by hand."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from clench.kernels.geometry.bodies import Elements, no_body, pack_bodies
from clench.kernels.hulls import hull_cast
from clench.kernels.hulls.hull_cast import NEAR, Cast
from kernels.kernel_entries import entry
from kernels.kernel_solids import bounding_volumes, box, gap, hull, moved, star, torus
from kernels.toi.test_toi_translation import pose, travel

make_cast_work, cast_hull = entry(hull_cast.make_cast_work), entry(hull_cast.cast_hull)
DOWN = [0.0, 0.0, -1.0]


def body_of(mesh):
    return pack_bodies([Elements(mesh.vertices, mesh.triangles.astype(np.int32), np.zeros(len(mesh.triangles)))])


def rounded(points, radius):
    """Return a body of one element: the hull of one to three points, grown."""
    element = np.minimum(np.arange(3), len(points) - 1)[None].astype(np.int32)
    return pack_bodies([Elements(np.array(points, dtype=float), element, np.array([radius]))])


def cast(moving, rest, T, direction, limit=math.inf, start=0.0):
    along = np.array(direction, dtype=float)
    return cast_hull(Cast(moving.hulls, 0, np.ascontiguousarray(T[:3]), along, start), rest, limit, make_cast_work())


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**31), st.sampled_from(["hull", "star", "torus"]), st.floats(0.0, 1.8))
@example(seed=0, kind="torus", aside=0.0)
def test_a_hull_comes_as_near_as_asked_and_not_sooner(seed, kind, aside):
    rest = torus(1.0, 0.4) if kind == "torus" else {"hull": hull, "star": star}[kind](seed, 1.0)
    moving = hull(seed + 1, 0.3)
    frame = Rotation.random(random_state=seed).as_matrix()
    start = pose(*(aside * frame[1] - 6.0 * frame[0]), rotation=Rotation.random(random_state=seed + 1))
    distance, element = cast(body_of(moving), body_of(rest), start, frame[0])
    touched = travel(moving, rest, start, frame[0])[0]
    volumes = bounding_volumes(moving), bounding_volumes(rest)

    def gap_after(way):
        T = start.copy()
        T[:3, 3] += way * frame[0]
        return gap(volumes[0], T, volumes[1], np.eye(4))

    assert distance <= touched
    assert (element >= 0) == (distance < math.inf)
    near = 1.02 * NEAR
    if element >= 0:
        assert gap_after(distance) <= near
    # Conservative advancement: the gap shrinks no faster than the way grows.
    way, gap_now = 0.0, gap_after(0.0)
    while gap_now > 1.01 * near and way < 12.0:
        way += gap_now - near
        gap_now = gap_after(way)
    assert distance >= min(way, 12.0)


def test_a_ball_on_a_ball_beside_a_ball_and_past_it():
    moving, rest = rounded([[0.0, 0.0, 0.0]], 0.01), rounded([[0.0, 0.0, 0.0]], 0.03)
    for aside in (0.0, 0.02, 0.0399):
        distance, element = cast(moving, rest, pose(x=aside, z=0.2), DOWN)
        assert distance == pytest.approx(0.2 - math.sqrt(0.04**2 - aside**2), abs=2e-5 if aside > 0.03 else 2e-6)
        assert distance <= 0.2 - math.sqrt(0.04**2 - aside**2)
        assert element == 0
    # A ball that grazes touches where it is nearest; one farther off than NEAR passes.
    assert cast(moving, rest, pose(x=0.04 + 0.4 * NEAR, z=0.2), DOWN)[1] == 0
    assert cast(moving, rest, pose(x=0.04 + 3.0 * NEAR, z=0.2), DOWN) == (math.inf, -1)


def test_needles_blades_and_plates():
    needle, blade = rounded([[0.0, 0.0, -0.05], [0.0, 0.0, 0.05]], 0.0), rounded(0.1 * np.eye(3), 0.0)
    plate = body_of(box(0.1, 0.1, 0.0))
    assert cast(needle, plate, pose(x=0.02, z=0.2), DOWN)[0] == pytest.approx(0.15, abs=2e-6)
    assert cast(blade, plate, pose(x=-0.03, y=-0.03, z=0.2), DOWN)[0] == pytest.approx(0.2, abs=2e-6)
    # Edge-on, and past the edge.
    assert cast(needle, plate, pose(x=0.2), [-1.0, 0.0, 0.0])[0] == pytest.approx(0.15, abs=2e-6)
    assert cast(needle, plate, pose(x=0.2, z=0.05 + 3.0 * NEAR), [-1.0, 0.0, 0.0]) == (math.inf, -1)


def test_away_from_it_before_a_limit_and_from_a_later_start():
    moving, rest = body_of(box(0.02, 0.02, 0.02)), body_of(box(0.04, 0.04, 0.04))
    T = pose(z=0.13)
    assert cast(moving, rest, T, [0.0, 0.0, 1.0]) == (math.inf, -1)
    assert cast(moving, rest, T, DOWN)[0] == pytest.approx(0.1, abs=2e-6)
    assert cast(moving, rest, T, DOWN, limit=0.0999) == (0.0999, -1)
    assert cast(moving, rest, T, DOWN, limit=0.1001)[1] >= 0
    assert cast(moving, rest, T, DOWN, start=0.09)[0] == pytest.approx(0.1, abs=2e-6)
    # One that lies on it touches at once, in any direction but away from it.
    assert cast(moving, rest, pose(z=0.03), DOWN)[0] == 0.0
    assert cast(moving, no_body(), T, DOWN) == (math.inf, -1)


def test_the_nearer_of_two_parts_is_named():
    low, high = box(0.04, 0.04, 0.04), moved(box(0.04, 0.04, 0.04), pose(x=0.06, z=0.01))
    rest = pack_bodies(
        [
            Elements(
                np.vstack([low.vertices, high.vertices]),
                np.vstack([low.triangles, high.triangles + len(low.vertices)]).astype(np.int32),
                np.zeros(2 * len(low.triangles)),
            )
        ]
    )
    distance, element = cast(body_of(box(0.1, 0.02, 0.02)), rest, pose(x=0.03, z=0.2), DOWN)
    assert distance == pytest.approx(0.16, abs=2e-6)
    assert rest.source[element] >= len(low.triangles)


@pytest.mark.parametrize("seed", range(12))
def test_several_grown_elements_stop_a_hull_as_early_as_the_first_of_them(seed):
    rng = np.random.default_rng(seed)
    points, radius = 0.1 * rng.normal(size=(24, 3)), rng.uniform(0.0, 0.03, 8)
    elements = np.arange(24).reshape(8, 3)
    elements[::3, 2] = elements[::3, 1]
    elements[1::3, 1:] = elements[1::3, :1]
    rest = pack_bodies([Elements(points, elements.astype(np.int32), radius)])
    alone = [pack_bodies([Elements(points, elements[k : k + 1].astype(np.int32), radius[k : k + 1])]) for k in range(8)]
    moving = rounded(0.03 * rng.normal(size=(3, 3)), 0.02) if seed % 2 else body_of(hull(seed, 0.03))
    frame = Rotation.random(random_state=seed).as_matrix()
    met = 0
    for _ in range(6):
        aside = 0.1 * rng.normal(size=2) @ frame[1:]
        start = pose(*(aside - 1.0 * frame[0]), rotation=Rotation.random(random_state=int(rng.integers(1000))))
        found, element = cast(moving, rest, start, frame[0])
        ways = [cast(moving, one, start, frame[0])[0] for one in alone]
        assert found == pytest.approx(min(ways), abs=2.0 * NEAR)
        if element >= 0:
            assert ways[rest.source[element]] <= min(ways) + 2.0 * NEAR
            met += 1
    assert met > 0
