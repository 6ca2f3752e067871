"""What chooses the code that computes with arrays, and so the bits of results."""

from __future__ import annotations

import os
from typing import Final

import numpy as np

from .fingerprint import fingerprint

#: Environment variables that choose the code of NumPy and of its linear algebra.
_CHOOSING: Final = ("OPENBLAS_CORETYPE", "NPY_DISABLE_CPU_FEATURES", "NPY_ENABLE_CPU_FEATURES")


def number_code() -> str:
    """Return a hash of NumPy's and SciPy's versions, the processor, and the environment, hexadecimal."""
    import scipy  # without its parts, which take long to load

    known = getattr(getattr(np, "_core", None), "_multiarray_umath", None)
    features = {name: bool(there) for name, there in getattr(known, "__cpu_features__", {}).items()}
    chosen = [os.environ.get(name) for name in _CHOOSING]
    return fingerprint(np.__version__, scipy.__version__, features, chosen)
