"""Planes that turn with a hull: how far the hull stays beyond what rests, and what they are good for."""

import math

import numpy as np
import pytest

from clench.kernels.geometry.bodies import Elements, pack_bodies
from clench.kernels.hulls import hull_motion, hull_window, turned_planes
from clench.kernels.hulls.enclosing_hulls import pack_hulls
from clench.kernels.hulls.hull_window import END, NOW, SIMPLEX
from clench.kernels.toi import toi_work as sweeping
from kernels.hulls.test_hull_sweep import drawn
from kernels.kernel_entries import entry
from kernels.plain_sweeps import clear_travel
from kernels.toi.test_toi_bodies import KINDS, TOUCH

make_sweep_work, put_pose = entry(sweeping.make_sweep_work), entry(hull_motion.put_pose)
motion_of_hull, height = entry(hull_motion.motion_of_hull), entry(hull_motion.height)
remember, put_turned = entry(turned_planes.remember_turned), entry(turned_planes.put_turned)
left_over, normal_of = entry(turned_planes.left_over), entry(turned_planes.normal_of)
is_there, forget = entry(turned_planes.is_there), entry(hull_window.forget_planes)


@pytest.mark.parametrize("kind", KINDS)
def test_a_hull_stays_beyond_what_rests_by_what_is_left(kind):
    told = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        moving, _, chain, _, work = drawn(seed, (kind, "soup"), True)
        length, window = float(rng.uniform(0.01, 0.6)), work.hull
        motion = motion_of_hull(moving, 0, chain, len(chain), work)
        put_pose(chain, len(chain), 0.0, work, window[NOW:END])
        put_pose(chain, len(chain), length, work, window[END:SIMPLEX])
        n = rng.normal(size=3)
        n = tuple(n / np.linalg.norm(n))
        start = height(moving.hulls, motion, window[NOW:END], n)
        forget(window)
        remember(motion, n, start, window[NOW:END], window)
        put_turned(motion, window[NOW:END], window[END:SIMPLEX], length, window)
        then = np.array(normal_of(0, True, window))
        q = rng.normal(size=3) * 0.02 + window[NOW:END, 3] - (0.06 + rng.uniform(0.0, 0.05)) * np.array(n)
        left = left_over(0, float(q @ n), float(q @ then), window)
        corners = moving.hulls.points[: moving.hulls.first[1]]
        for u in np.linspace(0.0, 1.0, 21):
            T, along = np.empty((3, 4)), (1.0 - u) * np.array(n) + u * then
            put_pose(chain, len(chain), u * length, work, T)
            low = (corners @ T[:, :3].T + T[:, 3]) @ along - moving.hulls.radius[0] * np.linalg.norm(along)
            assert low.min() - q @ along >= left - 1e-12
        told += left > 0.0
    assert told >= 20


def test_planes_of_other_hulls_are_out():
    moving, _, chain, _, work = drawn(1, ("soup", "soup"), True)
    window, motions = work.hull, [motion_of_hull(moving, k, chain, len(chain), work) for k in range(2)]
    put_pose(chain, len(chain), 0.0, work, window[NOW:END])
    forget(window)
    assert not is_there(0, window)
    remember(motions[0], (1.0, 0.0, 0.0), 0.3, window[NOW:END], window)
    for motion, there in zip(motions, (True, False), strict=True):
        put_turned(motion, window[NOW:END], window[NOW:END], 0.1, window)
        assert is_there(0, window) == there
        assert not is_there(1, window)


def test_a_face_that_turns_onto_an_edge_is_clear_almost_until_they_touch():
    # A flat plate turns about its end; the edge lies near the axis, so that the plate's far end sweeps deep below it.
    corners = np.array(np.meshgrid([0.0, 0.1], [-0.02, 0.02], [0.0, 0.004])).reshape(3, -1).T
    faces = np.array([[0, 1, 3], [0, 3, 2], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4], [2, 3, 7], [2, 7, 6]])
    faces = np.vstack([faces, [[0, 2, 6], [0, 6, 4], [1, 3, 7], [1, 7, 5]]]).astype(np.int32)
    plate = pack_bodies([Elements(corners, faces, np.zeros(12))])
    blade = np.array([[0.02, -0.03, 0.0], [0.02, 0.03, 0.0], [0.02, 0.0, 0.05]])
    resting = pack_bodies([Elements(blade, np.array([[0, 1, 2]], np.int32), np.zeros(1))])
    resting = resting._replace(hulls=pack_hulls([()]))
    work = make_sweep_work(2, 0)
    work.moving[:] = np.eye(3, 4)
    work.resting[:] = np.eye(3, 4)
    work.resting[2, 3] = 0.01
    chain = np.array([[1.0, 0.0, 0.0]])
    found = clear_travel(plate, 0, resting, 0, chain, 1, TOUCH, 1.5, work)
    # The upper face, 4 mm over the axis, meets the blade's lower edge.
    square = math.hypot(0.02, 0.01)
    expected = math.atan2(0.01, 0.02) - math.asin(0.004 / square)
    assert expected - 1e-4 <= found <= expected


@pytest.mark.parametrize("rates", [(1.0, 0.0), (1.0, 1.0), (1.0, -0.7), (0.3, 1.5)])
def test_no_point_gets_lower_over_a_turning_plane_than_told(rates):
    """The first joint carries the body around, the rates of the body itself turn it: with 0 it only bends its way."""
    for seed in range(40):
        rng = np.random.default_rng(seed)
        moving, _, _, _, work = drawn(seed, ("soup", "soup"), True)
        chain = np.array([[rates[0], 0.08 * rng.normal(), 0.08 * rng.normal()], [rates[1], 0.0, 0.0]])
        motion, window, length = motion_of_hull(moving, 0, chain, 2, work), work.hull, float(rng.uniform(0.1, 1.0))
        points = moving.hulls.points[moving.hulls.first[0] : moving.hulls.first[1]]
        poses = [np.zeros((3, 6)) for _ in range(101)]
        for pose, s in zip(poses, np.linspace(0.0, length, len(poses)), strict=True):
            put_pose(chain, 2, float(s), work, pose)
        window[NOW:END], n = poses[0], rng.normal(size=3)
        n /= np.linalg.norm(n)
        forget(window)
        start = (poses[0][:, :3] @ points.T + poses[0][:, 3:4]).T @ n
        remember(motion, tuple(n), float(start.min()), window[NOW:END], window)
        put_turned(motion, window[NOW:END], poses[-1], length, window)
        first, last = np.array(normal_of(0, False, window)), np.array(normal_of(0, True, window))
        rests, heights = rng.normal(size=3) * 0.1, []
        for share, pose in zip(np.linspace(0.0, 1.0, len(poses)), poses, strict=True):
            placed = (pose[:, :3] @ points.T + pose[:, 3:4]).T
            heights.append(((placed - rests) @ (first + share * (last - first))).min())
        told = left_over(0, float(rests @ first), float(rests @ last), window)
        assert told <= min(heights) + 1e-12
