"""Name the reasons that reject a proposal, and the remedies."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from enum import StrEnum
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from .proposals import Proposals


class Rejection(StrEnum):
    """Say why a proposal came to nothing; every proposal falls for one reason."""

    STOPPED = "stopped before its place"
    """the object stops the palm or a finger of the open hand more than 20 mm before its place"""
    OBSTACLE = "obstacle"
    """the open hand meets an obstacle first"""
    DIRECTION = "other direction"
    """the hand does not come along the direction of approach that is asked for"""
    UNREACHABLE = "unreachable"
    """the caller's function says that the pose cannot be reached"""
    OVERLAPS = "overlaps at the start"
    """a link overlaps the object, an obstacle or another link before anything moves"""
    THUMB_LIMIT = "thumb at its limit"
    """the thumb closes to its limit without touching"""
    NO_GRASP = "too few fingers touch"
    """no two opposing fingers touch, or fewer fingers than `min_fingers`"""
    NOT_CERTIFIED = "not certified"
    """the certificate of the closing does not hold"""
    OTHER_KIND = "other kind"
    """the grasp is of a kind that is not asked for"""
    REGION = "region"
    """a contact lies outside of the region to touch, or inside of the one to avoid"""
    NO_CLOSURE = "no opposition"
    """the contacts do not resist every wrench at the friction that is planned for"""
    NOT_ROBUST = "lost when displaced"
    """displacements of the object leave less than a fifth of the score"""
    ALIKE = "too similar"
    """a better grasp is nearer than the distance asked for"""
    NO_SQUEEZE = "no squeeze within limits"
    """no torques within the limits hold the object, with the reserve"""
    NO_WAY = "no free path"
    """no path from the open hand to the touch was proven free"""


#: Remedies, by the reason that rejected most proposals.
HELP: Final = {
    Rejection.STOPPED: "The object may be too large for the hand, or may be reached from few sides only.",
    Rejection.OBSTACLE: "Obstacles leave few ways in; give an approach direction, or move the object.",
    Rejection.DIRECTION: "Give a larger approach_angle, or another direction.",
    Rejection.UNREACHABLE: "Move the object or the arm's base, or let the function allow more poses.",
    Rejection.OVERLAPS: "The object leaves little room between the fingers; a smaller hand or another object helps.",
    Rejection.THUMB_LIMIT: "The object is too small for the thumb to reach; other fingers may do: fingers=[...].",
    Rejection.NO_GRASP: "The object may be too small for the hand; allow fewer fingers with min_fingers.",
    Rejection.NOT_CERTIFIED: "Links interlock; 'clench hand' says which.",
    Rejection.OTHER_KIND: "Allow more kinds, or propose more with most=...",
    Rejection.REGION: "Allow a larger region, or propose more with most=...",
    Rejection.NO_CLOSURE: "More friction would help, or more proposals with most=...",
    Rejection.NOT_ROBUST: "A smaller pose_sigma would help.",
    Rejection.ALIKE: "Ask for fewer grasps, or for a smaller distance with apart=...",
    Rejection.NO_SQUEEZE: "A lighter object, more friction or stronger joints would help.",
    Rejection.NO_WAY: "Links meet on the way; the grasps may be used without a path: path=False.",
}


class Fallen(Counter[Rejection]):
    """Count the proposals that came to nothing, and tell a listener which they are."""

    #: Is called with the reason and the proposals that fell for it.
    tell: Callable[[Rejection, Proposals], None] | None = None

    def fall(self, reason: Rejection, proposals: Proposals) -> None:
        """Count proposals for a reason."""
        self[reason] += len(proposals)
        if self.tell is not None and len(proposals):
            self.tell(reason, proposals)
