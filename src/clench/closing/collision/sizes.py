"""Sizes and distances beside the size of the hand: lengths in millimetres are often taken for metres."""

from __future__ import annotations

import warnings
from typing import Final

import numpy as np

from clench.core.pose import FloatArray
from clench.models.hand.hand import Hand
from clench.models.hand.link_mesh import link_meshes
from clench.models.objects.grasp_object import GraspObject
from clench.models.objects.mesh_checks import SMALL, larger, smaller

from .packed_object import PackedObject, pack_object

#: An object that is so many times as large as the hand is hardly meant to be.
FAR_LARGER: Final = 10.0
#: Nor is one below `SMALL` that the hand is so many times as large as.
FAR_SMALLER: Final = 100.0
#: Nor is a hand that is so many times its size away from the object.
FAR_AWAY: Final = 10.0


def warn_of_size(hand: Hand, obj: GraspObject) -> bool:
    """Warn if the grasp target is far larger or far smaller than the hand, and return whether it is."""
    across, size = 2.0 * pack_object(obj).size, hand_size(hand)
    if across > FAR_LARGER * size > 0.0:
        how, advice = f"{across / size:.0f} times the size of the hand {hand.name}", smaller(obj.scale)
    elif 0.0 < across < min(SMALL, size / FAR_SMALLER):
        how, advice = f"1/{size / across:.0f} of the size of the hand {hand.name}", larger(obj.scale)
    else:
        return False
    warnings.warn(f"{obj.name} is {across:.3g} m across, {how} ({size:.2g} m): {advice}.", stacklevel=1)
    return True


def far_away(hand: Hand, packed: PackedObject, T_palm_object: FloatArray) -> FloatArray:
    """Return how far palms are from an object [m], 0 for those that are not far, shape (N,).

    A palm is far if it is more than `FAR_AWAY` times the size of the hand away.

    Args:
        hand: the hand. packed: the object. T_palm_object: shape (N, 3, 4) or (N, 4, 4).
    """
    size = hand_size(hand) or np.inf
    centers = T_palm_object[:, :3, :3] @ packed.center + T_palm_object[:, :3, 3]
    away = np.linalg.norm(centers, axis=1) - packed.size
    far: FloatArray = np.where(away > FAR_AWAY * size, away, 0.0)
    return far


def hand_size(hand: Hand) -> float:
    """Return the diameter of a ball around the open hand [m], 0 for a hand without shapes."""
    return hand.kept(("size",), lambda: _hand_size(hand))


def _hand_size(hand: Hand) -> float:
    poses, meshes = hand.link_poses(hand.open_angles()), link_meshes(hand)
    if not meshes:
        return 0.0
    centers = np.array([poses[m.link][:3, :3] @ m.center + poses[m.link][:3, 3] for m in meshes])
    radii = np.array([m.radius for m in meshes])
    middle = 0.5 * ((centers - radii[:, None]).min(axis=0) + (centers + radii[:, None]).max(axis=0))
    return 2.0 * float((np.linalg.norm(centers - middle, axis=1) + radii).max())
