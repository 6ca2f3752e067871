"""Distances to ellipses, whole and cut by caps, and first contacts with them."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from clench.kernels.sections import conics
from kernels.kernel_entries import entry

ellipse_foot, region_gap, support = entry(conics.ellipse_foot), entry(conics.region_gap), entry(conics.support)
sweep_vertex_region, sweep_side_region = entry(conics.sweep_vertex_region), entry(conics.sweep_side_region)
TOUCH = 1e-10
semi = st.floats(0.05, 1.0)
coordinates = st.floats(-2.0, 2.0)


def region(a=0.3, b=0.2, turn=0.4, center=(0.7, 0.5), low=None, high=None):
    low, high = -a if low is None else low, a if high is None else high
    return np.array([*center, math.cos(turn), math.sin(turn), a, b, low, high])


def border(e, count=4001):
    """Return points of the region's border: the arcs between the caps, and the caps."""
    ux, uz, a, b, low, high = e[2:]
    t = np.linspace(0, 2 * np.pi, count)
    arc = np.column_stack([a * np.cos(t), b * np.sin(t)])
    rows = [arc[(arc[:, 0] >= low) & (arc[:, 0] <= high)]]
    for cap in (low, high):
        half = b * math.sqrt(max(1 - (cap / a) ** 2, 0.0))
        rows.append(np.column_stack([np.full(801, cap), np.linspace(-half, half, 801)]))
    local = np.vstack(rows)
    return e[:2] + local @ np.array([[ux, uz], [-uz, ux]])


@settings(deadline=None)
@given(semi, semi, coordinates, coordinates)
def test_the_foot_is_on_the_ellipse_and_the_normal_through_it_meets_the_point(p, q, t, y):
    a, b = max(p, q), min(p, q)
    assume(abs(y) > 1e-6 or y == 0.0)
    assume(math.hypot(t, y) > 1e-9)
    x, z = ellipse_foot(a, b, t, y)
    assert math.hypot(x / a, z / b) == pytest.approx(1.0, abs=1e-9)
    nx, nz = x / a**2, z / b**2
    cross = (t - x) * nz - (y - z) * nx
    assert abs(cross) <= 1e-7 * max(math.hypot(nx, nz), 1.0)


@pytest.mark.parametrize("y", [0.0, 5e-324, 1e-310, 1e-140, 1e-20, 1e-13])
def test_feet_of_points_on_the_major_axis_to_rounding(y):
    """Inside the evolute the foot is off the axis: its height jumps from one side to the other, it does not shrink."""
    x, z = ellipse_foot(1.0, 0.5, 0.5, y)
    assert (x, z) == pytest.approx((2.0 / 3.0, 0.5 * math.sqrt(1.0 - 4.0 / 9.0)), abs=1e-9)


def test_the_centre_of_a_circle_has_a_foot():
    assert math.hypot(*ellipse_foot(0.3, 0.3, 0.0, 0.0)) == pytest.approx(0.3)
    assert math.hypot(*ellipse_foot(0.3, 0.3, 0.0, 1e-80)) == pytest.approx(0.3)
    assert math.hypot(*ellipse_foot(0.3, 0.2, 0.0, 0.0)) == pytest.approx(0.2)
    assert math.hypot(*ellipse_foot(0.3, 0.3, 1e-310, 1e-310)) == pytest.approx(0.3)


@settings(max_examples=40, deadline=None)
@given(semi, semi, coordinates, coordinates)
def test_no_point_of_the_ellipse_is_nearer_than_the_foot(p, q, t, y):
    a, b = max(p, q), min(p, q)
    assume(abs(y) > 1e-6 or y == 0.0)
    assume(math.hypot(t, y) > 1e-9)
    x, z = ellipse_foot(a, b, t, y)
    angle = np.linspace(0, 2 * np.pi, 4001)
    least = np.hypot(a * np.cos(angle) - t, b * np.sin(angle) - y).min()
    assert math.hypot(x - t, z - y) <= least + 1e-12


@pytest.mark.parametrize("caps", [(None, None), (-0.1, 0.3), (-0.12, 0.05)])
def test_gaps_outside_are_distances_and_inside_no_more_than_the_depth(caps):
    e = region(low=caps[0], high=caps[1])
    points = border(e)
    for px, pz in np.random.default_rng(0).uniform(0.0, 1.4, (200, 2)):
        gap, nx, nz, fx, fz = region_gap(e, px, pz)
        least = np.hypot(points[:, 0] - px, points[:, 1] - pz).min()
        local = np.array([(px - e[0]) * e[2] + (pz - e[1]) * e[3], -(px - e[0]) * e[3] + (pz - e[1]) * e[2]])
        inside = math.hypot(local[0] / e[4], local[1] / e[5]) <= 1.0 and e[6] <= local[0] <= e[7]
        assert math.hypot(nx, nz) == pytest.approx(1.0)
        if inside:
            assert gap <= 0.0
            assert -gap >= least - 1e-3 or caps != (None, None)
        else:
            assert gap == pytest.approx(least, abs=1e-4)
            np.testing.assert_allclose([px - gap * nx, pz - gap * nz], [fx, fz], atol=1e-12)


@settings(deadline=None)
@given(semi, semi, st.floats(0, 6.3), st.floats(0, 6.3))
def test_support_is_the_farthest_point_in_a_direction(p, q, turn, angle):
    a, b = max(p, q), min(p, q)
    e = region(a, b, turn)
    value, change, t = support(e, math.cos(angle), math.sin(angle))
    ring = np.linspace(0, 2 * np.pi, 8001)
    c, s = math.cos(turn), math.sin(turn)
    x, z = a * np.cos(ring) * c - b * np.sin(ring) * s, a * np.cos(ring) * s + b * np.sin(ring) * c
    reach = x * math.cos(angle) + z * math.sin(angle)
    assert value == pytest.approx(reach.max(), abs=1e-6)
    assert value >= reach.max() - 1e-12
    assert abs(t) <= a * (1 + 1e-12)
    step = 1e-6
    ahead = support(e, math.cos(angle + step), math.sin(angle + step))[0]
    behind = support(e, math.cos(angle - step), math.sin(angle - step))[0]
    assert change == pytest.approx((ahead - behind) / (2 * step), abs=1e-4)


def chain_of(rate, x, z):
    return np.array([[rate, x, z]])


@pytest.mark.parametrize("caps", [(None, None), (-0.1, 0.12)])
@pytest.mark.parametrize("w", [0.0, 0.05])
def test_a_turning_vertex_stops_at_distance_w(w, caps):
    e = region(low=caps[0], high=caps[1])
    points = border(e)
    for radius in np.linspace(0.55, 1.1, 8):
        found = sweep_vertex_region(chain_of(1.0, radius, 0.0), 1, radius, 0.0, w, e, TOUCH, 2.0)
        before = np.linspace(0.0, found, 150)
        path = radius * np.column_stack([np.cos(before), np.sin(before)])
        gaps = np.array([np.hypot(*(points - p).T).min() for p in path]) - w
        assert gaps[:-1].min() >= -1e-6
        if found < 2.0:
            x, z = radius * math.cos(found), radius * math.sin(found)
            assert region_gap(e, x, z)[0] - w == pytest.approx(0.0, abs=TOUCH)


def test_a_turning_side_is_tangent_to_the_ellipse():
    e = region()
    chain, terms = np.array([[1.0, 0.0, 0.0]]), np.zeros((6, 3))
    w = 0.05
    found = sweep_side_region(chain, terms, 1, (0.0, 1.0, 0.0, -3.0, 0.0), w, e, TOUCH, 2.0)
    points = border(e, 200001)
    heights = -math.sin(found) * points[:, 0] + math.cos(found) * points[:, 1]
    assert heights.min() == pytest.approx(w, abs=1e-8)
    assert 0.0 < found < math.atan2(0.5, 0.7)


def test_a_side_beyond_the_caps_or_too_short_does_not_touch_the_curve():
    chain, terms = np.array([[1.0, 0.0, 0.0]]), np.zeros((6, 3))
    whole = region()
    short = sweep_side_region(chain, terms, 1, (0.0, 1.0, 0.0, -0.2, 0.0), 0.0, whole, TOUCH, 1.0)
    assert short == 1.0
    cut = region(low=-0.3, high=-0.29)
    assert sweep_side_region(chain, terms, 1, (0.0, 1.0, 0.0, -3.0, 0.0), 0.0, cut, TOUCH, 0.6) == 0.6
