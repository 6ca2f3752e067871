"""The kind of a solution: pinch, tripod, precision or power grasp."""

from __future__ import annotations

from typing import Final

import numpy as np

from clench.closing.collision.packed_object import pack_object
from clench.closing.collision.reach import graspable_body, nearest_link
from clench.core.pose import invert
from clench.mechanics.grasp.contact_kinds import KINDS, GraspKind, contact_kinds
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.models.shapes import CollisionSource
from clench.solver.preshapes.named_angles import posture
from clench.solver.solution import GraspSolution

#: A palm this near to the object touches it [m]: DexGraspBench counts links so.
PALM_NEAR: Final = 0.002


def grasp_kind(solution: GraspSolution, hand: Hand, obj: GraspObject | None = None) -> GraspKind | None:
    """Return the kind of a grasp by the links that touch, None if fewer than two of fingers and palm touch.

    `GraspKind` lists the kinds. The default closing order brings every link to the object, so most of its grasps are
    power grasps. The order `fingertip` gives the other kinds.

    A contact that a later motion opened does not count. A solution lists contacts of the fingers only, because the palm
    does not close. With the object, the palm touches when it is within 2 mm of it, and contacts with obstacles do not
    count. Without the object, the palm is taken not to touch, and every contact counts.

    Args:
        solution: the grasp. hand: its hand. obj: its object, with obstacles.

    Raises:
        CommandError: the solution is of another hand. UnknownNameError: a contact's link is not in the hand.
    """
    q = posture(solution.joint_angles, hand, "joint_angles")
    contacts = [contact for contact in solution.contacts if not contact.passed]
    if obj is not None:
        graspable = {body.name for body in obj.bodies if body.role is BodyRole.GRASPABLE}
        contacts = [contact for contact in contacts if contact.body in graspable]
    links = [hand.link_index(contact.link) for contact in contacts]
    if obj is not None:
        T = invert(solution.hand_pose.matrix) @ solution.object_pose.matrix
        source = CollisionSource(solution.collision_source)
        target = graspable_body(obj, pack_object(obj))
        gap, palm = nearest_link(hand, q, hand.fixed_links, source, target, T)
        links += [palm] if gap <= PALM_NEAR else []
    codes = contact_kinds(hand, np.array([0, len(links)]), np.array(links, dtype=np.int64))
    return None if codes[0] < 0 else KINDS[int(codes[0])]
