"""Whether two sharp faces that meet cut into each other, or only touch (docs/method.md section 5)."""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats
from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.core_motion import plane_gap
from clench.kernels.toi.separating import side

from .core_distance import edge_count, face_normal
from .vectors import Vector

#: Surfaces that cross by no more than this touch [m].
DEEP = 1e-9
#: Directions shorter than this fraction of their factors count as none [-].
_NONE = 1e-9


@kernel
def looks_right(core: Floats, corners: int, n: Vector, way: float) -> bool:
    """Say whether a face that lies across n looks the given way along it, so that its body is on the other."""
    if corners < 3 or -plane_gap(core, corners, core, corners, n[0], n[1], n[2]) > DEEP:
        return True
    mx, my, mz, _ = face_normal(core)
    return way * (mx * n[0] + my * n[1] + mz * n[2]) >= 0.0


@kernel
def keeps_apart(a: Floats, ka: int, b: Floats, kb: int, n: Vector) -> bool:
    """Say whether a plane across n, either way round, has core `a` and its body on one side, `b` and its on the other.

    A face that lies in the plane has its body behind it: it must not look at the other core's side of it.
    """
    size = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    for _ in range(2):
        size = -size
        m = (n[0] / size, n[1] / size, n[2] / size)
        apart = plane_gap(a, ka, b, kb, m[0], m[1], m[2]) >= -DEEP
        if apart and looks_right(a, ka, m, -1.0) and looks_right(b, kb, m, 1.0):
            return True
    return False


@kernel
def across(u: Vector, v: Vector) -> tuple[bool, Vector]:
    """Return whether u and v span a plane, and the direction across it, made square to u."""
    n = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2]
    uu = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
    if square <= _NONE * _NONE * uu * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]):
        return False, n
    along = (n[0] * u[0] + n[1] * u[1] + n[2] * u[2]) / uu
    return True, (n[0] - along * u[0], n[1] - along * u[1], n[2] - along * u[2])


@kernel
def only_touch(a: Floats, ka: int, b: Floats, kb: int) -> bool:
    """Say whether two sharp cores that cross do so by no more than `DEEP`, with their bodies on either side of a plane.

    Flush faces do: an edge of one lies in the other. This also counts for the end of a body inside another body of the
    same section. The directions of the faces tell it from bodies side by side, whose faces look at each other.
    """
    for face in range(2):
        if (ka if face == 0 else kb) < 3:
            continue
        nx, ny, nz, size = face_normal(a) if face == 0 else face_normal(b)
        if size == 0.0:
            continue
        n = (nx, ny, nz)
        if keeps_apart(a, ka, b, kb, n):
            return True
        for k in range(edge_count(ka) + edge_count(kb)):
            u = side(a, ka, k) if k < edge_count(ka) else side(b, kb, k - edge_count(ka))
            spans, m = across(u, n)
            if spans and keeps_apart(a, ka, b, kb, m):
                return True
    for i in range(edge_count(ka)):
        for k in range(edge_count(kb)):
            spans, m = across(side(a, ka, i), side(b, kb, k))
            if spans and keeps_apart(a, ka, b, kb, m):
                return True
    return False
