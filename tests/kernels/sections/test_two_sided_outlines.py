"""Outlines whose sides stop on both faces, like sections of open meshes: it does not matter which way they look."""

import numpy as np
import pytest

from clench.kernels.closing.layout import CONTACT_NX
from oracle.adapter import pack_finger, solve_planar
from oracle.cases import cases
from oracle.planar import overlaps_at_start


def looking_inwards(hand, both):
    """Return a hand whose outlines' sides look the other way."""
    outlines = hand.outlines
    turned = np.ascontiguousarray(-outlines.side[:, [0, 1, 2, 4, 3]])
    return hand._replace(outlines=outlines._replace(side=turned, both=np.full_like(outlines.both, both)))


@pytest.mark.parametrize("together", [False, True])
def test_sides_that_look_inwards_stop_as_well_when_both_faces_count(together):
    missed = 0
    for case in cases(3, 300):
        if case.name not in ("anywhere", "touching", "vertex_on_vertex") or overlaps_at_start(case.finger, case.curve):
            continue
        plain = pack_finger(case.finger)
        expected, found, through = (
            solve_planar(case.finger, case.curve, hand, together=together)[1]
            for hand in (plain, looking_inwards(plain, both=1), looking_inwards(plain, both=0))
        )
        np.testing.assert_allclose(found.turn, expected.turn, atol=1e-9)
        assert found.contacts == expected.contacts
        count = found.contacts[0]
        # Normals look out of the object whichever way the side looks.
        one, other = (a.point[0, :count, CONTACT_NX : CONTACT_NX + 2] for a in (expected, found))
        np.testing.assert_allclose(one, other, atol=1e-6)
        missed += not np.allclose(through.turn, expected.turn, atol=1e-9)
    assert missed > 10
