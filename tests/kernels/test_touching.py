"""Where and how a finger touches on a plane, judged by distances alone: the oracle's, which know no closed form."""

import numpy as np
import pytest

from clench.kernels.layout import HIT_CURVE_X, HIT_GAP, HIT_GROUP, HIT_NX, HIT_OUTLINE, HIT_SOURCE, HIT_X
from oracle.adapter import pack_curve, solve_planar
from oracle.cases import cases
from oracle.distances import place, signed_gap
from oracle.planar import overlaps_at_start
from oracle.scene import PlanarCurve

CASES = 400


def contacts():
    """Yield the contacts of random cases that are not degenerate on purpose: case, answer, integers and numbers."""
    for case in cases(11, CASES):
        if case.name == "anywhere" and not overlaps_at_start(case.finger, case.curve):
            _, answer = solve_planar(case.finger, case.curve)
            np.testing.assert_allclose(answer.turn[0], case.finger.angles(answer.travel[0]), atol=1e-14)
            for k in range(answer.contacts[0]):
                yield case, answer, answer.hit[0, k], answer.point[0, k]


def gap(case, curve, outline, angles):
    body = case.finger.packed
    return signed_gap(body, outline, place(body, outline, angles)[1], curve.packed)


def test_a_contact_lies_on_both_and_looks_out_of_the_object():
    """The normal is the direction in which the gap grows as fast as the object is moved away.

    What is told as touching holds the joints that it stopped. A link that has left what stopped them may touch
    elsewhere since, where going on would lead away: that is no contact of theirs.
    """
    seen, corners, opened, elsewhere = 0, 0, 0, 0
    for case, answer, hit, point in contacts():
        size, o, angles = case.finger.length, hit[HIT_OUTLINE], answer.turn[0]
        left = gap(case, case.curve, o, angles)
        on = answer.travel[0].copy()
        on[hit[HIT_GROUP]] += 1e-5
        beyond = gap(case, case.curve, o, case.finger.angles(on))
        if abs(left) <= case.finger.tolerance < point[HIT_GAP]:
            elsewhere += 1
            assert beyond >= left - 1e-9 * size
            assert hit[HIT_GROUP] < case.finger.groups - 1
            continue
        assert point[HIT_GAP] == pytest.approx(left, abs=2e-8 * size)
        assert beyond <= left + 1e-9 * size or left > case.finger.tolerance
        n, curve_normal = point[HIT_NX : HIT_NX + 2], point[HIT_CURVE_X : HIT_CURVE_X + 2]
        assert np.hypot(*n) == pytest.approx(1.0)
        assert case.finger.outlines[o].joint >= case.finger.leader(hit[HIT_GROUP])
        if abs(left) > case.finger.tolerance:
            # A later stage took the link away; in the last one it stays.
            opened += 1
            assert hit[HIT_GROUP] < case.finger.groups - 1
            continue
        at = PlanarCurve(disks=np.array([[*point[HIT_X : HIT_X + 2], 0.0]]))
        assert gap(case, at, o, angles) == pytest.approx(0.0, abs=2e-8 * size)
        if hit[HIT_SOURCE] >= 0:
            row = pack_curve(case.curve).segments[0, hit[HIT_SOURCE]]
            a, b = row[:4].reshape(2, 2)
            t = np.clip((point[:2] - a) @ (b - a) / max((b - a) @ (b - a), 1e-300), 0.0, 1.0)
            assert np.hypot(*(a + t * (b - a) - point[:2])) <= 1e-12 * size
            assert abs(row[4:] @ curve_normal) == pytest.approx(1.0)
        assert n @ curve_normal >= 0.0
        away = 1e-5 * size
        grown = gap(case, case.curve.moved(-away * n), o, angles) - left
        # Where a corner is in a dent of the other body, it touches at two places at once: the gap grows along neither.
        corners += abs(grown - away) > 1e-2 * away
        seen += 1
    assert seen > 200
    assert opened > 10
    assert elsewhere > 0
    assert corners < 0.01 * seen
