"""The stadium around an outline, wherever it is put; and what it says about what can be met first."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.closing.outlines import RoundedOutline
from clench.closing.plan_packing import enclosing
from clench.kernels.closing.layout import Outline, SectionArrays, Work
from clench.kernels.sections import outline_sweep, plane_sections
from kernels.kernel_entries import entry
from oracle.adapter import solve_planar
from oracle.cases import placed_vertices, random_finger
from oracle.checking import check_answer
from oracle.planar import gap_at
from oracle.scene import PlanarCurve
from oracle.shapes import turned

put_circles = entry(plane_sections.put_circles)
put_stadium, stadium_gap, farthest, first_near = (
    entry(f)
    for f in (outline_sweep.put_stadium, outline_sweep.stadium_gap, outline_sweep.farthest, outline_sweep.first_near)
)

number = st.floats(-0.05, 0.05)
corners = st.lists(st.tuples(number, number), min_size=1, max_size=8)


def outline(points, radius):
    """Return an outline with a side from each point to the next."""
    vertices = np.array(points)
    runs = np.roll(vertices, -1, axis=0) - vertices
    lengths = np.linalg.norm(runs, axis=1)
    along = runs[lengths > 1e-9] / lengths[lengths > 1e-9, None]
    sides = np.zeros((len(along), 5))
    sides[:, 0], sides[:, 1] = along[:, 1], -along[:, 0]
    return RoundedOutline(vertices, sides, radius)


@settings(max_examples=200, deadline=None)
@given(corners, st.floats(0.0, 0.01), st.floats(-7.0, 7.0), number, number, st.sampled_from([1.0, -1.0]))
def test_a_placed_outline_lies_in_its_placed_stadium(points, radius, angle, dx, dz, mirror):
    shape = outline(points, radius)
    placed = np.empty((1, 6))
    c, s = np.cos(angle), np.sin(angle)
    put_stadium(enclosing(shape)[None], 0, c, s, dx, dz, mirror, placed)
    moved = shape.vertices @ np.array([[c, s], [-s, c]]) + [dx, dz]
    moved[:, 1] *= mirror
    gaps = np.array([stadium_gap(placed, 0, x, z) for x, z in moved])
    assert gaps.max() <= -radius + 1e-15
    assert np.linalg.norm(moved, axis=1).max() + radius <= farthest(placed, 0) + 1e-15


@settings(max_examples=100, deadline=None)
@given(number, number, number, number, st.floats(1e-4, 0.01), number, number)
def test_the_gap_of_a_stadium_is_that_of_its_middle_line(ax, az, bx, bz, radius, x, z):
    placed = np.empty((1, 6))
    put_stadium(np.array([[ax, az, bx, bz, radius]]), 0, 1.0, 0.0, 0.0, 0.0, 1.0, placed)
    t = np.linspace(0.0, 1.0, 4001)
    line = np.column_stack([ax + t * (bx - ax), az + t * (bz - az)])
    nearest = np.linalg.norm(line - [x, z], axis=1).min() - radius
    step = np.hypot(bx - ax, bz - az) / 4000
    assert stadium_gap(placed, 0, x, z) <= nearest + 1e-12
    assert stadium_gap(placed, 0, x, z) >= nearest - step


@settings(max_examples=200, deadline=None)
@given(number, number, number, number, number, number, st.floats(0.1, 3.0))
def test_a_travel_that_is_said_to_be_free_reaches_no_point_of_a_segment(ax, az, bx, bz, x, z, speed):
    """The outline is a disk about a point; no point of it is faster than `speed`."""
    radius, touch = 0.002, 1e-9
    flat, line, whole = np.zeros((1, 3)), np.zeros(1), np.zeros(13, dtype=np.int64)
    stadium = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, radius]])
    pose = np.zeros((2, 3, 4))
    work = Work(flat, flat, line, flat, flat, stadium, flat, flat, line, line, line, whole, pose, whole)
    segment = np.array([[[ax, az, bx, bz, 0.0, 1.0]]])
    none, rows = np.zeros((1, 0, 3)), np.zeros((1, 1), dtype=np.int64)
    counts = np.array([[1, 0, 0]])
    sections = SectionArrays(segment, rows, none, rows, np.zeros((1, 0, 8)), rows, counts, np.empty((1, 1, 3)))
    put_circles(sections, 0)
    free, nearest = first_near(Outline(0, 0, 0, 0, 0, radius, False, 1), sections, 0, x, z, speed, touch, work)
    t = np.linspace(0.0, 1.0, 1001)
    away = np.hypot(ax + t * (bx - ax) - x, az + t * (bz - az) - z).min()
    assert nearest == 0
    assert 0.0 <= free * speed <= max(away - radius - touch, 0.0) + 1e-12
    # Not less than the circle around the segment leaves.
    middle = np.hypot(0.5 * (ax + bx) - x, 0.5 * (az + bz) - z) - 0.5 * np.hypot(bx - ax, bz - az)
    assert free * speed >= middle - radius - touch - 1e-12


def before_a_wall(seed, joints):
    """Return a finger whose joints all move at once, and one long segment in its way that it does not touch yet."""
    rng = np.random.default_rng([6, seed])
    while True:
        finger = random_finger(rng, joints=joints)
        rates = rng.uniform(0.4, 1.2, joints) * rng.choice([-1.0, 1.0])
        finger = replace(finger, dof=np.zeros(joints, dtype=np.int64), rates=rates)
        half = rng.uniform(0.004, 0.1)
        line = turned(np.array([[-half, 0.0], [half, 0.0]]), rng.uniform(0.0, 7.0))
        met = placed_vertices(finger, rng.uniform(0.0, 1.0, 1), int(rng.integers(len(finger.outlines))))
        curve = PlanarCurve(lines=(line + met[0] + rng.uniform(-0.9, 0.9) * line[1],), two_sided=True)
        if gap_at(finger, curve, np.zeros(1)) > 1e-5:
            return finger, curve


@pytest.mark.parametrize("joints", [1, 2, 3])
def test_a_single_segment_is_met_wherever_the_scene_lies(joints):
    """Across either axis or far from both; nothing else is there that would make the kernel look at it."""
    stopped = 0
    for seed in range(60):
        finger, curve = before_a_wall(seed, joints)
        middle = curve.lines[0].mean(axis=0)
        found = []
        for to in (middle, np.zeros(2), np.array([0.0, 0.3]), np.array([-0.3, 0.0]), np.array([0.2, -0.4])):
            pivots = finger.pivots.copy()
            pivots[0] += to - middle
            there, wall = replace(finger, pivots=pivots), curve.moved(to - middle)
            (stage,), answer = solve_planar(there, wall)
            assert not check_answer(there, wall, (stage,)).failures
            found.append(stage.parameter)
        assert found == pytest.approx([found[0]] * len(found), abs=1e-7)
        stopped += int(answer.contacts[0])
    assert stopped > 20
