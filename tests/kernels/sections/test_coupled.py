"""Sums of several turns: what they stand for, the bounds on them, and roots that nothing steps over."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.kernels.sections.coupled import (
    at_start,
    bounds,
    evaluate,
    line_on_point,
    next_root,
    place,
    point_on_line,
    point_on_point,
    safe_step,
)

TOUCH = 1e-10
rates = st.floats(-2.0, 2.0).filter(lambda r: abs(r) > 0.05)
coordinates = st.floats(-1.0, 1.0)
chains = st.lists(st.tuples(rates, coordinates, coordinates), min_size=1, max_size=4).map(
    lambda rows: np.array(rows, dtype=np.float64)
)
travels = st.floats(0.0, 3.0)


def room(count):
    return np.zeros((count * (count + 1) + 2, 3))


def where(chain, s):
    """Return where the chain's last point is: every part turned by its own total rate."""
    point = np.zeros(2)
    for rate, x, z in chain:
        c, d = math.cos(rate * s), math.sin(rate * s)
        point += [c * x - d * z, d * x + c * z]
    return point


@settings(deadline=None)
@given(chains, travels)
def test_place(chain, s):
    np.testing.assert_allclose(place(chain, len(chain), s), where(chain, s), atol=1e-12)


@settings(deadline=None)
@given(chains, travels, st.floats(0, 6.3), coordinates)
def test_gap_of_a_point_over_a_line(chain, s, nu, offset):
    normal = np.array([math.cos(nu), math.sin(nu)])
    terms = room(len(chain))
    count, constant = point_on_line(chain, len(chain), *normal, offset, terms)
    value, _, _ = evaluate(terms, count, constant, s)
    assert value == pytest.approx(normal @ where(chain, s) - offset, abs=1e-12)
    assert at_start(terms, count, constant) == pytest.approx(evaluate(terms, count, constant, 0.0)[0], abs=1e-12)


@settings(deadline=None)
@given(chains, travels, st.floats(0, 6.3), coordinates, coordinates, coordinates, st.floats(0, 0.2))
def test_gap_of_a_point_over_a_moving_side(chain, s, mu, g, qx, qz, w):
    terms = room(len(chain))
    count, constant = line_on_point(chain, len(chain), math.cos(mu), math.sin(mu), g, qx, qz, w, terms)
    turned = mu + chain[-1, 0] * s
    pivot = where(chain[:-1], s)
    expected = math.cos(turned) * (qx - pivot[0]) + math.sin(turned) * (qz - pivot[1]) - g - w
    assert evaluate(terms, count, constant, s)[0] == pytest.approx(expected, abs=1e-12)


@settings(deadline=None)
@given(chains, travels, coordinates, coordinates, st.floats(0.01, 0.5))
def test_gap_between_points(chain, s, qx, qz, w):
    terms = room(len(chain))
    count, constant = point_on_point(chain, len(chain), qx, qz, w, terms)
    square = float(np.sum((where(chain, s) - [qx, qz]) ** 2))
    assert evaluate(terms, count, constant, s)[0] == pytest.approx((square - w * w) / (2 * w), abs=1e-9)


@settings(deadline=None)
@given(chains, travels, travels)
def test_bounds_hold_and_slopes_are_slopes(chain, s, other):
    terms = room(len(chain))
    count, constant = point_on_line(chain, len(chain), 0.6, 0.8, 0.1, terms)
    first, second = bounds(terms, count)
    value, slope, curvature = evaluate(terms, count, constant, s)
    assert abs(slope) <= first * (1 + 1e-12) + 1e-15
    assert abs(curvature) <= second * (1 + 1e-12) + 1e-15
    away = evaluate(terms, count, constant, other)[0]
    assert abs(away - value) <= first * abs(other - s) + 1e-12
    assert abs(away - value - slope * (other - s)) <= 0.5 * second * (other - s) ** 2 + 1e-12


@settings(deadline=None)
@given(st.floats(0, 1), st.floats(-2, 2), st.floats(1e-3, 10))
def test_safe_steps_end_where_the_parabola_does(value, slope, bound):
    step = safe_step(value, slope, bound)
    assert step >= 0.0
    scale = max(value, abs(slope * step), bound * step * step, 1e-12)
    assert abs(value + slope * step - 0.5 * bound * step * step) <= 1e-9 * scale


@settings(max_examples=60, deadline=None)
@given(chains, st.floats(0, 6.3), coordinates, st.sampled_from([1.0, -1.0]))
def test_roots_are_the_first_ones(chain, nu, offset, sign):
    """Nothing on a fine grid before the root is below zero; at the root the sum is zero and goes on below."""
    terms = room(len(chain))
    count, constant = point_on_line(chain, len(chain), math.cos(nu), math.sin(nu), offset, terms)
    _, second = bounds(terms, count)
    start = sign * at_start(terms, count, constant)
    if start < 1e-6:
        return
    end = 3.0
    root = next_root(terms, count, constant, 0.0, sign, second, TOUCH, end)
    grid = np.linspace(0.0, root, 2000, endpoint=False)
    values = [sign * evaluate(terms, count, constant, s)[0] for s in grid]
    assert min(values) >= -TOUCH
    if root < end:
        value, slope, _ = evaluate(terms, count, constant, root)
        assert abs(value) <= TOUCH
        assert sign * slope <= 1e-4 * second


@pytest.mark.parametrize("depth", [1e-2, 1e-4, 1e-6, 1e-8])
def test_a_thin_dip_below_zero_is_not_stepped_over(depth):
    """cos s - (-1 + depth): below zero for a short while about s = π."""
    terms = np.array([[1.0, 1.0, 0.0]])
    root = next_root(terms, 1, 1.0 - depth, 0.0, 1.0, 1.0, 1e-12, 6.0)
    assert root == pytest.approx(math.pi - math.acos(1.0 - depth), abs=1e-7)
    assert abs(math.cos(root) + 1.0 - depth) <= 1e-12


@pytest.mark.parametrize("clearance", [1e-2, 1e-5, 1e-8])
def test_a_near_miss_is_no_root(clearance):
    terms = np.array([[1.0, 1.0, 0.0]])
    assert next_root(terms, 1, 1.0 + clearance, 0.0, 1.0, 1.0, 1e-12, 6.0) == 6.0


def test_a_touch_at_the_start_that_opens_is_left_and_comes_back():
    """sin s is touching at 0 and opens; it comes down at π."""
    terms = np.array([[1.0, 0.0, 1.0]])
    assert next_root(terms, 1, 0.0, 0.0, 1.0, 1.0, TOUCH, 4.0) == pytest.approx(math.pi, abs=1e-9)
    assert next_root(terms, 1, 0.0, 0.0, -1.0, 1.0, TOUCH, 4.0) == 0.0


def test_a_point_on_the_axis_never_moves():
    terms = np.array([[1.0, 0.0, 0.0]])
    assert next_root(terms, 1, 0.0, 0.0, 1.0, 0.0, TOUCH, 2.0) == 2.0


def test_what_takes_too_many_steps_ends_before_a_root_not_behind_it():
    """It passes zero closely, thousands of times: the search gives up on its way, at a place that is free."""
    terms, constant = np.array([[1e3, 1.0, 0.0]]), 1.0 + 1e-6
    root = next_root(terms, 1, constant, 0.0, 1.0, 1e6, 1e-12, 1e3)
    assert 0.0 < root < 1e3
    assert evaluate(terms, 1, constant, root)[0] > 0.0


def test_what_stays_in_touch_is_no_root():
    """Two turns that cancel: the gap is 0 all along, and never less."""
    terms = np.array([[1.0, 0.3, 0.1], [1.0, -0.3, -0.1]])
    assert next_root(terms, 2, 0.0, 0.0, 1.0, 0.7, TOUCH, 5e-4) == 5e-4
