"""First contact of a moving capsule or sphere with a body in a window of travel (docs/method.md section 5).

One walk through the tree: a node is left out where one plane keeps it off the core in the whole window. What is left of
the elements, the exact sweep of pairs decides.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.core_distance import face_normal, separation
from clench.kernels.geometry.vectors import Vector, cross, dot, scaled
from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.core_motion import CorePair, MovingCore, base_motion, place_core, plane_offset
from clench.kernels.toi.spatial_motion import is_spatial
from clench.kernels.toi.toi_pairs import sweep_pair
from clench.kernels.toi.toi_work import BodyPair, SweepWork, put_core
from clench.kernels.trees.obb import slab_top

from .round_motion import AT, BEND, END, PLANE, RoundMotion, along, put_length, stays_over

#: After a contact, elements that stay this share of the touch tolerance away until then do not matter [-].
HELD = 0.25
#: Newton's method takes so many steps at most, and ends with a gap between these shares of the touch tolerance [-].
TURNS, LEAST, MOST = 12, 0.4, 0.6


@kernel
def sweep_window(pair: BodyPair, motion: RoundMotion, s: float, end: float, work: SweepWork) -> float:
    """Return the first contact before `end` in a window that has begun, else `end`; see `sweep_pair`.

    Args:
        motion: of the core, which is in `work`. s: up to here nothing touches, or the start.
    """
    resting, stack, waiting, reach = pair.resting, work.stack, 1, motion.radius + pair.touch
    stack[0, 0] = resting.root[pair.r]
    while waiting > 0:
        waiting -= 1
        n = stack[waiting, 0]
        if keeps_off_node(resting, n, motion, reach, work):
            continue
        if resting.count[n] == 0:
            right = resting.right[n]
            k = 1 if from_core(resting, n + 1, motion, work) < from_core(resting, right, motion, work) else 0
            stack[waiting + k, 0], stack[waiting + 1 - k, 0] = n + 1, right
            waiting += 2
            continue
        for e in range(resting.first[n], resting.first[n] + resting.count[n]):
            if keeps_off_element(resting, e, motion, reach, work):
                continue
            found = sweep_element(pair, motion, e, s, end, reach, work)
            if found < 0.0:
                return found
            if found < end:
                end, reach = found, motion.radius + HELD * pair.touch
                put_length(motion, end - s, work)
    return end


@kernel
def from_core(resting: BodyArrays, n: int, motion: RoundMotion, work: SweepWork) -> float:
    """Return the squared distance of the middle of a node's box from the core where the window begins [m²]."""
    way = from_box(resting.slab[n], motion, work)
    return float(dot(way, way))


@kernel
def from_box(slab: Any, motion: RoundMotion, work: SweepWork) -> Vector:
    """Return the way from the middle of a box to the closest point of the core where the window begins."""
    rows = work.round
    x, y, z = rows[AT, 0] - np.float64(slab[0]), rows[AT, 1] - np.float64(slab[1]), rows[AT, 2] - np.float64(slab[2])
    if motion.corners == 1:
        return x, y, z
    u = rows[AT + 1, 0] - rows[AT, 0], rows[AT + 1, 1] - rows[AT, 1], rows[AT + 1, 2] - rows[AT, 2]
    size = dot(u, u)
    t = min(max(-(u[0] * x + u[1] * y + u[2] * z) / size, 0.0), 1.0) if size > 0.0 else 0.0
    return x + t * u[0], y + t * u[1], z + t * u[2]


@kernel
def keeps_off_node(resting: BodyArrays, n: int, motion: RoundMotion, reach: float, work: SweepWork) -> bool:
    """Say whether a plane keeps a node off the core in a window: the last one, one towards it, one along its face."""
    rows, slab = work.round, resting.slab[n]
    v = (rows[PLANE, 0], rows[PLANE, 1], rows[PLANE, 2])
    if stays_over(motion, rows, v, slab_top(slab, v[0], v[1], v[2]) + reach):
        return True
    way = from_box(slab, motion, work)
    size = math.sqrt(dot(way, way))
    if size > 0.0 and is_kept_over(slab, scaled(way, 1.0 / size), motion, reach, work):
        return True
    v = np.float64(slab[9]), np.float64(slab[10]), np.float64(slab[11])
    size = math.sqrt(dot(v, v))
    if size <= 0.0:
        v = cross(
            (np.float64(slab[3]), np.float64(slab[4]), np.float64(slab[5])),
            (np.float64(slab[6]), np.float64(slab[7]), np.float64(slab[8])),
        )
        size = math.sqrt(dot(v, v))
    if size <= 0.0:
        return False
    return bool(is_kept_over(slab, scaled(v, (1.0 if dot(v, way) > 0.0 else -1.0) / size), motion, reach, work))


@kernel
def is_kept_over(slab: Any, v: Vector, motion: RoundMotion, reach: float, work: SweepWork) -> bool:
    """Say whether the plane across v keeps a node's box off the core in a window; keep it if so."""
    if not stays_over(motion, work.round, v, slab_top(slab, v[0], v[1], v[2]) + reach):
        return False
    keep_direction(v, work)
    return True


@kernel
def element_top(resting: BodyArrays, e: int, v: Vector) -> float:
    """Return the largest coordinate of an element along a unit vector."""
    top = -math.inf
    for k in range(resting.corners[e]):
        p = resting.vertices[resting.elements[e, k]]
        top = max(top, v[0] * p[0] + v[1] * p[1] + v[2] * p[2])
    return top + float(resting.radius[e])


@kernel
def keeps_off_element(resting: BodyArrays, e: int, motion: RoundMotion, reach: float, work: SweepWork) -> bool:
    """Say whether the last plane, or that of its face, keeps an element off the core in a window."""
    rows = work.round
    v = (rows[PLANE, 0], rows[PLANE, 1], rows[PLANE, 2])
    if stays_over(motion, rows, v, element_top(resting, e, v) + reach):
        return True
    if resting.corners[e] < 3:
        return False
    for k in range(3):
        p = resting.vertices[resting.elements[e, k]]
        work.fixed[k, 0], work.fixed[k, 1], work.fixed[k, 2] = p[0], p[1], p[2]
    nx, ny, nz, size = face_normal(work.fixed)
    if size <= 0.0:
        return False
    v = (nx, ny, nz)
    if along(rows, AT, v) < nx * work.fixed[0, 0] + ny * work.fixed[0, 1] + nz * work.fixed[0, 2]:
        v = (-nx, -ny, -nz)
    if not stays_over(motion, rows, v, element_top(resting, e, v) + reach):
        return False
    keep_direction(v, work)
    return True


@kernel
def sweep_element(
    pair: BodyPair, motion: RoundMotion, e: int, s: float, end: float, reach: float, work: SweepWork
) -> float:
    """Return the first contact of an element before `end`, else `end`; the pair and its place are written."""
    resting, rows, ka, touch = pair.resting, work.round, motion.corners, pair.touch
    # With 64 bits, as from `put_item`: for another size, all that is called with `cores` would be compiled again.
    kb, w = int(np.int64(resting.corners[e])), motion.radius + resting.radius[e]
    put_core(resting, e, work.resting, work.fixed)
    d, nx, ny, nz, _, _, x, y, z = separation(rows[END:], ka, work.fixed, kb)
    cores = CorePair(MovingCore(work.core, ka, pair.chain, pair.rows, work.placed), work.fixed, kb, w, touch)
    found = -1.0
    if d - w > touch:
        v = in_body((nx, ny, nz), work)
        if stays_over(motion, rows, v, element_top(resting, e, v) + reach):
            keep_direction(v, work)
            return end
    elif end > s:
        found, n = root_before(cores, s, end, d, (nx, ny, nz), (x, y, z))
        v = in_body(n, work)
        if found > 0.0 and not is_first(cores, motion, s, found, n, work):
            put_length(motion, end - s, work)
            found = -1.0
    if found < 0.0:
        found = sweep_pair(cores, s, end)
        if found >= end:
            if end > s:
                keep_direction(in_body((work.placed[5, 0], work.placed[5, 1], work.placed[5, 2]), work), work)
            return end
        _, nx, ny, nz, _, _, _, _, _ = separation(work.placed, ka, work.fixed, kb)
        v = in_body((nx, ny, nz), work)
    work.pair[1] = e
    if found >= 0.0:
        keep_direction(v, work)
        for k in range(ka):
            for c in range(3):
                rows[END + k, c] = work.placed[k, c]
    return found


@kernel
def is_first(cores: CorePair, motion: RoundMotion, s: float, found: float, n: Vector, work: SweepWork) -> bool:
    """Say whether the plane across n shows that two cores touch at a travel first.

    At the start they do not touch: what may touch there is for `sweep_pair`. Several joints may also be followed back
    from the contact.

    Args:
        n: relative to the first pivot. s: a travel before, for which the window in `work` begins.
    """
    moving, rows, v = cores.moving, work.round, in_body(n, work)
    top = plane_offset(cores.fixed, cores.corners, n[0], n[1], n[2]) + cores.w
    T = work.resting
    shifted = top - n[0] * T[0, 3] - n[1] * T[1, 3] - n[2] * T[2, 3]
    for k in range(motion.corners):
        if s == 0.0 and along(rows, AT + k, v) - shifted <= cores.touch:
            return False
    put_length(motion, found - s, work)
    if stays_over(motion, rows, v, shifted):
        return True
    if motion.single:
        return False
    chain, count, length = moving.chain, moving.rows, found - s
    px, pz, base, _, _, _ = base_motion(chain, count, n[0], n[2], found)
    for k in range(motion.corners):
        x, y, z = moving.placed[k, 0], moving.placed[k, 1], moving.placed[k, 2]
        gap = n[0] * x + n[1] * y + n[2] * z - top
        slope = base + chain[count - 1, 0] * (n[2] * (x - px) - n[0] * (z - pz))
        if gap <= 0.0 or gap - slope * length <= 0.5 * rows[BEND, k] * length * length:
            return False
    return True


@kernel
def root_before(pair: CorePair, s: float, end: float, d: float, n: Vector, q: Vector) -> tuple[float, Vector]:
    """Return a travel between two at which cores touch, and the direction of their gap; -1 if it is not found.

    Newton's method in a bracket; the gap that is left is in the middle of what `sweep_pair` leaves. Whether nothing
    touches before is not known. The first rows of `placed` are the moving core there.

    Args:
        d, n, q: how the cores lie at `end`, as `separation` tells it.
    """
    moving, chain, count = pair.moving, pair.moving.chain, pair.moving.rows
    low, high, x = s, end, end
    if is_spatial(chain):
        return -1.0, n
    rate = chain[count - 1, 0]
    for _ in range(TURNS):
        gap = d - pair.w - 0.5 * pair.touch
        px, pz, slope, _, _, _ = base_motion(chain, count, n[0], n[2], x)
        slope += rate * (n[2] * (q[0] + d * n[0] - px) - n[0] * (q[2] + d * n[2] - pz))
        if gap > 0.0:
            low = x
        else:
            high = x
        x = x - gap / slope if slope < 0.0 else low
        if not low < x < high:
            x = 0.5 * (low + high)
        place_core(moving, x)
        d, nx, ny, nz, _, _, qx, qy, qz = separation(moving.placed, moving.corners, pair.fixed, pair.corners)
        n, q = (nx, ny, nz), (qx, qy, qz)
        if LEAST * pair.touch < d - pair.w <= MOST * pair.touch:
            return x, n
    return -1.0, n


@kernel
def keep_direction(v: Vector, work: SweepWork) -> None:
    """Keep the direction across the last plane."""
    work.round[PLANE, 0], work.round[PLANE, 1], work.round[PLANE, 2] = v


@kernel
def in_body(n: Vector, work: SweepWork) -> Vector:
    """Return a direction in the frame of the resting body."""
    T = work.resting
    return (
        T[0, 0] * n[0] + T[1, 0] * n[1] + T[2, 0] * n[2],
        T[0, 1] * n[0] + T[1, 1] * n[1] + T[2, 1] * n[2],
        T[0, 2] * n[0] + T[1, 2] * n[1] + T[2, 2] * n[2],
    )
