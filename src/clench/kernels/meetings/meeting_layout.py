"""Layout of the arrays of simultaneously closing fingers: data of their links, and the search's scratch space."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clench.kernels.closing.layout import Floats, Ints
from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.full_width import FullWidthArrays
from clench.kernels.toi.toi_work import SweepWork


class FingerLinks(NamedTuple):
    """A plan's data of the links of its fingers; E finger postures, K links of them that can touch, J joints.

    Args:
        first: first link of each finger posture, (E + 1,). link: index in the hand, (K,).
        joint: last closing joint that moves it, -1 for a resting link, (K,).
        arm: no point of the link gets farther from a joint's pivot [m], (K, J).
        tilt: largest sine of the angle between two axes of a finger posture's joints [-], (E,).
        apart: whether links of different fingers may not overlap each other, (L, L).
    """

    first: Ints
    link: Ints
    joint: Ints
    arm: Floats
    tilt: Floats
    apart: Ints


class Meetings(NamedTuple):
    """The places where fingers met, in order; M meetings at most.

    Args:
        size: how many there are, (1,).
        number: candidate, link and held joint (of `ChainArrays`; -1: none is held) of either finger, (M, 6).
        value: position [m], normal from the second link to the first, both in the palm frame, gap [m], and the motion
            so far, (M, 8).
    """

    size: Ints
    number: Ints
    value: Floats


class MeetingWork(NamedTuple):
    """The scratch space of the search; K links, P pairs of them, I candidates, J joints, L links of the hand.

    Args:
        until: see `CandidateArrays`, (I, J).
        rate: how fast each joint turns in its part of the motion [rad], begin, end: that part, (J,).
        final, turns: of each joint at the end and at a place of the motion [rad], (J,).
        axis: of each joint at a place of the motion, in the palm frame, (J, 3).
        lane: extent of each link along a direction [m], (K, 2).
        pair: the two candidates among those chosen, their links, whether the pair counts, how often it was looked at,
            and its elements that were nearest, (P, 8). at: up to where it is free, infinite if to the end, (P,).
        plane: normal of a plane that separated it, and the last gap of links that touch from the start and part,
            else 0 [m], (P, 4). reach: up to which gap it is measured [m], (P,).
        ahead: poses of two links further on, (2, 3, 4).
        touch: how the pair that was looked at last touches, as `Meetings.value`, (8,).
    """

    until: Floats
    rate: Floats
    begin: Floats
    end: Floats
    final: Floats
    turns: Floats
    axis: Floats
    lane: Floats
    pair: Ints
    at: Floats
    plane: Floats
    reach: Floats
    ahead: Floats
    touch: Floats


class LinkPair(NamedTuple):
    """Two links of simultaneously closing fingers; kernels hold what is large by pointers.

    Args:
        full_width, fingers: of the hand. finger_postures: of the two fingers. rows: the links, of `fingers`.
        workspace, sweep: scratch space; `sweep` has the poses of the links.
    """

    full_width: FullWidthArrays
    fingers: FingerLinks
    finger_postures: tuple[int, int]
    rows: tuple[int, int]
    workspace: MeetingWork
    sweep: SweepWork


@kernel(allocates=True)
def make_meeting_work(fingers: FingerLinks, candidates: int, joints: int) -> MeetingWork:
    """Allocate the scratch space for a hand."""
    rows = fingers.link.shape[0]
    pairs = rows * rows // 2
    return MeetingWork(
        np.empty((candidates, joints)),
        np.empty(joints),
        np.empty(joints),
        np.empty(joints),
        np.empty(joints),
        np.empty(joints),
        np.empty((joints, 3)),
        np.empty((rows, 2)),
        np.empty((pairs, 8), dtype=np.int64),
        np.empty(pairs),
        np.empty((pairs, 4)),
        np.empty(pairs),
        np.empty((2, 3, 4)),
        np.empty(8),
    )
