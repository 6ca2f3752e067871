"""The closed forms of one rotation against bisection, and what touching at the start means."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from clench.kernels.sections.turning import disk_on_segment, disk_on_vertex, grazing_band, side_on_vertex, turn_to

TOUCH = 1e-10
TURN = 2.0 * math.pi
angles = st.floats(0.0, TURN, exclude_max=True)
lengths = st.floats(0.02, 1.0)


def polar(radius, angle):
    return radius * math.cos(angle), radius * math.sin(angle)


def first_entering(gap, foot_inside, limit=TURN):
    """Return the first turn in (0, limit) at which a gap comes down through zero with its foot inside, or None."""
    grid = np.linspace(0.0, limit, 2001)
    values = np.array([gap(t) for t in grid])
    for i in np.flatnonzero((values[:-1] > 0.0) & (values[1:] <= 0.0)):
        root = brentq(gap, grid[i], grid[i + 1], xtol=1e-15)
        if foot_inside(root):
            return root
    return None


def compare(found, expected):
    if expected is None:
        assert found == TURN
    else:
        assert found == pytest.approx(expected, abs=1e-9)


@settings(deadline=None)
@given(angles, angles)
def test_turns_between_directions(a, b):
    turn = turn_to(*polar(1.0, a), *polar(1.0, b))
    assert 0.0 <= turn < TURN
    assert math.cos(turn - (b - a)) == pytest.approx(1.0)


@settings(deadline=None)
@given(lengths, angles, st.floats(0.0, 0.1), angles, st.floats(-0.8, 0.8), st.floats(-1.0, 0.5), lengths)
def test_disk_on_segment(rho, phi, w, nu, h, ta, size):
    tb = ta + size
    nx, nz = polar(1.0, nu)

    def gap(theta):
        x, z = polar(rho, phi + theta)
        return nx * x + nz * z - h - w

    def along(theta):
        x, z = polar(rho, phi + theta)
        return nx * z - nz * x

    assume(abs(gap(0.0)) > 1e-6 and abs(abs(h + w) - rho) > 1e-4)
    expected = first_entering(gap, lambda t: ta <= along(t) <= tb)
    roots = [math.sqrt(max(rho**2 - (h + w) ** 2, 0.0)) * s for s in (1, -1)]
    assume(all(abs(r - e) > 1e-7 for r in roots for e in (ta, tb)))
    compare(disk_on_segment(*polar(rho, phi), w, nx, nz, h, ta, tb, TOUCH, TURN), expected)


@settings(deadline=None)
@given(lengths, angles, st.floats(0.0, 0.1), angles, st.floats(-0.8, 0.8), st.floats(-1.0, 0.5), lengths)
def test_side_on_vertex(r, alpha, w, mu, g, ta, size):
    tb = ta + size
    q = polar(r, alpha)

    def gap(theta):
        mx, mz = polar(1.0, mu + theta)
        return mx * q[0] + mz * q[1] - g - w

    def along(theta):
        mx, mz = polar(1.0, mu + theta)
        return mx * q[1] - mz * q[0]

    assume(abs(gap(0.0)) > 1e-6 and abs(abs(g + w) - r) > 1e-4)
    expected = first_entering(gap, lambda t: ta <= along(t) <= tb)
    roots = [math.sqrt(max(r**2 - (g + w) ** 2, 0.0)) * s for s in (1, -1)]
    assume(all(abs(x - e) > 1e-7 for x in roots for e in (ta, tb)))
    compare(side_on_vertex(*polar(1.0, mu), g, ta, tb, *q, w, TOUCH, TURN), expected)


@settings(deadline=None)
@given(lengths, angles, lengths, angles, st.floats(0.02, 0.3))
def test_disk_on_vertex(rho, phi, r, alpha, w):
    q = polar(r, alpha)

    def gap(theta):
        x, z = polar(rho, phi + theta)
        return math.hypot(x - q[0], z - q[1]) - w

    assume(abs(gap(0.0)) > 1e-6 and abs(abs(rho - r) - w) > 1e-5 and abs(rho + r - w) > 1e-5)
    found = disk_on_vertex(*polar(rho, phi), rho, *q, r, w, TOUCH, TURN)
    compare(found, first_entering(gap, lambda _: True))


def test_small_disks_keep_all_their_digits():
    """w = 1e-9: the form with acos would lose half of them."""
    w = 1e-9
    found = disk_on_vertex(1.0, 0.0, 1.0, *polar(1.0, 0.5), 1.0, w, 1e-16, TURN)
    assert 0.5 - found == pytest.approx(2.0 * math.asin(w / 2.0), rel=1e-6)


@pytest.mark.parametrize("gap", [0.0, 1e-11, -1e-11])
def test_a_touching_pair_blocks_only_while_its_gap_shrinks(gap):
    """A vertex at (1, 0) turns upwards: the wall above stops it at once, the wall below is being left."""
    above = disk_on_segment(1.0, gap * -1.0, 0.0, 0.0, -1.0, 0.0, -2.0, 2.0, TOUCH, TURN)
    assert above == 0.0
    below = disk_on_segment(1.0, gap, 0.0, 0.0, 1.0, 0.0, -2.0, 2.0, TOUCH, 1.0)
    assert below == 1.0


def test_a_pair_that_is_left_comes_back_after_its_turn():
    """A vertex leaves a short ledge upwards and comes down on the other half of the line half a turn later."""
    found = disk_on_segment(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, -2.0, 2.0, TOUCH, TURN)
    assert found == pytest.approx(math.pi)


def test_a_gap_that_stands_still_blocks_when_it_bends_down():
    """A vertex at the top of its circle: a ceiling there is only grazed, a floor line outside bends away."""
    assert disk_on_segment(0.0, 1.0, 0.0, 0.0, -1.0, -1.0, -2.0, 2.0, TOUCH, 1.0) == 1.0
    inner = disk_on_vertex(0.0, 1.0, 1.0, 0.0, 0.4, 0.4, 0.6, TOUCH, 1.0)
    assert inner == 1.0  # the far side of a circle about a nearer point: the distance grows both ways
    outer = disk_on_vertex(0.0, 1.0, 1.0, 0.0, 1.6, 1.6, 0.6, TOUCH, 1.0)
    assert outer == 1.0  # passing a point outside: nearest now, leaving both ways


def test_a_lever_arm_of_nothing_blocks_nothing():
    assert disk_on_segment(0.0, 0.0, 0.0, 0.0, -1.0, 0.0, -2.0, 2.0, TOUCH, 1.0) == 1.0
    assert disk_on_vertex(0.0, 0.0, 0.0, 0.1, 0.0, 0.1, 0.1, TOUCH, 1.0) == 1.0
    assert side_on_vertex(0.0, 1.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, TOUCH, 1.0) == 1.0


def test_feet_are_closed_and_widened_by_rounding_only():
    """The link vertex arrives exactly at the end of the segment: a strict test would let it through."""
    end = math.sqrt(1.0 - 0.25)
    arrives = [disk_on_segment(1.0, 0.0, 0.0, 0.0, -1.0, -0.5, -2.0, e, TOUCH, TURN) for e in (end, end - 1e-9)]
    assert arrives[0] == pytest.approx(math.pi / 6)
    assert arrives[1] == TURN


def test_events_later_than_the_best_are_of_no_interest():
    assert disk_on_segment(1.0, 0.0, 0.0, 0.0, -1.0, -0.5, -2.0, 2.0, TOUCH, 0.3) == 0.3
    assert side_on_vertex(0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 1.0, 0.0, TOUCH, 0.3) == 0.3
    assert disk_on_vertex(1.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.1, TOUCH, 0.3) == 0.3


@given(st.floats(0.01, 1.0), st.floats(-1.0, 1.0).map(lambda s: s * TOUCH))
def test_the_grazing_band_is_what_moving_by_the_tolerance_changes(u, shift):
    assert abs((u + shift) ** 2 - u**2) <= grazing_band(u, TOUCH) * (1 + 1e-6) + 1e-30


@pytest.mark.parametrize("swapped", [False, True])
def test_a_touching_point_at_the_pivot_blocks_nothing(swapped):
    """It moves by less than the touch tolerance, whichever of the two it is and whichever way it goes."""
    w, near = 0.01, 0.5 * TOUCH
    for side in (-near, near):
        link, thing = (0.0, side), (w, 0.0)
        if swapped:
            link, thing = (w, 0.0), (0.0, side)
        found = disk_on_vertex(*link, math.hypot(*link), *thing, math.hypot(*thing), w, TOUCH, 1.0)
        assert found != 0.0
