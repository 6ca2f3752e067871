"""Read the candidates of a finger from the kernels' results (docs/method.md section 5)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from clench.closing.collision.depths import LinkDepth
from clench.closing.collision.object_surface import object_surface
from clench.closing.collision.packed_object import PackedObject
from clench.core.pose import FloatArray
from clench.core.tolerances import PASSED_GAP
from clench.mechanics.grasp.contacts import without_repeats
from clench.models.hand.hand import Hand

from .finger_plan import FingerPlan
from .hand_plan import HandPlan

if TYPE_CHECKING:
    from clench.kernels.closing.layout import ClosingArrays
    from clench.kernels.meetings.meeting_layout import Meetings

#: The kind of a touch of two links' surfaces that lie on no plane.
_FACE: Final = 5


class LinkContact(NamedTuple):
    """Describe one contact, in the palm frame.

    Args:
        link, joint: indices in the hand of the touching link, and of the leader of the degree of freedom that it
            stopped. If joints break away, the leader is the last joint that the link stopped.
        body: index of the touched body, or -1 - index of a touched link of the hand itself. graspable: whether that
            body is to be grasped.
        plane: of the axis group, None where the touch lies on none. offset: its place along y [m].
        kind: 0 side, 1 tip, 2 edge on a plane or of a round link; 3 corner, 4 edge, 5 face of a link's mesh.
        position: [m], normal: of the object's surface there, outward unit, shape (3,). gap: at the final posture [m].
        curve_angle: tangent angle of the object's curve [rad]. link_angle: of the touching side [rad], else None.
    """

    link: int
    joint: int
    body: int
    graspable: bool
    plane: int | None
    offset: float
    kind: int
    position: FloatArray
    normal: FloatArray
    gap: float
    curve_angle: float
    link_angle: float | None

    @property
    def passed(self) -> bool:
        """Whether a later motion opened it by more than 1 µm."""
        return self.gap > PASSED_GAP


@dataclass(eq=False)
class FingerCandidate:
    """One candidate of a finger; the judgement is filled in after the closing.

    Args:
        plan: the finger at its posture. posture: index of the posture alternative.
        plane: index, or None for the full width. travel: of the plan's degrees of freedom [rad].
        q: angles of all joints of the hand with this finger closed, shape (J,) [rad].
        touches: in stage order. overlap: the deepest link where the finger overlaps the object at the start,
            or None; then nothing moves.
        late: it would do so on the plane only once joints about another axis had moved; nothing moves either.
        swept: it was swept over the full width. clear: it passes through nothing on any of the planes.
        feasible, penetration: over the full width, path included; None when not measured.
        scores: criterion name to value. index: its place among the candidates of the plan.
    """

    plan: FingerPlan
    posture: int
    plane: int | None
    travel: FloatArray
    q: FloatArray
    touches: tuple[LinkContact, ...]
    overlap: LinkDepth | None
    late: bool = False
    swept: bool = False
    clear: bool = False
    feasible: bool | None = None
    penetration: float | None = None
    scores: dict[str, float] = field(default_factory=dict)
    index: int = -1

    @property
    def offset(self) -> float | None:
        """Place of the plane along y of the first axis group [m]; None for the full width."""
        return None if self.plane is None else float(self.plan.axis_groups[0].offsets[self.plane])

    @property
    def missed(self) -> bool:
        """Whether another link than the fingertip touches first."""
        return bool(self.touches) and self.touches[0].link != self.plan.finger.tip_link

    def on_the_way(self, hand: Hand, travel: FloatArray) -> FloatArray:
        """Return the angles of all joints when the degrees of freedom have travelled, each until it was held [rad].

        Args:
            hand: the hand. travel: of the plan's degrees of freedom [rad].
        """
        turns = []
        for p in self.plan.joints:
            moved = min(max(travel[p.dof], p.start), p.stop) - p.start
            final = abs(self.q[p.joint] - self.plan.posture[p.joint])
            turns.append(np.sign(p.rate) * min(abs(p.rate) * moved, final))
        return self.plan.turned(hand, np.array(turns))

    @cached_property
    def holding(self) -> tuple[LinkContact, ...]:
        """Contacts with a graspable body that are still touching, each once."""
        still = [t for t in self.touches if t.graspable and not t.passed]
        kept = without_repeats([t.link for t in still], [t.position for t in still], [t.normal for t in still])
        return tuple(still[i] for i in kept)


def combined_posture(hand: Hand, start: FloatArray, chosen: Sequence[FingerCandidate]) -> FloatArray:
    """Return the posture of the whole hand with every finger at its chosen candidate, shape (J,) [rad]."""
    q = start.copy()
    for candidate in chosen:
        own = candidate.plan.finger.own
        q[own] = candidate.q[own]
    return hand.tied(q)


def read_candidates(
    plan: HandPlan,
    packed: PackedObject,
    answer: ClosingArrays,
    T_palm_object: FloatArray,
    overlaps: Sequence[LinkDepth | None],
) -> list[FingerCandidate]:
    """Return the `FingerCandidate` of every candidate of the plan, in its order.

    Args:
        plan: of the fingers. packed: the object. T_palm_object: its pose, shape (4, 4). answer: results of the kernels.
        overlaps: as `start_overlaps` gives them, per finger posture.
    """
    from clench.kernels.closing.layout import SUNK

    finger_postures = plan.candidates.finger_posture.tolist()
    blocked = [overlaps[finger_posture] is not None for finger_posture in finger_postures]
    if any(blocked):
        still = np.array(blocked)
        travel, contacts = answer.travel.copy(), np.where(still, 0, answer.contacts)
        travel[still] = 0.0
        answer = answer._replace(travel=travel, contacts=contacts)
    touches, postures = _read_contacts(plan, packed, T_palm_object, answer)
    sunk = [LinkDepth(SUNK - link, 0.0, None) if link <= SUNK else None for link in answer.overlap.tolist()]
    dofs = plan.arrays(planar=False).first_dof.tolist()
    low, skipped = plan.candidates.low.tolist(), answer.skipped.tolist()
    candidates = []
    for i, finger_posture in enumerate(finger_postures):
        candidates.append(
            FingerCandidate(
                index=i,
                plan=plan.plans[finger_posture],
                posture=plan.posture[finger_posture],
                plane=None if plan.is_full_width[i] else low[i],
                travel=answer.travel[i, dofs[finger_posture] : dofs[finger_posture + 1]],
                q=postures[i],
                touches=touches[i],
                overlap=overlaps[finger_posture] or sunk[i],
                late=not blocked[i] and sunk[i] is not None,
                swept=plan.is_full_width[i] and not skipped[i],
            )
        )
    return candidates


def held_touches(plan: HandPlan, met: Meetings) -> dict[int, list[LinkContact]]:
    """Return the contacts of fingers that stop each other, by finger, without contacts of resting fingers.

    Args:
        plan: of the hand. met: meetings of simultaneously closing fingers at one pose.
    """
    held: dict[int, list[LinkContact]] = {}
    for number, value in zip(met.number[: met.size[0]].tolist(), met.value[: met.size[0]], strict=True):
        for (finger, link, joint), other, sign in ((number[:3], number[4], 1.0), (number[3:], number[1], -1.0)):
            if joint >= 0:
                touch = _held(value, link, other, int(plan.frames.chain_joint[joint]), sign)
                held.setdefault(finger, []).append(touch)
    return held


def _held(value: FloatArray, link: int, met: int, joint: int, sign: float) -> LinkContact:
    return LinkContact(
        link=link,
        joint=joint,
        body=-1 - met,
        graspable=False,
        plane=None,
        offset=0.0,
        kind=_FACE,
        position=value[:3],
        normal=sign * value[3:6],
        gap=float(value[6]),
        curve_angle=0.0,
        link_angle=None,
    )


def _read_contacts(
    plan: HandPlan, packed: PackedObject, T_palm_object: FloatArray, answer: ClosingArrays
) -> tuple[list[tuple[LinkContact, ...]], FloatArray]:
    """Return the touches of every candidate, in stage order, and the angles of all joints, (I, J) [rad]."""
    from clench.kernels.closing.contact_reading import (
        PALM_CONTACT_FLOATS,
        PALM_CONTACT_INTEGERS,
        PalmContactArrays,
        read_contacts,
    )
    from clench.kernels.closing.layout import CONTACT_PLANE

    shape = answer.contact.shape[:2]
    read = PalmContactArrays(
        np.empty((*shape, PALM_CONTACT_INTEGERS), dtype=np.int64), np.empty((*shape, PALM_CONTACT_FLOATS))
    )
    postures = np.empty((shape[0], len(plan.hand.joints)))
    T = np.ascontiguousarray(T_palm_object[:3])
    found = np.arange(shape[1]) < answer.contacts[:, None]
    hand = plan.arrays(planar=bool((answer.contact[..., CONTACT_PLANE] >= 0)[found].any()))
    read_contacts(hand, plan.frames, object_surface(packed), plan.candidates, answer, T, read, postures)
    touches = []
    for i, n in enumerate(answer.contacts.tolist()):
        numbers, values = read.number[i, :n].tolist(), read.value[i, :n].tolist()
        touches.append(tuple(map(_touch, numbers, values, read.value[i])))
    return touches, postures


def _touch(number: list[int], value: list[float], row: FloatArray) -> LinkContact:
    """Return a touch of numbers as `contact_reading` lists them; position and normal are views of `row`."""
    link, joint, body, kind, plane, graspable = number
    gap, curve, side, offset = value[6:]
    return LinkContact(
        link=link,
        joint=joint,
        body=body,
        graspable=bool(graspable),
        plane=plane if plane >= 0 else None,
        offset=offset,
        kind=kind,
        position=row[:3],
        normal=row[3:6],
        gap=gap,
        curve_angle=curve,
        link_angle=None if math.isnan(side) else side,
    )
