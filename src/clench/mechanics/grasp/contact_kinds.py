"""Classify grasps by their contacts: fingers with their last links only, or with more links."""

from __future__ import annotations

from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from clench.models.hand.hand import Hand


class GraspKind(StrEnum):
    """Name the kinds of grasps by the links that touch the object.

    | fingers that touch | with their last links only | with another link, or the palm touches too |
    |---|---|---|
    | none | no kind | no kind |
    | one | no kind | `power` with the palm, else no kind |
    | two | `pinch` | `power` |
    | three | `tripod` | `power` |
    | four or more | `precision` | `power` |
    """

    PINCH = "pinch"
    """exactly two fingers touch, each with its last link only"""
    TRIPOD = "tripod"
    """exactly three fingers touch, each with its last link only"""
    PRECISION = "precision"
    """four or more fingers touch, each with its last link only"""
    POWER = "power"
    """the palm or another link of a finger touches as well"""


#: Meanings of the codes of `contact_kinds`, in order; -1 is no kind: fewer than two of the fingers and the palm touch.
KINDS: Final = tuple(GraspKind)


def contact_kinds(
    hand: Hand, first: NDArray[np.int64], link: NDArray[np.int64], counted: NDArray[np.bool_] | None = None
) -> NDArray[np.int8]:
    """Return the kinds of N grasps as indices into `KINDS`, -1 for no kind, shape (N,).

    The last link of a finger is its tip, together with the links that are fixed to the tip. The palm stands for all
    links that no finger moves.

    Args:
        hand: the hand.
        first: the contacts of grasp i are the rows from `first[i]` up to `first[i + 1]`, shape (N + 1,).
        link: index of the touching link in the hand, shape (C,).
        counted: which contacts count, shape (C,); None: all.
    """
    finger_of, is_last = _link_table(hand)
    grasp = np.repeat(np.arange(len(first) - 1), np.diff(first))
    if counted is not None:
        grasp, link = grasp[counted], link[counted]
    finger = finger_of[link]
    touches = np.zeros((len(first) - 1, len(hand.fingers) + 1), dtype=bool)
    touches[grasp, finger] = True  # the palm is in the last column
    wide = np.zeros(len(first) - 1, dtype=bool)
    wide[grasp[~is_last[link]]] = True
    fingers = touches[:, :-1].sum(axis=1)
    conditions = [touches.sum(axis=1) < 2, wide, fingers == 2, fingers == 3]
    codes = [-1, *(KINDS.index(kind) for kind in (GraspKind.POWER, GraspKind.PINCH, GraspKind.TRIPOD))]
    return np.select(conditions, codes, KINDS.index(GraspKind.PRECISION)).astype(np.int8)


def _link_table(hand: Hand) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the finger of every link, -1 for the palm, and whether the link is its finger's last, shape (L,)."""
    finger_of = np.full(len(hand.links), -1, dtype=np.int64)
    is_last = np.zeros(len(hand.links), dtype=bool)
    for number, finger in enumerate(hand.fingers):
        last = _moving_joint(hand, finger.tip_link)
        for link in finger.links:
            finger_of[link] = number
            is_last[link] = _moving_joint(hand, link) == last
    return finger_of, is_last


def _moving_joint(hand: Hand, link: int) -> int:
    """Return the joint that moves a link, or the link that it is fixed to; -1 without a joint."""
    while link >= 0 and hand.links[link].joint < 0:
        link = hand.links[link].parent
    return hand.links[link].joint if link >= 0 else -1
