"""The one decorator of all kernels: strict floating point, cached on disk, without the interpreter's lock."""

from __future__ import annotations

from typing import Any

from numba import njit

kernel: Any = njit(cache=True, nogil=True, error_model="numpy")
