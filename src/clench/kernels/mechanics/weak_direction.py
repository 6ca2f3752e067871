"""The direction in which a hull of points reaches least far, from one facet to the next that is nearer.

The `y` with `w y <= 1` for all points w make the hull's polar: a facet of the hull is a corner of it, and the nearest
facet is the corner farthest from 0. From a direction c an active-set method finds the corner that maximises `c y`. It
is the next c, until it stays: `|y|` grows with every one.
"""

from __future__ import annotations

import numpy as np

from clench.kernels.runtime.compiling import entry_kernel, kernel

#: Growth and slopes below this are rounding [-].
_SMALL = 1e-11
#: Parts of the direction, and multipliers, below this fraction of it are none [-].
_LEAST = 1e-9
#: Corners that are gone through from one start, and steps to each; more are lost in rounding.
_CORNERS = 30
_STEPS = 100


@entry_kernel(allocates=True)
def nearer_facets(points: np.ndarray, starts: np.ndarray, found: np.ndarray, reach: np.ndarray) -> None:
    """Write a direction in which the hull of 0 and points reaches least far near every start, and how far.

    Args:
        points: shape (N, D). starts: directions, shape (M, D). found: written, unit, shape (M, D).
        reach: written: the support of the hull of the points along it, not above 0 when they lie in a half space, (M,).
    """
    size = points.shape[1]
    y = np.zeros(size)
    for m in range(len(starts)):
        c = starts[m].copy()
        length = 0.0
        for _ in range(_CORNERS):
            corner = _farthest_corner(points, c, y)
            norm = np.sqrt(_dot(y, y))
            if not corner or norm <= length * (1.0 + _SMALL):
                break
            length = norm
            c[:] = y
        norm = np.sqrt(_dot(y, y))
        if not norm > 0.0:
            y[:] = starts[m]
            norm = np.sqrt(_dot(y, y))
        reach[m] = -np.inf
        for k in range(size):
            found[m, k] = y[k] / norm
        for w in range(len(points)):
            reach[m] = max(reach[m], _dot(points[w], found[m]))


@kernel(allocates=True)
def _farthest_corner(points: np.ndarray, c: np.ndarray, y: np.ndarray) -> bool:
    """Write the y with `w y <= 1` for all points that maximises `c y`; without one, a direction that has no bound.

    Returns:
        Whether there is one.
    """
    size = len(c)
    active, basis = np.zeros(size, dtype=np.int64), np.zeros((size, size))
    count = 0
    y[:] = 0.0
    p = np.empty(size)
    scale = np.sqrt(_dot(c, c))
    for _ in range(_STEPS):
        p[:] = c
        for k in range(count):
            _remove(p, basis[k])
        if count == size or np.sqrt(_dot(p, p)) <= _LEAST * scale:
            worst = _least_multiplier(points, active, count, basis, c)
            if worst < 0:
                return True
            for k in range(worst, count - 1):
                active[k] = active[k + 1]
            count -= 1
            _orthogonal(points, active, count, basis)
            continue
        hit, step = -1, np.inf
        for i in range(len(points)):
            along = _dot(points[i], p)
            if along > _SMALL * scale:
                room = max(0.0, 1.0 - _dot(points[i], y)) / along
                if room < step:
                    hit, step = i, room
        if hit < 0:
            y[:] = p
            return False
        for k in range(size):
            y[k] += step * p[k]
        active[count] = hit
        count += 1
        _orthogonal(points, active, count, basis)
    return True


@kernel(allocates=True)
def _orthogonal(points: np.ndarray, active: np.ndarray, count: int, basis: np.ndarray) -> None:
    """Write orthonormal rows that span the active points, one after another."""
    for k in range(count):
        basis[k] = points[active[k]]
        for _ in range(2):
            for j in range(k):
                _remove(basis[k], basis[j])
        basis[k] /= max(np.sqrt(_dot(basis[k], basis[k])), 1e-300)


@kernel(allocates=True)
def _least_multiplier(points: np.ndarray, active: np.ndarray, count: int, basis: np.ndarray, c: np.ndarray) -> int:
    """Return the place of the active point with the most negative multiplier in `c = sum of m w`, -1 for none."""
    m = np.zeros(count)
    for k in range(count - 1, -1, -1):
        left = _dot(c, basis[k])
        for j in range(k + 1, count):
            left -= m[j] * _dot(points[active[j]], basis[k])
        m[k] = left / _dot(points[active[k]], basis[k])
    worst, least = -1, -_LEAST * np.sqrt(_dot(c, c))
    for k in range(count):
        share = m[k] * np.sqrt(_dot(points[active[k]], points[active[k]]))
        if share < least:
            worst, least = k, share
    return worst


@kernel
def _dot(a: np.ndarray, b: np.ndarray) -> float:
    total = 0.0
    for k in range(len(a)):
        total += a[k] * b[k]
    return total


@kernel
def _remove(a: np.ndarray, unit: np.ndarray) -> None:
    """Take the part along a unit row from another."""
    along = _dot(a, unit)
    for k in range(len(a)):
        a[k] -= along * unit[k]
