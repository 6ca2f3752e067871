"""Numbers that people and files give."""

from __future__ import annotations

import math
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray


def is_finite_number(value: Any) -> bool:
    """Say whether a value is a number that a double holds; truth values and whole numbers out of range are not."""
    try:
        return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(float(value))
    except OverflowError:
        return False


def real_array(values: Any) -> NDArray[np.float64] | None:
    """Return values as an array of float64; such an array is returned unchanged.

    None: the values are text, truth values or complex numbers.
    """
    try:
        array = np.asarray(values)
    except (TypeError, ValueError, OverflowError):
        return None
    return array.astype(np.float64, copy=False) if array.dtype.kind in "iuf" else None
