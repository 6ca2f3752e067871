"""What the bits of computed arrays depend on, beside their input: sources, versions and the processor."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core.registry import cpu_target

from clench.core.caching.fingerprint import fingerprint
from clench.core.caching.number_code import number_code

from .compiling import source_stamp


@cache
def made_by(kernels: str, *others: str) -> str:
    """Return a hash of what computes arrays, hexadecimal.

    Args:
        kernels: file of a module with kernels; the modules with kernels that it imports count, too. others: files of
            the modules without kernels that take part.
    """
    config: Any = numba.config
    return fingerprint(
        source_stamp(Path(kernels)).hex(),
        [fingerprint(Path(file).read_text(encoding="utf-8")) for file in others],
        number_code(),
        [numba.__version__, bool(config.DISABLE_JIT)],
        [str(part) for part in cpu_target.target_context.codegen().magic_tuple()],
    )
