"""What stays beyond a plane in a window does so wherever the chain is in it."""

import numpy as np
import pytest

from clench.kernels.geometry.bodies import Elements, pack_bodies
from clench.kernels.grid import round_motion
from clench.kernels.toi import core_motion, toi_work
from clench.kernels.toi.toi_work import BodyPair
from kernels.kernel_entries import entry
from kernels.toi.test_toi_bodies import drawn_chain, pose

make_sweep_work, move_core = entry(toi_work.make_sweep_work), entry(core_motion.move_core)
motion_of_core, put_corners = entry(round_motion.motion_of_core), entry(round_motion.put_corners)
begin_window, stays_over = entry(round_motion.begin_window), entry(round_motion.stays_over)

POINT = pack_bodies([Elements(np.zeros((1, 3)), np.zeros((1, 3), np.int32), np.zeros(1))])


@pytest.mark.parametrize("corners", [1, 2])
def test_a_plane_that_is_said_to_keep_a_core_off_does(corners):
    kept, most = [0, 0, 0], 0
    for seed in range(900):
        rng, work = np.random.default_rng(seed), make_sweep_work(8, 0)
        chain = drawn_chain(seed, rng)
        work.resting[:] = pose(rng, 0.1 * rng.normal(size=3))
        work.core[:corners] = 0.1 * rng.normal(size=(corners, 3))
        pair = BodyPair(POINT, 0, POINT, 0, chain, len(chain), 1e-11)
        motion = motion_of_core(pair, corners, 0.0, work)
        s = float(rng.uniform(0.0, 2.0))
        length = float(rng.uniform(0.0, 0.3 if seed % 2 else 3.0)) / np.abs(chain[:, 0]).sum()
        put_corners(pair, motion, s, work)
        begin_window(pair, motion, s, s + length, work)
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        top = float((work.round[:corners] @ n).min() - 0.1 * rng.random() ** 3)
        out, heights = np.zeros((6, 3)), []
        for t in np.linspace(s, s + length, 200):
            move_core(work.core, corners, chain, len(chain), t, out)
            heights.append((((out[:corners] - work.resting[:, 3]) @ work.resting[:, :3]) @ n).min())
        np.testing.assert_allclose(work.round[6 : 6 + corners], out[:corners], atol=1e-15)
        if stays_over(motion, work.round, tuple(n), top):
            assert min(heights) > top - 1e-15
            kept[seed % 3] += 1
        elif motion.single and min(heights) > top + 1e-6:
            most += 1  # nothing is lost with one joint
    assert min(kept) > 40
    assert most == 0
