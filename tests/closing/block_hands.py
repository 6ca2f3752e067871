"""Hands made of blocks, whose distances can be worked out by hand."""

import numpy as np

from clench.core.pose import Pose
from clench.models.hand.hand import Finger, Hand, Joint, JointRole, Link
from clench.models.shapes import CollisionSource, Shape, ShapeKind


def block_hand(palm=None, finger=None):
    """Return a palm with its top at z = 0, looking up, and one finger standing 40 mm up at x = 50 mm.

    The finger's joint is at (50, 0, 0) mm about y; at angle 0 it stands, a positive angle turns it towards +x.
    """
    palm = palm or Shape(ShapeKind.BOX, (0.05, 0.03, 0.01), Pose([0.0, 0.0, -0.01]))
    finger = finger or Shape(ShapeKind.BOX, (0.005, 0.01, 0.02), Pose([0.0, 0.0, 0.02]))
    mount = np.eye(4)
    mount[0, 3] = 0.05
    joint = Joint("bend", np.array([0.0, 1.0, 0.0]), np.zeros(3), -1.5, 1.5, role=JointRole.CLOSING, direction=-1)
    return Hand(
        name="block",
        path=None,
        links=(
            Link("palm", -1, -1, np.eye(4), {CollisionSource.ENGINE: (palm,)}),
            Link("ghost", 0, -1, np.eye(4), {}),
            Link("finger", 0, 0, mount, {CollisionSource.ENGINE: (finger,)}),
        ),
        joints=(joint,),
        couplings=(),
        fingers=(Finger("finger", (2,), (0,), False, 2),),
        palm=0,
        fixed_links=(0, 1),
        allowed_pairs=(),
        palm_center=np.zeros(3),
        palm_normal=np.array([0.0, 0.0, 1.0]),
    )
