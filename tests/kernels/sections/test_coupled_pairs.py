"""Links that several joints move at once against sheets, flipped loops and round ends, judged by the oracle's gaps."""

from dataclasses import replace

import numpy as np
import pytest

from oracle.adapter import solve_planar
from oracle.cases import placed_vertices, pushed_against, random_finger, scaled
from oracle.checking import check_answer
from oracle.planar import gap_at
from oracle.scene import PlanarCurve
from oracle.shapes import CURVES, turned


def moved_at_once(seed, kinds):
    """Return a finger of two or three joints, all in one degree of freedom and at rates of their own, and what draws
    on.
    """
    rng = np.random.default_rng([5, seed])
    count = int(rng.choice([2, 3]))
    finger = random_finger(rng, kinds, count)
    rates = rng.uniform(0.3, 1.2, count) * rng.choice([1.0, 1.0, -1.0], count)
    return replace(finger, dof=np.zeros(count, dtype=np.int64), rates=rates), rng


def within_reach(finger, curve, rng, *, touching):
    """Return the curve where it is clear of the open finger, or touches it."""
    if touching:
        curve = pushed_against(finger, curve, rng.uniform(0.0, 2.0 * np.pi), rng)
        # Some are apart by a part of the touch tolerance.
        nearby = curve.moved(rng.choice([0.0, 0.5e-9]) * finger.length * rng.normal(size=2))
        return nearby if gap_at(finger, nearby, np.zeros(1)) > 0.0 else curve
    while True:
        met = placed_vertices(finger, rng.uniform(0.0, 1.0, 1), int(rng.integers(len(finger.outlines))))
        put = curve.moved(met[int(rng.integers(len(met)))] + rng.normal(0.0, 0.005, 2))
        if gap_at(finger, put, np.zeros(1)) > 1e-5:
            return put


def judged(finger, curve):
    """Return how far the finger goes and whether it touches; fail where the oracle finds that wrong."""
    (stage,), answer = solve_planar(finger, curve)
    verdict = check_answer(finger, curve, (stage,))
    assert not verdict.failures, verdict.failures
    return stage.parameter, int(answer.contacts[0])


@pytest.mark.parametrize("touching", [False, True])
@pytest.mark.parametrize("kinds", [("box", "convex", "nonconvex", "blade"), ("disk", "capsule", "round_box")])
def test_it_does_not_matter_which_way_a_sheet_goes(kinds, touching):
    """Its end is met from the side or in the round, whether it is the first or the last point of the line."""
    stopped = 0
    for seed in range(60):
        finger, rng = moved_at_once(seed, kinds)
        length = rng.uniform(0.002, 0.03)
        line = turned(np.array([[0.0, 0.0], [length, 0.0]]), rng.uniform(0.0, 7.0))
        curve = within_reach(finger, PlanarCurve(lines=(line,), two_sided=True), rng, touching=touching)
        finger, curve = scaled(finger, curve, (1.0, 1e-4, 1e3)[seed % 3])
        back = replace(curve, lines=(curve.lines[0][::-1].copy(),))
        (one, touches), (other, touches_too) = judged(finger, curve), judged(finger, back)
        assert other == pytest.approx(one, abs=1e-8)
        assert touches == touches_too
        stopped += touches
    assert stopped > 15


@pytest.mark.parametrize("touching", [False, True])
@pytest.mark.parametrize("kind", ["star", "needle", "box"])
def test_a_flipped_loop_stops_on_either_side(kind, touching):
    stopped = 0
    for seed in range(30):
        finger, rng = moved_at_once(seed, ("box", "convex", "blade", "capsule", "round_box"))
        curve = within_reach(finger, CURVES[kind](0.02, rng), rng, touching=touching)
        finger, curve = scaled(finger, curve, (1.0, 1e-4, 1e3)[seed % 3])
        flipped = replace(curve, loops=tuple(loop[::-1].copy() for loop in curve.loops), two_sided=True)
        (one, touches), (other, touches_too) = judged(finger, curve), judged(finger, flipped)
        assert other == pytest.approx(one, abs=1e-8)
        assert touches == touches_too
        stopped += touches
    assert stopped > 8
