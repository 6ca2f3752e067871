"""Separating planes between two bodies, one of which moves: separated parts cannot meet (docs/method.md section 5)."""

from __future__ import annotations

from clench.kernels.closing.layout import Floats
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.core_distance import separation
from clench.kernels.runtime.compiling import kernel

from .core_motion import MovingCore, plane_offset
from .sides import span
from .toi_bounds import stays_above
from .toi_work import SweepWork


@kernel
def put_plane(nx: float, ny: float, nz: float, offset: float, work: SweepWork) -> None:
    """Write a plane, given relative to the first pivot, to `work`, in the resting body's frame as well."""
    plane, T = work.plane, work.resting
    plane[0], plane[1], plane[2], plane[3] = nx, ny, nz, offset
    for k in range(3):
        plane[4 + k] = nx * T[0, k] + ny * T[1, k] + nz * T[2, k]
    plane[7] = offset - (nx * T[0, 3] + ny * T[1, 3] + nz * T[2, 3])


@kernel
def lay_plane(ka: int, wa: float, kb: int, wb: float, work: SweepWork) -> None:
    """Write the plane half way between two elements that have just met; `work` has them placed there."""
    d, nx, ny, nz, _, _, _, _, _ = separation(work.placed, ka, work.fixed, kb)
    put_plane(nx, ny, nz, plane_offset(work.fixed, kb, nx, ny, nz) + wb + 0.5 * (d - wa - wb), work)


@kernel
def keep_plane(kb: int, wb: float, touch: float, work: SweepWork) -> bool:
    """Keep the plane by which `sweep_pair` saw that two elements never meet; say whether there is one.

    It lies just off the resting element. The other one stayed half a touch tolerance away from that, or half of the
    gap where it began closer.
    """
    nx, ny, nz = work.placed[5, 0], work.placed[5, 1], work.placed[5, 2]
    if nx == 0.0 and ny == 0.0 and nz == 0.0:
        return False
    put_plane(nx, ny, nz, plane_offset(work.fixed, kb, nx, ny, nz) + wb + 0.25 * touch, work)
    return True


@kernel
def stays_beyond(ka: int, wa: float, chain: Floats, count: int, begin: float, best: float, work: SweepWork) -> bool:
    """Say whether the moving item in `work` is seen to stay beyond its plane from `begin` until `best`."""
    nx, ny, nz, offset = work.plane[0], work.plane[1], work.plane[2], work.plane[3]
    return bool(stays_above(MovingCore(work.core, ka, chain, count, work.placed), nx, ny, nz, offset + wa, begin, best))


@kernel
def lies_within(resting: BodyArrays, b: int, work: SweepWork) -> bool:
    """Say whether a resting item lies on the near side of the plane of `work`."""
    plane = work.plane
    return bool(span(resting, b, plane[4], plane[5], plane[6])[1] <= plane[7])


@kernel
def item_lane(bodies: BodyArrays, n: int, T: Floats) -> tuple[float, float]:
    """Return the smallest and largest coordinate of an item along the axis that everything turns about."""
    low, high = span(bodies, n, T[1, 0], T[1, 1], T[1, 2])
    return T[1, 3] + low, T[1, 3] + high


@kernel
def lanes_apart(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Say whether two extents lie apart along the axis that everything turns about: then nothing meets."""
    return bool(one[0] > other[1] or other[0] > one[1])


@kernel
def passes_beside(moving: BodyArrays, a: int, resting: BodyArrays, b: int, work: SweepWork) -> bool:
    """Say whether two items lie apart along the axis that everything turns about: they never meet."""
    return bool(lanes_apart(item_lane(moving, a, work.moving), item_lane(resting, b, work.resting)))
