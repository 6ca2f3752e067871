"""Links that only move along curl planes which lie apart never meet (docs/method.md section 1)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from clench.base.pose import FloatArray
from clench.models.hand.hand import Hand

from .exact import HandBodies
from .plan import FingerPlan


def links_that_may_meet(
    hand: Hand,
    plans: tuple[FingerPlan, FingerPlan],
    paths: tuple[Mapping[int, FloatArray], Mapping[int, FloatArray]],
    bodies: HandBodies,
) -> set[tuple[int, int]]:
    """Return the pairs of links of two fingers whose extents across the curl planes of either come to overlap.

    A turn about an axis moves nothing along it, and a turn about another one at most by its arc times the sine of the
    angle between them.

    Args:
        hand: the hand. plans: of the two fingers. paths: bounds on the arcs that each joint of a plan moves the points
            of a link along [m], (n,) per link. bodies: see `hand_bodies`.
    """
    axes = [_axes(hand, plan) for plan in plans]
    poses = [hand.link_poses(plan.posture)[:, :3] for plan in plans]
    apart = set()
    for n in (*axes[0], *axes[1]):
        sines = [_sines(own, n) for own in axes]
        low, high = {}, {}
        for own, pose, sine in zip(paths, poses, sines, strict=True):
            for link, path in own.items():
                middle = n @ (pose[link, :, :3] @ bodies.links.box[link, :3] + pose[link, :, 3])
                reach = np.abs(n @ pose[link, :, :3]) @ bodies.links.box[link, 3:] + float(path @ sine)
                low[link], high[link] = middle - reach, middle + reach
        apart |= {(m, r) for m in paths[0] for r in paths[1] if low[m] > high[r] or low[r] > high[m]}
    return {(m, r) for m in paths[0] for r in paths[1]} - apart


def _axes(hand: Hand, plan: FingerPlan) -> FloatArray:
    """Return the axes of a plan's joints in the palm frame at its open posture, shape (n, 3)."""
    mover = {link.joint: i for i, link in enumerate(hand.links) if link.joint >= 0}
    poses = hand.link_poses(plan.posture)
    return np.array([poses[mover[p.joint]][:3, :3] @ hand.joints[p.joint].axis for p in plan.joints]).reshape(-1, 3)


def _sines(axes: FloatArray, n: FloatArray) -> FloatArray:
    """Return bounds on the sine of the angle of each axis with a direction while the others turn it, shape (n,)."""
    tilt = max((float(np.linalg.norm(np.cross(a, b))) for a in axes for b in axes), default=0.0)
    bounds: FloatArray = np.linalg.norm(np.cross(axes, n), axis=1) + 2.0 * tilt * len(axes)
    return bounds
