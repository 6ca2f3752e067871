"""The size of an object beside that of the hand: lengths in millimetres are often taken for metres."""

from __future__ import annotations

import warnings
from typing import Final

import numpy as np

from clench.models.hand.hand import Hand
from clench.models.hand.link_mesh import link_meshes
from clench.models.objects.grasp_object import GraspObject
from clench.models.objects.mesh_checks import smaller

from .packed_object import pack_object

#: An object that is so many times as large as the hand is hardly meant to be.
FAR_LARGER: Final = 10.0


def warn_of_size(hand: Hand, obj: GraspObject) -> bool:
    """Warn, once per object, if the grasp target is far larger than the hand, and return whether it is."""
    across, size = 2.0 * pack_object(obj).size, hand_size(hand)
    if not across > FAR_LARGER * size > 0.0:
        return False
    warnings.warn(
        f"{obj.name} is {across:.3g} m across, {across / size:.0f} times the size of the hand {hand.name} "
        f"({size:.2g} m): {smaller(obj.scale)}.",
        stacklevel=1,
    )
    return True


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
