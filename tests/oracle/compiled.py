"""Numba's ``njit`` with the function's own type kept, so that type checkers see through it."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt

F = TypeVar("F", bound=Callable[..., Any])

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


def compiled(function: F) -> F:
    """Compile a function of scalars and arrays; strict floating point, cached on disk."""
    return cast(F, numba.njit(cache=True, error_model="numpy")(function))
