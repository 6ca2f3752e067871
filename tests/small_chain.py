"""Hands of one or more short chains along x, without or with capsules, for tests of single steps."""

import numpy as np

from clench.core.pose import Pose
from clench.models.hand.hand import Coupling, Finger, Hand, Joint, JointRole, Link
from clench.models.shapes import CollisionSource, Shape, ShapeKind

CLOSING, POSTURE = JointRole.CLOSING, JointRole.POSTURE
HALF = float(np.sqrt(0.5))
AXES = {CLOSING: np.array([0.0, -1.0, 0.0]), POSTURE: np.array([0.0, 0.0, 1.0])}
LENGTH = 0.04


def capsule(radius=0.006, length=LENGTH):
    return Shape(ShapeKind.CAPSULE, (radius, length / 2, 0.0), Pose([length / 2, 0, 0], wxyz=[HALF, 0, HALF, 0]))


def chain(roles, *, couplings=(), directions=None, lower=-0.5, upper=1.5, names=("index",), shape=None):
    """Return a hand whose fingers are equal chains; joints are j0, j1, … across all fingers.

    Closing joints turn x towards z, posture joints turn about z; every link is 40 mm long.
    """
    links = [Link("palm", -1, -1, np.eye(4), {})]
    joints, fingers = [], []
    for name in names:
        parent, own_links, own_joints = 0, [], []
        for i, role in enumerate(roles):
            direction = directions[i] if directions else 1
            number = len(joints)
            joints.append(Joint(f"j{number}", AXES[role], np.zeros(3), lower, upper, role=role, direction=direction))
            T = np.eye(4)
            T[0, 3] = LENGTH if i else 0.0
            carried = (shape or capsule(),)
            links.append(Link(f"l{number}", parent, number, T, {CollisionSource.ENGINE: carried}))
            parent = len(links) - 1
            own_links.append(parent)
            own_joints.append(number)
        fingers.append(Finger(name, tuple(own_links), tuple(own_joints), name == "thumb", parent))
    return Hand(
        name="chain",
        path=None,
        links=tuple(links),
        joints=tuple(joints),
        couplings=tuple(Coupling(a, b, ratio, 0.0, reason="test") for a, b, ratio in couplings),
        fingers=tuple(fingers),
        palm=0,
        fixed_links=(0,),
        allowed_pairs=(),
        palm_center=np.zeros(3),
        palm_normal=np.array([0.0, 0.0, 1.0]),
    )
