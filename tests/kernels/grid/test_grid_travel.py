"""Balls that cover a body are clear of an object no farther than the body's elements are."""

import math

import numpy as np
import pytest

from clench.kernels.geometry.bodies import Elements, pack_bodies
from clench.kernels.grid.distance_grid import grid_around
from clench.kernels.hulls.enclosing_hulls import BODY_BALLS, HULL_BALLS, HullPart, pack_hulls
from kernels.hulls.test_hull_sweep import drawn, first_contact
from kernels.plain_sweeps import clear_by_grid, sweep_body
from kernels.toi.test_toi_bodies import KINDS, TOUCH


def with_a_grid(body):
    """Return a body with a grid, however few its elements are."""
    return body._replace(grid=grid_around(body.box[0]))


@pytest.mark.parametrize("kinds", [(one, other) for one in KINDS for other in KINDS])
def test_a_body_is_clear_no_farther_than_its_elements(kinds):
    clear, part = 0, 0
    for seed in range(12):
        moving, resting, chain, best, work = drawn(seed, kinds, False)
        resting = with_a_grid(resting)
        first = first_contact(moving, resting, chain, TOUCH, best, work).min()
        found = clear_by_grid(moving, 0, resting, 0, chain, len(chain), TOUCH, best, work)
        if found == math.inf:
            assert first == best
            clear += 1
        else:
            assert 0.0 <= found <= max(first, 0.0)
            part += found > 0.0
    assert clear + part >= 5


def test_a_ball_is_clear_almost_until_it_touches_and_not_longer():
    """One ball covers a ball, so that nothing but the rounding down to 1/64 of the travel is lost."""
    ball, tight = pack_bodies([Elements(np.zeros((1, 3)), np.zeros((1, 3), np.int32), np.array([0.01]))]), 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        _, resting, chain, best, work = drawn(3 * seed, ("sheet", "sheet"), False)
        work.moving[:, 3] = np.array([0.12, 0.0, 0.0]) + 0.02 * rng.normal(size=3)
        work.resting[:, 3] = 0.12 * np.array([np.cos(0.6), 0.0, np.sin(0.6)]) + 0.01 * rng.normal(size=3)
        first = first_contact(ball, resting, chain, TOUCH, best, work).min()
        found = clear_by_grid(ball, 0, with_a_grid(resting), 0, chain, len(chain), TOUCH, best, work)
        assert found <= max(first, 0.0) or (found == math.inf and first == best)
        tight += 0.0 < first - found < 1.5 / 64
    assert tight >= 10


@pytest.mark.parametrize("kinds", [(one, other) for one in KINDS for other in KINDS])
def test_the_first_contact_is_that_without_a_grid(kinds):
    met = 0
    for seed in range(12):
        moving, resting, chain, best, work = drawn(seed, kinds, True)
        expected = sweep_body(moving, 0, resting, 0, chain, len(chain), TOUCH, best, work)
        found = sweep_body(moving, 0, with_a_grid(resting), 0, chain, len(chain), TOUCH, best, work)
        assert found == pytest.approx(expected, abs=1e-6), (seed, found, expected)
        met += 0.0 < found < best
    assert met >= 1


def test_nothing_is_known_without_a_grid_without_balls_and_where_balls_overlap():
    moving, resting, chain, best, work = drawn(3, ("soup", "soup"), False)
    assert clear_by_grid(moving, 0, resting, 0, chain, len(chain), TOUCH, best, work) == 0.0
    bare = moving._replace(hulls=pack_hulls([()]))
    assert clear_by_grid(bare, 0, with_a_grid(resting), 0, chain, len(chain), TOUCH, best, work) == 0.0
    work.resting[:] = work.moving
    assert clear_by_grid(moving, 0, with_a_grid(moving), 0, chain, len(chain), TOUCH, best, work) == 0.0


def test_balls_that_do_not_move_are_clear_for_ever():
    moving, resting, chain, _, work = drawn(3, ("soup", "soup"), False)
    work.moving[:, 3] += 5.0
    still = np.zeros_like(chain)
    assert clear_by_grid(moving, 0, with_a_grid(resting), 0, still, len(chain), TOUCH, 1.0, work) == math.inf


@pytest.mark.parametrize("count", [1, 2, 3, 9, BODY_BALLS + 1])
def test_balls_cover_the_hulls_of_a_body(count):
    rng, grown = np.random.default_rng(count), 0.002
    hulls = [rng.normal(size=(12, 3)) * rng.uniform(0.0, 0.03, 3) + rng.normal(size=3) * 0.1 for _ in range(count)]
    packed = pack_hulls([[HullPart(hulls[0], 0.0)], [HullPart(points, grown) for points in hulls]])
    balls = packed.ball[packed.cover[1] :]
    assert 1 <= packed.cover[1] <= HULL_BALLS
    if count > BODY_BALLS:
        assert len(balls) == 0
        return
    assert count <= len(balls) <= BODY_BALLS
    for points in hulls:
        shares = rng.dirichlet(np.full(len(points), 0.3), size=400)
        ways = rng.normal(size=(400, 3))
        inside = shares @ points + grown * ways / np.linalg.norm(ways, axis=1, keepdims=True)
        away = np.linalg.norm(inside[:, None] - balls[None, :, :3], axis=2) - balls[:, 3]
        assert (away.min(axis=1) <= 1e-15).all()


def test_a_long_capsule_has_several_balls_and_a_sphere_one():
    capsule, sphere = Elements(np.eye(3)[:2], np.array([[0, 1, 1]], np.int32), np.array([0.3])), np.zeros((1, 3))
    ball = Elements(sphere, np.zeros((1, 3), np.int32), np.array([0.3]))
    covers = [pack_bodies([body]).hulls.ball for body in (capsule, ball)]
    assert 1 < len(covers[0]) <= HULL_BALLS
    assert covers[1] == pytest.approx(np.array([[0.0, 0.0, 0.0, 0.3]]))
