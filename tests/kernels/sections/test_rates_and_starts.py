"""Where a joint touches does not depend on how fast it turns, nor on when it sets out."""

import numpy as np
import pytest

from clench.kernels.closing.layout import CONTACT_NX, CONTACT_X
from oracle.adapter import pack_finger, solve_planar
from oracle.cases import random_curve, random_finger
from oracle.planar import gap_at
from oracle.scene import PlanarCurve


def thrown(seed):
    """Return a finger of one joint, and a curve that it is clear of."""
    rng = np.random.default_rng([9, seed])
    finger = random_finger(rng, joints=1)
    while True:
        thing = PlanarCurve(disks=np.array([[0.0, 0.0, 0.01]])) if seed % 3 == 0 else random_curve(rng)
        curve = thing.moved(finger.pivots[0] + rng.uniform(-1.0, 1.0, 2) * finger.length)
        if gap_at(finger, curve, np.zeros(1)) > 1e-5:
            return finger, curve


@pytest.mark.parametrize("together", [False, True])
@pytest.mark.parametrize(("rate", "start"), [(0.37, 0.0), (2.5, 0.0), (1.0, 0.4), (0.5, 0.2)])
def test_a_joint_touches_at_the_same_angle(rate, start, together):
    """`start`: how far its degree of freedom travels before it moves, as followers with an offset do."""
    touched = 0
    for seed in range(60):
        finger, curve = thrown(seed)
        plain = pack_finger(finger)
        chain = plain.chain
        longer = chain._replace(
            rate=rate * chain.rate,
            start=np.full(1, start),
            stop=chain.stop / rate + start,
            dof_length=chain.dof_length / rate + start,
        )
        expected = solve_planar(finger, curve)[1]
        found = solve_planar(finger, curve, plain._replace(chain=longer), together=together)[1]
        np.testing.assert_allclose(found.turn, expected.turn, atol=1e-9)
        np.testing.assert_allclose(found.travel, np.abs(expected.turn) / rate + start, atol=1e-8)
        assert found.contacts == expected.contacts
        one, other = found.point[0, :, CONTACT_X : CONTACT_NX + 2], expected.point[0, :, CONTACT_X : CONTACT_NX + 2]
        np.testing.assert_allclose(one, other, atol=1e-6)
        touched += int(found.contacts[0])
    assert touched > 15
