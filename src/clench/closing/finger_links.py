"""Pack the input of the search for meetings of fingers: their links, and the reach of their joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from clench.core.pose import FloatArray

from .hand_plan import HandPlan
from .link_bodies import HandBodies

if TYPE_CHECKING:
    from clench.kernels.meetings.meeting_layout import FingerLinks
    from clench.kernels.toi.full_width import FullWidthArrays


def pack_finger_links(plan: HandPlan) -> FingerLinks:
    """Return the links of a plan's fingers that can touch; none where fingers close one after another."""
    from clench.kernels.meetings.meeting_layout import FingerLinks

    full_width, bodies = plan.full_width_arrays, plan.bodies
    first, links, joints, arms, tilts = [0], [], [], [], []
    for finger_posture, finger in enumerate(plan.plans if plan.together else ()):
        movers = slice(full_width.mover_first[finger_posture], full_width.mover_first[finger_posture + 1])
        moved_by = dict(
            zip(full_width.mover_link[movers].tolist(), full_width.mover_joint[movers].tolist(), strict=True)
        )
        begin = int(full_width.joint_first[finger_posture])
        for link in finger.finger.links:
            if bodies.links.root[link] >= 0:
                links.append(link)
                joints.append(moved_by.get(link, -1))
                arms.append(_arms(full_width, bodies, finger_posture, link, begin, joints[-1]))
        first.append(len(links))
        axes = full_width.axis[begin : full_width.joint_first[finger_posture + 1]]
        tilts.append(float(np.linalg.norm(np.cross(axes[:, None], axes[None]), axis=2).max(initial=0.0)))
    return FingerLinks(
        first=np.array(first, dtype=np.int64),
        link=np.array(links, dtype=np.int64),
        joint=np.array(joints, dtype=np.int64),
        arm=np.array(arms).reshape(len(links), len(full_width.axis)),
        tilt=np.array(tilts),
        apart=bodies.across - bodies.within,
    )


def _arms(
    full_width: FullWidthArrays, bodies: HandBodies, finger_posture: int, link: int, begin: int, joint: int
) -> FloatArray:
    """Return how far from each joint's pivot the points of a link can get [m], shape (J,)."""
    arms = np.zeros(len(full_width.axis))
    if joint >= 0:
        ball, T = bodies.links.node[bodies.links.root[link]], full_width.link_pose[finger_posture, link]
        arm = float(np.linalg.norm(T[:, :3] @ ball[:3] + T[:, 3] - full_width.anchor[joint]) + ball[3])
        for j in range(joint, begin - 1, -1):
            arms[j] = arm
            arm += float(np.linalg.norm(full_width.anchor[j] - full_width.anchor[j - 1])) if j > begin else 0.0
    return arms
