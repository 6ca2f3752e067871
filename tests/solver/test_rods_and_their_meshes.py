"""Rods that lean out of the curl planes by anything: their exact sections stop a finger where those of a mesh do."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import clench
from clench.core.pose import Pose
from clench.models.shapes import Shape, ShapeKind
from oracle.width import make_case

#: Of a mesh that is off by 2e-6 m, a joint may stop elsewhere by this; more where it just slides off [rad].
CLOSE = 3e-3


def rod(rng, length):
    """Return a rod, its pose in the palm, shape (4, 4), and how far its axis leans out of the planes [rad]."""
    kind = ShapeKind.CAPSULE if rng.random() < 0.5 else ShapeKind.CYLINDER
    tilt, spin = 10.0 ** rng.uniform(-9.0, 0.2), rng.uniform(0.0, 2.0 * np.pi)
    axis = np.array([np.cos(spin) * np.cos(tilt), np.sin(tilt), np.sin(spin) * np.cos(tilt)])
    T = np.eye(4)
    T[:3, :3] = Rotation.align_vectors([axis], [[0, 0, 1]])[0].as_matrix()
    T[:3, 3] = [rng.uniform(-0.02, 0.6 * length + 0.02), rng.uniform(-0.004, 0.004), rng.uniform(0.02, 0.07)]
    return Shape(kind, (float(rng.uniform(0.003, 0.012)), float(rng.uniform(0.005, 0.04)), 0.0)), T


@pytest.mark.parametrize("order", ["proximal-first", "together"])
def test_on_one_plane(order):
    met = 0
    for seed in range(40):
        rng = np.random.default_rng([81, seed])
        hand = make_case(seed).hand
        length = sum(float(link.T_parent_link[0, 3]) for link in hand.links[2:]) + 0.035
        shape, T = rod(rng, length)
        mesh = Shape(ShapeKind.MESH, (0.0, 0.0, 0.0), Pose.identity(), shape.to_mesh(2e-6))
        command = clench.GraspCommand(
            hand_pose=Pose.identity(),
            object_pose=Pose.from_matrix(T),
            planes=1,
            full_width=False,
            order=clench.ClosingOrder(order),
            measure=False,
            preshape="open",
        )
        one, other = (clench.solve(hand, clench.GraspObject.from_shape(s, name="rod"), command) for s in (shape, mesh))
        assert list(one.joint_angles.values()) == pytest.approx(list(other.joint_angles.values()), abs=CLOSE), seed
        met += bool(one.contacts)
    assert met > 20
