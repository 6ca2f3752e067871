"""Bounds on when parts can meet: never later than they do, by sampling; and near enough to be of use."""

import math

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from clench.kernels.toi import toi_bounds as earliest
from kernels.kernel_entries import entry
from kernels.plain_sweeps import stays_above

turn_measure, measure_of = entry(earliest.turn_measure), entry(earliest.measure_of)
ball_entry = entry(earliest.ball_entry)

length = st.floats(-1.0, 1.0).map(lambda x: round(x, 3))
point = st.tuples(length, length, length)


def turned(p, angle):
    """A positive turn takes x towards z."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * p[0] - s * p[2], p[1], s * p[0] + c * p[2]])


def test_the_measure_grows_with_the_turn():
    turns = np.concatenate([np.geomspace(1e-15, 1e-3, 200), np.linspace(2e-3, 2 * math.pi - 1e-9, 2000)])
    measures = [turn_measure(3.0 * math.cos(t), 3.0 * math.sin(t)) for t in turns]
    assert np.all(np.diff(measures) > 0.0)
    assert measures[0] > 0.0
    assert measures[-1] < 4.0
    assert measure_of(2 * math.pi) == math.inf
    assert measure_of(1.0) == turn_measure(math.cos(1.0), math.sin(1.0))


@settings(deadline=None, max_examples=300)
@given(length, length, length, length, st.floats(0.0, 1.0))
@example(1.0, 0.0, 1.0, 1.0, 0.9999999999999999)
def test_a_point_enters_a_circle_where_sampling_says(ax, az, bx, bz, reach):
    found = ball_entry(ax, az, bx, bz, reach * reach)
    angles = np.linspace(0.0, 2 * math.pi, 4000, endpoint=False)
    x, z = np.cos(angles) * ax - np.sin(angles) * az, np.sin(angles) * ax + np.cos(angles) * az
    apart = np.hypot(x - bx, z - bz) - reach
    inside = np.flatnonzero(apart < -1e-9)
    if len(inside):
        assert found <= turn_measure(math.cos(angles[inside[0]]), math.sin(angles[inside[0]])) + 1e-12
        if inside[0] > 0 and apart[: inside[0]].min() > 1e-6:
            before = angles[inside[0] - 1]
            assert found >= turn_measure(math.cos(before), math.sin(before)) - 1e-12
    elif abs(math.hypot(ax, az) - math.hypot(bx, bz)) > reach + 1e-9:
        assert found == math.inf


@settings(deadline=None, max_examples=300)
@given(
    st.lists(point, min_size=3, max_size=3),
    st.lists(st.tuples(st.sampled_from([1.0, -0.7, 2.0]), length, length), min_size=2, max_size=2),
    st.integers(1, 2),
    point,
    st.floats(-1.0, 1.0),
    st.floats(0.0, 1.0),
    st.floats(0.01, 1.5),
)
def test_what_stays_above_a_plane_does(core, rows, count, normal, offset, part, best):
    if np.linalg.norm(normal) < 0.1:
        return
    core, chain, n = np.array(core), np.array(rows), np.array(normal) / np.linalg.norm(normal)
    placed, begin = np.empty((6, 3)), part * best
    if stays_above(core, placed, 3, chain, count, *n, offset, begin, best):
        for s in np.linspace(begin, best, 200):
            base = np.zeros(3)
            for rate, x, z in chain[: count - 1]:
                base += turned((x, 0.0, z), rate * s)
            for corner in core:
                assert n @ (base + turned(corner, chain[count - 1, 0] * s)) >= offset - 1e-12


def test_what_rests_on_a_plane_is_not_said_to_stay_above():
    core, chain = np.zeros((3, 3)), np.array([[1.0, 0.0, 0.0]])
    assert not stays_above(core, np.empty((6, 3)), 1, chain, 1, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0)
    assert stays_above(core, np.empty((6, 3)), 1, chain, 1, 0.0, 1.0, 0.0, -1e-12, 0.0, 1.0)
