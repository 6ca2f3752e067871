"""The reach of combinations bounds their epsilon, and the search among them finds the steadiest."""

import itertools

import numpy as np
import pytest

from clench.mechanics.epsilon.alternative_wrenches import AlternativeWrenches
from clench.mechanics.epsilon.wrench_space import epsilon_l1, weak_directions


def random_wrenches(seed, fingers=3, sets=3, contacts=2):
    """Return wrenches of contacts around a ball that push inwards, some sets without any."""
    random = np.random.default_rng(seed)
    found = []
    for _ in range(fingers):
        own = []
        for _ in range(sets):
            count = int(random.integers(0 if sets > 1 else 1, contacts + 1))
            places = random.normal(size=(count, 3))
            places /= np.linalg.norm(places, axis=1, keepdims=True)
            forces = -places[:, None] + 0.6 * random.normal(size=(count, 6, 3))
            own.append(np.concatenate([forces, np.cross(places[:, None], forces)], axis=2).reshape(-1, 6))
        found.append(own)
    return found


def weakest(wrenches):
    """Return the weakest direction of those found, and how far wrenches reach there."""
    directions, reach = weak_directions(wrenches, 4)
    return directions[reach.argmin()], reach.min()


@pytest.mark.parametrize("seed", range(20))
def test_no_epsilon_is_above_the_bound_and_its_own_is_near(seed):
    wrenches = random_wrenches(seed, contacts=4)
    alternatives = AlternativeWrenches(wrenches)
    exact = {
        places: epsilon_l1(np.vstack([s[p] for s, p in zip(wrenches, places, strict=True)])).radius
        for places in itertools.product(range(3), repeat=3)
    }
    near = 0
    for places in exact:
        bound = alternatives.bound(places)
        assert all(exact[p] <= bound[p] + 1e-12 for p in exact)
        near += bound[places] <= 1.1 * exact[places] + 1e-9
    assert near >= 0.6 * len(exact)


def test_the_reach_is_the_farthest_of_any_finger():
    wrenches = random_wrenches(5)
    direction = np.random.default_rng(0).normal(size=6)
    reach = AlternativeWrenches(wrenches).reach(direction)
    for places in itertools.product(range(3), repeat=3):
        chosen = np.vstack([np.zeros((1, 6)), *(s[p] for s, p in zip(wrenches, places, strict=True))])
        assert reach[places] == pytest.approx((chosen @ direction).max(), abs=1e-15)


def test_sets_that_touch_nothing_reach_nowhere():
    nothing = np.empty((0, 6))
    assert (AlternativeWrenches([[nothing], [nothing, nothing]]).bound((0, 1)) == 0.0).all()


@pytest.mark.parametrize("seed", range(30))
def test_the_weak_direction_is_a_direction_and_not_below_epsilon(seed):
    wrenches = np.vstack([s[0] for s in random_wrenches(seed, sets=1, contacts=4)])
    direction, reach = weakest(wrenches)
    assert np.linalg.norm(direction) == pytest.approx(1.0, abs=1e-12)
    assert reach == pytest.approx(max(0.0, (wrenches @ direction).max()), abs=1e-11)
    assert reach >= epsilon_l1(wrenches).radius - 1e-12


def test_a_cube_is_left_through_its_nearest_face():
    """Points ±a_k along six axes, moved off the middle: the nearest facet of this cross-polytope is known."""
    lengths = np.array([1.0, 1.5, 2.0, 1.2, 3.0, 0.7])
    points = np.vstack([np.diag(lengths), -np.diag(lengths)])
    direction, reach = weakest(points)
    assert reach == pytest.approx(1.0 / np.linalg.norm(1.0 / lengths), rel=1e-12)
    assert np.abs(direction) == pytest.approx(reach / lengths, rel=1e-9)
    assert epsilon_l1(points).radius == pytest.approx(reach, rel=1e-10)


def test_points_on_one_side_reach_nowhere_on_the_other():
    points = np.random.default_rng(2).normal(size=(40, 6))
    points[:, 2] = np.abs(points[:, 2]) + 0.1
    direction, reach = weakest(points)
    assert reach == 0.0
    assert (points @ direction).max() <= 1e-12
    assert epsilon_l1(points).radius == 0.0


def test_one_point_twice_and_the_middle_do_no_harm():
    points = np.vstack([np.eye(6), -np.eye(6)])
    more = np.vstack([points, points, np.zeros((3, 6)), 0.5 * points])
    assert weakest(more)[1] == pytest.approx(1.0 / np.sqrt(6.0), rel=1e-12)
    assert epsilon_l1(more).radius == pytest.approx(1.0 / np.sqrt(6.0), rel=1e-10)
