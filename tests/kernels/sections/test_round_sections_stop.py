"""Fingers that close on round sections: a circle as a disk and as an ellipse, an ellipse and its polygon."""

from dataclasses import replace

import numpy as np
import pytest

from clench.kernels.closing.layout import CONTACT_GAP, CONTACT_KIND, CONTACT_NX, CONTACT_X, KIND_SIDE
from oracle.adapter import pack_curve, pack_finger, solve_planar
from oracle.cases import random_finger
from oracle.planar import gap_at
from oracle.scene import PlanarCurve


def as_ellipses(curve, rows):
    """Pack a curve without its disks and with ellipses: rows (x, z, u_x, u_z, a, b, low, high)."""
    packed = pack_curve(curve)
    count = len(rows)
    ellipses = np.zeros((1, count, 8))
    ellipses[0] = rows
    packed.counts[0, 1:] = 0, count
    return packed._replace(ellipses=ellipses, ellipse_sources=np.full((1, count), -1, dtype=np.int64))


def thrown(seed, radius):
    """Return a finger and a place for a round thing within its reach, clear of it."""
    rng = np.random.default_rng(seed)
    finger = random_finger(rng)
    while True:
        at = finger.pivots[0] + rng.uniform(-1.0, 1.0, 2) * finger.length
        if gap_at(finger, PlanarCurve(disks=np.array([[*at, radius]])), np.zeros(finger.dofs)) > 1e-4:
            return finger, at, rng


def inwards(hand):
    """Return a hand whose outlines' sides look inwards, and stop on both faces."""
    outlines = hand.outlines
    turned = np.ascontiguousarray(-outlines.side[:, [0, 1, 2, 4, 3]])
    return hand._replace(outlines=outlines._replace(side=turned, both=np.ones_like(outlines.both)))


@pytest.mark.parametrize("together", [False, True])
def test_a_circle_is_an_ellipse_with_equal_axes(together):
    kinds = []
    for seed in range(40):
        radius = 0.02 if seed % 2 else 0.004
        finger, at, rng = thrown(seed, radius)
        curve = PlanarCurve(disks=np.array([[*at, radius]]))
        turn = rng.uniform(0.0, 7.0)
        row = [*at, np.cos(turn), np.sin(turn), radius, radius, -radius, radius]
        hand = inwards(pack_finger(finger)) if seed % 3 == 0 else None
        disk = solve_planar(finger, curve, together=together)[1]
        ellipse = solve_planar(finger, curve, hand, as_ellipses(PlanarCurve(), [row]), together=together)[1]
        np.testing.assert_allclose(ellipse.turn, disk.turn, atol=1e-6)
        assert ellipse.contacts == disk.contacts
        count = disk.contacts[0]
        one, other = disk.point[0, :count], ellipse.point[0, :count]
        np.testing.assert_allclose(one[:, CONTACT_X : CONTACT_NX + 2], other[:, CONTACT_X : CONTACT_NX + 2], atol=1e-5)
        np.testing.assert_allclose(one[:, CONTACT_GAP], other[:, CONTACT_GAP], atol=1e-7)
        # The contact lies on the circle, and its normal is along the radius.
        from_middle = one[:, CONTACT_X : CONTACT_X + 2] - at
        kinds += disk.contact[0, :count, CONTACT_KIND].tolist()
        touching = np.abs(one[:, CONTACT_GAP]) < finger.tolerance
        np.testing.assert_allclose(
            from_middle[touching], radius * one[touching, CONTACT_NX : CONTACT_NX + 2], atol=1e-8
        )
    assert kinds.count(KIND_SIDE) > 2
    assert len(kinds) - kinds.count(KIND_SIDE) > 2


def test_an_ellipse_stops_as_its_polygon_does():
    """A cut one, too: the polygon goes from one cap to the other; it lies within the ellipse by 1e-4 of its size."""
    stopped = 0
    angle = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    for seed in range(40):
        a, b = 0.02, (0.015, 0.004)[seed % 2]
        finger, at, rng = thrown(seed, a)
        turn, low, high = rng.uniform(0.0, 7.0), -a, a
        if seed % 3 == 0:
            low, high = np.sort(rng.uniform(-a, a, 2))
        local = np.column_stack([a * np.cos(angle), b * np.sin(angle)])
        clipped = np.column_stack([np.clip(local[:, 0], low, high), local[:, 1]])
        shrink = b * np.sqrt(np.maximum(1.0 - (clipped[:, 0] / a) ** 2, 0.0))
        clipped[:, 1] = np.clip(clipped[:, 1], -shrink, shrink)
        keep = np.abs(np.diff(clipped, axis=0, append=clipped[:1])).max(axis=1) > 0.0
        c, s = np.cos(turn), np.sin(turn)
        loop = at + clipped[keep] @ np.array([[c, s], [-s, c]])
        polygon = solve_planar(finger, PlanarCurve((loop,)))[1]
        row = [*at, c, s, a, b, low, high]
        caps = PlanarCurve((loop,)) if (low, high) != (-a, a) else PlanarCurve()
        if len(caps.loops):
            # The straight caps are segments of their own, as sections have them.
            ends = [(low, -1.0), (low, 1.0), (high, -1.0), (high, 1.0)]
            corners = [[t, sign * b * np.sqrt(max(1.0 - (t / a) ** 2, 0.0))] for t, sign in ends]
            left, right = (at + np.array(p) @ np.array([[c, s], [-s, c]]) for p in (corners[1::-1], corners[2:]))
            caps = PlanarCurve(lines=(left, right))
        found = solve_planar(replace(finger), PlanarCurve(), None, as_ellipses(caps, [row]))[1]
        first = np.flatnonzero(polygon.turn[0] != 0.0)[:1]
        np.testing.assert_allclose(found.turn[0, first], polygon.turn[0, first], atol=2e-3)
        stopped += bool(found.contacts[0])
    assert stopped > 8
