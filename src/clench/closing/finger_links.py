"""Pack the input of the search for meetings of fingers: their links, and the reach of their joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from clench.core.pose import FloatArray

from .hand_plan import HandPlan
from .link_bodies import HandBodies

if TYPE_CHECKING:
    from clench.kernels.meetings.meeting_layout import FingerLinks
    from clench.kernels.toi.full_width import ExactArrays


def pack_finger_links(plan: HandPlan) -> FingerLinks:
    """Return the links of a plan's fingers that can touch; none where fingers close one after another."""
    from clench.kernels.meetings.meeting_layout import FingerLinks

    exact, bodies = plan.exact, plan.bodies
    first, links, joints, arms, tilts = [0], [], [], [], []
    for entry, finger in enumerate(plan.plans if plan.together else ()):
        movers = slice(exact.mover_first[entry], exact.mover_first[entry + 1])
        moved_by = dict(zip(exact.mover_link[movers].tolist(), exact.mover_joint[movers].tolist(), strict=True))
        begin = int(exact.joint_first[entry])
        for link in finger.finger.links:
            if bodies.links.root[link] >= 0:
                links.append(link)
                joints.append(moved_by.get(link, -1))
                arms.append(_arms(exact, bodies, entry, link, begin, joints[-1]))
        first.append(len(links))
        axes = exact.axis[begin : exact.joint_first[entry + 1]]
        tilts.append(float(np.linalg.norm(np.cross(axes[:, None], axes[None]), axis=2).max(initial=0.0)))
    return FingerLinks(
        first=np.array(first, dtype=np.int64),
        link=np.array(links, dtype=np.int64),
        joint=np.array(joints, dtype=np.int64),
        arm=np.array(arms).reshape(len(links), len(exact.axis)),
        tilt=np.array(tilts),
        apart=bodies.across - bodies.within,
    )


def _arms(exact: ExactArrays, bodies: HandBodies, entry: int, link: int, begin: int, joint: int) -> FloatArray:
    """Return how far from each joint's pivot the points of a link can get [m], shape (J,)."""
    arms = np.zeros(len(exact.axis))
    if joint >= 0:
        ball, T = bodies.links.node[bodies.links.root[link]], exact.link_pose[entry, link]
        arm = float(np.linalg.norm(T[:, :3] @ ball[:3] + T[:, 3] - exact.anchor[joint]) + ball[3])
        for j in range(joint, begin - 1, -1):
            arms[j] = arm
            arm += float(np.linalg.norm(exact.anchor[j] - exact.anchor[j - 1])) if j > begin else 0.0
    return arms
