"""Pack a hand's kinematics and its links' meshes for the kernels; once per hand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from clench.core.pose import FloatArray
from clench.models.hand.hand import Hand

from .finger_plan import FingerPlan

if TYPE_CHECKING:
    from clench.kernels.geometry.link_frames import FrameArrays


def plan_frames(hand: Hand, plans: Sequence[FingerPlan]) -> FrameArrays:
    """Return the kinematics of a hand with the plans of its fingers, one finger posture each."""
    return hand_frames(hand)._replace(
        posture=np.array([plan.posture for plan in plans], dtype=np.float64),
        dof_leader=_whole([leader for plan in plans for leader in plan.leaders]),
        chain_joint=_whole([p.joint for plan in plans for p in plan.joints]),
        chain_turn=np.array([p.turn for plan in plans for p in plan.joints], dtype=np.float64),
    )


def placed_links(hand: Hand, q: FloatArray) -> FloatArray:
    """Return `T_palm_link` of every link at a posture [rad], as the kernels place them, shape (L, 3, 4)."""
    from clench.kernels.geometry.link_frames import place_links
    from clench.kernels.runtime.by_reference import kept

    poses = np.empty((len(hand.links), 3, 4))
    place_links(hand.kept(("kept frames",), lambda: kept(hand_frames(hand))), np.ascontiguousarray(q), poses)
    return poses


def hand_frames(hand: Hand) -> FrameArrays:
    """Return the kinematics of a hand without any finger posture; made once per hand."""
    return hand.kept(("frames",), lambda: _make_frames(hand))


def _make_frames(hand: Hand) -> FrameArrays:
    from clench.kernels.geometry.link_frames import FrameArrays

    joints, couplings = hand.joints, hand.couplings
    return FrameArrays(
        parent=_whole([link.parent for link in hand.links]),
        joint=_whole([link.joint for link in hand.links]),
        T_parent_link=np.array([link.T_parent_link[:3] for link in hand.links], dtype=np.float64),
        axis=np.array([j.axis for j in joints], dtype=np.float64).reshape(-1, 3),
        anchor=np.array([j.anchor for j in joints], dtype=np.float64).reshape(-1, 3),
        reference=np.array([j.reference for j in joints], dtype=np.float64),
        palm=_whole([hand.palm]),
        direction=np.array([j.direction for j in joints], dtype=np.float64),
        lower=np.array([j.lower for j in joints], dtype=np.float64),
        upper=np.array([j.upper for j in joints], dtype=np.float64),
        leader=_whole([c.leader for c in couplings]),
        follower=_whole([c.follower for c in couplings]),
        ratio=np.array([c.ratio for c in couplings], dtype=np.float64),
        offset=np.array([c.offset for c in couplings], dtype=np.float64),
        posture=np.empty((0, len(joints))),
        dof_leader=_whole([]),
        chain_joint=_whole([]),
        chain_turn=np.empty(0),
        breakaway=_whole([c.breakaway for c in couplings]),
    )


def _whole(numbers: Sequence[int]) -> np.ndarray:
    return np.array(numbers, dtype=np.int64)
