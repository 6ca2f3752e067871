"""How far outlines are from sections: against points laid densely on both."""

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

from clench.kernels.closing.layout import KIND_EDGE, KIND_SIDE, KIND_TIP, RUN, Outline, SectionArrays, Work
from clench.kernels.sections import outline_gap, plane_sections
from kernels.kernel_entries import entry

outline_distance, core_distance = entry(outline_gap.outline_distance), entry(outline_gap.core_distance)
round_distance, put_circles = entry(outline_gap.round_distance), entry(plane_sections.put_circles)
SIZE = 0.03
TOUCH = 1e-10
DENSE = 300


def rows_of(points):
    """Return sides (n_x, n_z, g, t_a, t_b) from each point to the next; none for one point."""
    rows = []
    for a, b in zip(points, np.roll(points, -1, axis=0), strict=True):
        run = b - a
        if np.hypot(*run) > 0.0:
            nx, nz = np.array([run[1], -run[0]]) / np.hypot(*run)
            along = sorted([-nz * a[0] + nx * a[1], -nz * b[0] + nx * b[1]])
            rows.append([nx, nz, nx * a[0] + nz * a[1], *along])
    return np.array(rows).reshape(-1, 5)


def placed(points, radius, both=False):
    """Return an outline whose core goes through points, and scratch space that holds it."""
    side = rows_of(points)
    vertex = np.column_stack([points, np.hypot(points[:, 0], points[:, 1])])
    flat, line, whole = np.zeros((1, 3)), np.zeros(1), np.zeros(13, dtype=np.int64)
    stadium, pose = np.zeros((1, 6)), np.zeros((2, 3, 4))
    work = Work(flat, flat, line, vertex, side, stadium, flat, flat, line, line, line, whole[:1], pose, whole)
    tip = KIND_TIP if radius > 0.0 else KIND_EDGE
    return Outline(0, 0, len(vertex), 0, len(side), radius, both, tip), work


def sections(segments=(), disks=(), ellipses=()):
    """Return one row of sections."""
    rows = np.array(segments, dtype=float).reshape(1, -1, 6)
    disks, ellipses = np.array(disks, dtype=float).reshape(1, -1, 3), np.array(ellipses, dtype=float).reshape(1, -1, 8)
    counts = np.array([[rows.shape[1], disks.shape[1], ellipses.shape[1]]])
    none = np.zeros((1, 1), dtype=np.int64)
    made = SectionArrays(rows, none, disks, none, ellipses, none, counts, np.empty((1, len(rows[0]) // RUN + 1, 3)))
    put_circles(made, 0)
    return made


def between(a, b, count=DENSE):
    """Return points evenly from one to the other, both included."""
    return a + np.linspace(0.0, 1.0, count)[:, None] * (np.asarray(b) - a)


def core(points):
    """Return points laid densely on the core, and how far apart they are at most."""
    if len(points) == 1:
        return points, 0.0
    longest = np.hypot(*(points - np.roll(points, -1, axis=0)).T).max()
    laid = [between(a, b) for a, b in zip(points, np.roll(points, -1, axis=0), strict=True)]
    return np.vstack(laid), longest / (DENSE - 1)


def ellipse(rng, *, cut):
    """Return an ellipse's row; cut by two caps or whole."""
    a, turn = SIZE * rng.uniform(0.3, 1.0), rng.uniform(0.0, 7.0)
    low, high = np.sort(rng.uniform(-a, a, 2)) if cut else (-a, a)
    return np.array(
        [*rng.normal(scale=SIZE, size=2), math.cos(turn), math.sin(turn), a, a * rng.uniform(0.2, 1), low, high]
    )


def arcs(e, count=4000):
    """Return points laid densely on an ellipse between its caps, and the caps' ends, two for each cap."""
    x, z, u, v, a, b, low, high = e
    angle = np.linspace(0.0, 2.0 * math.pi, count)
    local = np.column_stack([a * np.cos(angle), b * np.sin(angle)])
    local = local[(local[:, 0] >= low) & (local[:, 0] <= high)]
    ends = [[t, sign * b * math.sqrt(max(1.0 - (t / a) ** 2, 0.0))] for t in (low, high) for sign in (-1.0, 1.0)]
    out = np.array([[u, v], [-v, u]])
    return np.array([x, z]) + local @ out, np.array([x, z]) + np.array(ends) @ out


def holds(e, points):
    """Say which points lie in an ellipse's section."""
    dx, dz = (points - e[:2]).T
    t, y = dx * e[2] + dz * e[3], dz * e[2] - dx * e[3]
    return (np.hypot(t / e[4], y / e[5]) <= 1.0) & (t >= e[6]) & (t <= e[7])


def nearest(one, other):
    """Return the least distance between points of two sets."""
    return cKDTree(other).query(one)[0].min()


def to_line(p, a, b):
    """Return the distance of a point to the points between two."""
    t = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return np.hypot(*(a + t * (b - a) - p))


def shape(rng):
    """Return the corners of a core (one, two or more), far from the origin as often as near."""
    count = int(rng.choice([1, 2, 3, 5]))
    return rng.normal(scale=SIZE, size=(count, 2)) + rng.normal(scale=2.0 * SIZE, size=2)


def segment(rng):
    """Return a segment's row, whose normal looks to either side."""
    a, b = rng.normal(scale=SIZE, size=(2, 2)) + rng.normal(scale=SIZE, size=2)
    n = np.array([b[1] - a[1], a[0] - b[0]]) / np.hypot(*(b - a)) * rng.choice([-1.0, 1.0])
    return np.array([*a, *b, *n])


@pytest.mark.parametrize("first", range(4))
def test_the_core_s_nearest_point_to_a_point(first):
    rng = np.random.default_rng([1, first])
    for _ in range(60):
        points, q = shape(rng), rng.normal(scale=3.0 * SIZE, size=2)
        outline, work = placed(points, 0.0)
        d, x, z = core_distance(outline, *q, work)
        laid, step = core(points)
        least = nearest(laid, q[None])
        assert least - step - 1e-12 <= d <= least + 1e-12
        assert math.hypot(x, z) == pytest.approx(1.0)
        foot = q + d * np.array([x, z])
        sides = zip(points, np.roll(points, -1, axis=0), strict=True)
        assert min(to_line(foot, a, b) if len(points) > 1 else np.hypot(*(foot - a)) for a, b in sides) < 1e-12
    assert core_distance(outline, *points[0], work) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("both", [False, True])
@pytest.mark.parametrize("radius", [0.0, 0.004])
def test_the_nearest_pair_of_an_outline_and_segments(radius, both):
    seen = set()
    rng = np.random.default_rng(2)
    for _ in range(200):
        points, rows = shape(rng), np.array([segment(rng) for _ in range(3)])
        outline, work = placed(points, radius, both)
        found = outline_distance(outline, sections(rows), 0, TOUCH, work) + radius
        laid, step = core(points)
        lines = [between(r[:2], r[2:4]) for r in rows]
        least = nearest(laid, np.vstack(lines))
        steps = step + max(np.hypot(*(r[:2] - r[2:4])) for r in rows) / (DENSE - 1)
        if least < 2.0 * steps:
            continue
        assert least - steps <= found <= least + 1e-12
        kind, _, feature, source, which, which_shape = work.best[:6]
        a, b, n = rows[source, :2], rows[source, 2:4], rows[source, 4:]
        assert which_shape == 0
        if kind == KIND_SIDE:
            end, side = (a, b)[which & 1], work.side[feature]
            behind = side[:2] @ end < side[2]
            assert abs(side[:2] @ end - side[2]) == pytest.approx(found, abs=1e-12)
            assert (which >= 2) == (both and behind)
            seen.add(("side", int(which)))
            continue
        p = points[feature]
        assert kind == outline.tip
        # A round tip beside the end of a segment touches the end; a sharp one touches the segment.
        assert (which < 2) == (radius == 0.0 or 0.0 < (p - a) @ (b - a) < (b - a) @ (b - a))
        if which < 2:
            assert to_line(p, a, b) == pytest.approx(found, abs=1e-12)
            foot = p - n * (n @ (p - a))
            assert (which == 1) == (n @ (p - foot) < 0.0) or min(np.hypot(*(p - a)), np.hypot(*(p - b))) < found + 1e-12
        else:
            assert np.hypot(*(p - (a, b)[which - 2])) == pytest.approx(found, abs=1e-12)
        seen.add(("corner", int(which)))
    expected = {("side", w) for w in (range(4) if both else range(2))}
    expected |= {("corner", w) for w in (range(4) if radius > 0.0 else range(2))}
    assert seen == expected


@pytest.mark.parametrize(("height", "behind"), [(0.5, 0), (0.0, 0), (-0.5, 0), (-3.0, 1)])
def test_a_corner_that_touches_a_segment_is_in_front_of_it(height, behind):
    up = np.array([0.0, height * TOUCH])
    outline, work = placed(np.array([[0.01, 0.0], [0.02, 0.01], [0.0, 0.01]]) + up, 0.0)
    found = outline_distance(outline, sections([[0.05, 0.0, -0.05, 0.0, 0.0, 1.0]]), 0, TOUCH, work)
    assert found == pytest.approx(abs(height) * TOUCH, abs=1e-3 * TOUCH)
    assert work.best[:6].tolist() == [KIND_EDGE, 0, 0, 0, behind, 0]


@pytest.mark.parametrize("both", [False, True])
@pytest.mark.parametrize("radius", [0.0, 0.004])
def test_the_nearest_disk(radius, both):
    sides = corners = 0
    rng = np.random.default_rng(3)
    for _ in range(100):
        points = shape(rng)
        disks = np.column_stack([rng.normal(scale=2.0 * SIZE, size=(3, 2)), rng.uniform(0.001, 0.01, 3)])
        outline, work = placed(points, radius, both)
        found = outline_distance(outline, sections(disks=disks), 0, TOUCH, work)
        laid, step = core(points)
        gaps = np.array([nearest(laid, d[None, :2]) - d[2] - radius for d in disks])
        assert gaps.min() - step - 1e-12 <= found <= gaps.min() + 1e-12
        assert round_distance(outline, sections(disks=disks), 0, math.inf, work) == found
        assert round_distance(outline, sections(disks=disks), 0, found, work) == found
        kind, _, feature, source, which, which_shape = work.best[:6]
        middle, reach = disks[source, :2], disks[source, 2] + radius
        assert which_shape == 1
        if kind == KIND_SIDE:
            side = work.side[feature]
            assert abs(side[:2] @ middle - side[2]) - reach == pytest.approx(found, abs=1e-12)
            assert (which == 2) == (both and bool(side[:2] @ middle < side[2]))
            sides += 1
        else:
            assert np.hypot(*(points[feature] - middle)) - reach == pytest.approx(found, abs=1e-12)
            corners += 1
    assert min(sides, corners) > 20


@pytest.mark.parametrize("cut", [False, True])
@pytest.mark.parametrize("radius", [0.0, 0.004, 0.02])
def test_the_gap_to_an_ellipse(radius, cut):
    """A cut one has its caps as segments, as sections have them."""
    apart = overlapping = sides = 0
    rng = np.random.default_rng(4)
    for _ in range(100):
        points, e = shape(rng), ellipse(rng, cut=cut)
        points += rng.uniform(0.0, 1.0) * (e[:2] - points.mean(axis=0))
        arc, ends = arcs(e)
        caps = [[*ends[0], *ends[1], -e[2], -e[3]], [*ends[2], *ends[3], e[2], e[3]]] if cut else []
        outline, work = placed(points, radius)
        found = outline_distance(outline, sections(caps, ellipses=[e]), 0, TOUCH, work)
        laid, step = core(points)
        around = np.vstack([arc, between(ends[0], ends[1]), between(ends[2], ends[3])])
        step += 2.0 * math.pi * e[4] / 3999 + 2.0 * e[5] / (DENSE - 1)
        if holds(e, laid).any():
            # What goes in by a cap crosses that segment, which tells; else the gap is below 0 where the core is inside.
            assert cut or found <= step - radius
            overlapping += 1
            continue
        least = nearest(laid, around)
        if least > 2.0 * step:
            assert least - step <= found + radius <= least + step
            sides += work.best[0] == KIND_SIDE
            apart += 1
    assert min(apart, overlapping) > 20
    assert sides > 10
