"""Candidates written by hand."""

import numpy as np

from clench.closing.candidates import FingerCandidate, LinkContact
from clench.closing.finger_plan import plan_finger
from clench.models.shapes import CollisionSource
from small_chain import CLOSING, chain

HAND = chain([CLOSING, CLOSING])
PLAN = plan_finger(HAND, HAND.fingers[0], np.zeros(2), 3, CollisionSource.ENGINE)


def touch(**changes):
    values = {
        "link": 1,
        "joint": 0,
        "body": 0,
        "graspable": True,
        "plane": 0,
        "offset": 0.0,
        "kind": 0,
        "position": np.zeros(3),
        "normal": np.array([0.0, 0.0, -1.0]),
        "gap": 0.0,
        "curve_angle": 0.0,
        "link_angle": 0.0,
    }
    return LinkContact(**{**values, **changes})


def candidate(travel=(0.3, 0.4), **changes):
    travel = np.array(travel)
    values = {
        "plan": PLAN,
        "posture": 0,
        "plane": None,
        "travel": travel,
        "q": PLAN.angles(HAND, travel),
        "touches": (touch(),),
        "overlap": None,
    }
    return FingerCandidate(**{**values, **changes})
