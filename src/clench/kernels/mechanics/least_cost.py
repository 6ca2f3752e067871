"""Small linear programs by the dual simplex method, in a dense table.

All costs are at least 0. So the slack variables are a start that is optimal but for the demands that it misses. Each
step meets the demand that is missed most, and stays optimal.

C. E. Lemke, "The dual method of solving the linear programming problem", Naval Research Logistics Quarterly, 1954.
"""

from __future__ import annotations

import numpy as np

from clench.kernels.closing.layout import Floats, Ints
from clench.kernels.runtime.compiling import entry_kernel, kernel

#: A demand that is missed by less than this, as a fraction of the largest number in its row, is met [-].
_MET = 1e-12
#: Smaller numbers of a row, as a fraction of its largest, are rounding [-].
_PIVOT = 1e-11
#: After this many steps, the first demand is met instead of the one that is missed most: no two steps then repeat.
_STEPS = 200
_LAST = 2000


@entry_kernel(allocates=True)
def least_cost(rows: Floats, most: Floats, cost: Floats, x: Floats) -> bool:
    """Write the x with `rows x <= most` and `x >= 0` of least `cost x`; say whether there is one.

    Args:
        rows: shape (M, N). most: shape (M,). cost: at least 0, shape (N,). x: written, shape (N,).
    """
    count, size = rows.shape
    table, basis, scale = np.empty((count + 1, size + 1)), np.empty(count, dtype=np.int64), np.empty(count)
    free = np.arange(size)
    for i in range(count):
        basis[i], scale[i] = size + i, abs(most[i])
        for j in range(size):
            table[i, j] = rows[i, j]
            scale[i] = max(scale[i], abs(rows[i, j]))
        table[i, size] = most[i]
    table[count, :size] = cost
    table[count, size] = 0.0
    for step in range(_LAST):
        i = _missed(table, basis, scale, step < _STEPS)
        if i < 0:
            x[:] = 0.0
            for k in range(count):
                if basis[k] < size:
                    x[basis[k]] = max(table[k, size], 0.0)
            return True
        j = _entering(table, free, i)
        if j < 0:
            return False
        basis[i], free[j] = free[j], basis[i]
        _exchange(table, i, j)
    return False


@kernel
def _missed(table: Floats, basis: Ints, scale: Floats, most: bool) -> int:
    """Return the demand that is missed most, or of the missed ones the one of the first variable; -1 for none."""
    size, found, worst = table.shape[1] - 1, -1, 0.0
    for i in range(len(basis)):
        if table[i, size] < -_MET * scale[i]:
            missed = -table[i, size] / scale[i] if most else 1.0 / (1.0 + basis[i])
            if missed > worst:
                found, worst = i, missed
    return found


@kernel
def _entering(table: Floats, free: Ints, i: int) -> int:
    """Return the column that meets the demand of a row at the least cost, -1 where none does."""
    last, size = table.shape[0] - 1, table.shape[1] - 1
    largest = 0.0
    for j in range(size):
        largest = max(largest, abs(table[i, j]))
    found, least = -1, np.inf
    for j in range(size):
        if table[i, j] < -_PIVOT * largest:
            price = max(table[last, j], 0.0) / -table[i, j]
            if price < least or (price == least and free[j] < free[found]):
                found, least = j, price
    return found


@kernel
def _exchange(table: Floats, i: int, j: int) -> None:
    """Exchange the variable of a row for that of a column."""
    pivot = table[i, j]
    for k in range(table.shape[1]):
        table[i, k] /= pivot
    table[i, j] = 1.0 / pivot
    for r in range(table.shape[0]):
        if r != i and table[r, j] != 0.0:
            factor = table[r, j]
            for k in range(table.shape[1]):
                if k != j:
                    table[r, k] -= factor * table[i, k]
            table[r, j] = -factor / pivot
