"""The object's surface for contact reading: outward normals, and the body of each triangle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from clench.core.pose import FloatArray
from clench.models.objects.grasp_object import BodyRole

from .packed_object import PackedObject

if TYPE_CHECKING:
    from clench.kernels.closing.contact_reading import SurfaceArrays
    from clench.kernels.closing.layout import RoundArrays


def round_arrays(packed: PackedObject) -> RoundArrays:
    """Return an object's round shapes as the kernels take them."""
    from clench.kernels.closing.layout import RoundArrays

    r = packed.rounds
    return RoundArrays(r.kind.astype(np.int64), r.size, r.T_object_shape)


def object_surface(packed: PackedObject) -> SurfaceArrays:
    """Return the object's data for contact reading; made once per object."""
    return packed.kept(("surface",), lambda: _make_surface(packed))


def _make_surface(packed: PackedObject) -> SurfaceArrays:
    from clench.kernels.closing.contact_reading import SurfaceArrays

    graspable = [role is BodyRole.GRASPABLE for role in packed.body_roles]
    return SurfaceArrays(
        packed.tree.normals,
        packed.tree.body,
        round_arrays(packed),
        packed.rounds.body,
        packed.element_body,
        np.array(graspable, dtype=np.int64),
    )


def nearest_body(packed: PackedObject, place: FloatArray) -> int:
    """Return the body whose surface is nearest to a point of the object's frame, shape (3,) [m]."""
    if len(packed.body_names) == 1:
        return 0
    from clench.kernels.geometry.mesh_distance import closest_point

    _, triangle, _, _, _ = closest_point(packed.full_tree, np.asarray(place, dtype=np.float64), np.inf)
    return int(packed.full_tree.body[triangle])
