"""Which outlines overlap a section before anything moves, against the oracle's gaps."""

import numpy as np
import pytest

from clench.kernels.closing.layout import RoundArrays, no_rounds
from kernels.plain_closing import find_overlaps
from oracle.adapter import EMPTY_TREE, pack_curve, pack_finger
from oracle.cases import make_case
from oracle.distances import inside_curve, place, signed_gap
from oracle.scene import PlanarCurve, PlanarFinger, PlanarOutline

STILL = np.eye(4)[:3].copy()


def found_overlap(finger, curve, rounds=None):
    overlaps = np.full(1, -9, dtype=np.int64)
    hand, sections = pack_finger(finger), pack_curve(curve)
    find_overlaps(hand, EMPTY_TREE, rounds or no_rounds(), not curve.two_sided, STILL, sections, overlaps)
    return int(overlaps[0])


def thrown(index):
    """Return a finger and a curve that is put on one of its outlines, nearly at random."""
    case = make_case(23, index)
    rng = np.random.default_rng(index)
    body = case.finger.packed
    o = int(rng.integers(len(case.finger.outlines)))
    target = place(body, o, np.zeros(len(case.finger.rates)))[1]
    middle = rng.dirichlet(np.ones(len(target))) @ target
    points = np.concatenate([case.curve.segments.reshape(-1, 2), case.curve.disks[:, :2]])
    away = rng.normal(scale=0.2 * rng.choice([0.01, 0.1, 1.0]) * case.finger.length, size=2)
    return case.finger, case.curve.moved(middle - points[int(rng.integers(len(points)))] + away)


@pytest.mark.parametrize("first", range(0, 600, 100))
def test_overlaps_are_those_of_the_oracle(first):
    """What lies inside a loop altogether is told by the object's mesh, which is not there."""
    overlapping = free = 0
    for index in range(first, first + 100):
        finger, curve = thrown(index)
        body, angles = finger.packed, np.zeros(len(finger.rates))
        placed = [place(body, o, angles)[1] for o in range(len(finger.outlines))]
        gaps = np.array([signed_gap(body, o, placed[o], curve.packed) for o in range(len(placed))])
        if np.abs(gaps).min() < 1e-6 * finger.length:
            continue
        found = found_overlap(finger, curve)
        if gaps.min() > 0.0:
            assert found == -1, index
            free += 1
            continue
        inside = [all(inside_curve(x, z, curve.packed) for x, z in vertices) for vertices in placed]
        sure = [o for o in range(len(placed)) if gaps[o] < 0.0 and not inside[o]]
        if sure:
            assert 0 <= found <= sure[0], index
            assert gaps[found] < 0.0, index
            overlapping += 1
    assert overlapping > 20
    assert free > 10


@pytest.mark.parametrize("turned_round", [False, True])
def test_the_loose_end_of_a_sheet_in_the_round_side_of_a_link(turned_round):
    line = np.array([[0.025, 0.02], [0.025, 0.004]])
    link = PlanarOutline(0, np.array([[0.0, 0.0], [0.05, 0.0]]), np.array([[0, 1], [1, 0]]), 0.008)
    one = np.ones(1)
    finger = PlanarFinger(np.zeros((1, 2)), one, np.zeros(1, dtype=np.int64), one, (link,))
    for up, expected in ((0.0, 0), (0.01, -1)):
        sheet = line + np.array([0.0, up])
        curve = PlanarCurve(lines=(sheet[::-1].copy() if turned_round else sheet,), two_sided=True)
        assert found_overlap(finger, curve) == expected


@pytest.mark.parametrize("slant", [0.0, 0.4, 0.8, 2.0])
@pytest.mark.parametrize("below", [False, True])
def test_the_round_side_of_a_link_and_a_slanting_ellipse(slant, below):
    """They overlap where the side is nearer to the middle than the ellipse's height there and the radius."""
    radius, a, b = 0.008, 0.02, 0.006
    height = np.hypot(a * np.sin(slant), b * np.cos(slant)) + radius
    link = PlanarOutline(0, np.array([[-0.05, 0.0], [0.05, 0.0]]), np.array([[0, 1], [1, 0]]), radius)
    one = np.ones(1)
    finger = PlanarFinger(np.zeros((1, 2)), one, np.zeros(1, dtype=np.int64), one, (link,))
    for gap, expected in ((1e-5, -1), (-1e-5, 0), (-2e-3, 0)):
        at = (height + gap) * (-1.0 if below else 1.0)
        section = pack_curve(PlanarCurve(disks=np.zeros((1, 3))))
        section.counts[0] = 0, 0, 1
        section.ellipses[0, 0] = 0.0, at, np.cos(slant), np.sin(slant), a, b, -a, a
        overlaps = np.full(1, -9, dtype=np.int64)
        find_overlaps(pack_finger(finger), EMPTY_TREE, no_rounds(), True, STILL, section, overlaps)
        assert overlaps[0] == expected


def turned(angle):
    """Turn from x towards z about the y axis."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])


@pytest.mark.parametrize("kind", ["sphere", "capsule", "cylinder", "ellipsoid"])
def test_a_link_inside_a_round_primitive(kind):
    """No section is near: only the primitive itself tells. Its axis is z, tilted by 0.3 rad."""
    finger, curve = make_case(23, 3).finger, make_case(23, 3).curve.moved(np.array([9.0, 9.0]))
    x, z = place(finger.packed, 0, np.zeros(len(finger.rates)))[1][0]
    size = {"sphere": (0.02, 0, 0), "capsule": (0.02, 0.03, 0), "cylinder": (0.02, 0.03, 0)}.get(
        kind, (0.02, 0.03, 0.05)
    )
    number = ["sphere", "capsule", "cylinder", "ellipsoid"].index(kind)
    tilt = turned(0.3)
    for local in np.random.default_rng(1).uniform(-0.055, 0.055, (200, 3)):
        px, py, pz = local
        inside = {
            "sphere": px**2 + py**2 + pz**2 < 0.02**2,
            "capsule": px**2 + py**2 + max(abs(pz) - 0.03, 0.0) ** 2 < 0.02**2,
            "cylinder": px**2 + py**2 < 0.02**2 and abs(pz) < 0.03,
            "ellipsoid": (px / 0.02) ** 2 + (py / 0.03) ** 2 + (pz / 0.05) ** 2 < 1.0,
        }[kind]
        at = np.array([x, 0.0, z]) - tilt @ local
        pose = np.column_stack([tilt, at])[None]
        rounds = RoundArrays(np.array([number]), np.array([size], dtype=float), np.ascontiguousarray(pose))
        assert (found_overlap(finger, curve, rounds) == 0) == inside
