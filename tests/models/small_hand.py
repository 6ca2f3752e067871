"""A hand of one finger, written down by hand, for tests that need no model file."""

import numpy as np

from clench.models.hand.hand import Coupling, Finger, Hand, Joint, JointRole, Link


def small_hand():
    """Return a wrist, a palm and one finger: a yaw, a proximal joint and a distal one that follows it."""
    joints = (
        joint("wrist", -1.0, 1.0, JointRole.UPSTREAM),
        joint("index_yaw", -0.3, 0.3, JointRole.POSTURE),
        joint("index_proximal", 0.0, 1.5, JointRole.CLOSING),
        joint("index_distal", 0.0, 1.2, JointRole.CLOSING),
    )
    names = ("forearm", "palm", "index_base", "index_proximal", "index_distal")
    links = tuple(Link(name, i - 1, i - 1, np.eye(4), {}) for i, name in enumerate(names))
    return Hand(
        name="small",
        path=None,
        links=links,
        joints=joints,
        couplings=(Coupling(2, 3, 0.8, 0.0, reason="test"),),
        fingers=(Finger("index", (2, 3, 4), (1, 2, 3), False, 4),),
        palm=1,
        fixed_links=(1,),
        allowed_pairs=(),
        palm_center=np.zeros(3),
        palm_normal=np.array([0.0, 0.0, 1.0]),
    )


def joint(name, lower, upper, role):
    return Joint(name, np.array([0.0, 0.0, 1.0]), np.zeros(3), lower, upper, role=role)
