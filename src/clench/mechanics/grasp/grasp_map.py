"""The grasp map: from contact forces to wrenches on the object (Murray, Li and Sastry 1994, chapter 5).

Wrenches are `(force, torque / length)` about the centre of mass, both in newtons. The length scale gives the ball of
wrenches a meaning, and makes results independent of the unit of length.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray

from .contacts import ContactSet


def grasp_map(contacts: ContactSet, center: ArrayLike, length: float) -> FloatArray:
    """Return G, shape (6, C * width): `G f` is the wrench of contact forces f on the object.

    Args:
        contacts: the contacts. center: centre of mass in the same frame [m], shape (3,).
        length: the length scale [m].

    Raises:
        CommandError: a length that is not above 0, a centre that is not finite.
    """
    origin = np.asarray(center, dtype=np.float64)
    if not (np.isfinite(length) and length > 0.0):
        raise CommandError(f"length scale: expected a number above 0 m, got {length!r}.")
    if origin.shape != (3,) or not np.isfinite(origin).all():
        raise CommandError(f"centre of mass: expected three finite numbers [m], got {center!r}.")
    G = np.zeros((6, len(contacts), contacts.width))
    frames = contacts.frames
    arms = (contacts.positions - origin) / length
    G[:3, :, :3] = frames.transpose(1, 0, 2)
    G[3:, :, :3] = np.cross(arms[:, None, :], frames.transpose(0, 2, 1)).transpose(2, 0, 1)
    if contacts.width == 4:
        G[3:, :, 3] = contacts.normals.T / length
    return G.reshape(6, -1)


def edge_wrenches(contacts: ContactSet, center: ArrayLike, length: float, edges: int) -> FloatArray:
    """Return the wrenches of the edges of the friction cones at unit normal force [N], shape (C, N, 6).

    Args:
        contacts, center, length: see `grasp_map`. edges: see `ContactSet.cone_edges`.
    """
    G = grasp_map(contacts, center, length).reshape(6, len(contacts), contacts.width)
    wrenches: FloatArray = np.einsum("wck,cek->cew", G, contacts.cone_edges(edges))
    return wrenches
