"""The hash of the code that computes with arrays changes with whatever chooses this code."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
import scipy

from clench.core.caching.number_code import number_code

CHOOSING = ("OPENBLAS_CORETYPE", "NPY_DISABLE_CPU_FEATURES", "NPY_ENABLE_CPU_FEATURES")


@pytest.mark.parametrize("name", CHOOSING)
def test_the_environment_counts(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.delenv(name, raising=False)
    found = {number_code()}
    for value in ("", "None", "Haswell"):
        monkeypatch.setenv(name, value)
        found.add(number_code())
    assert len(found) == 4


def test_versions_count(monkeypatch: pytest.MonkeyPatch) -> None:
    before = number_code()
    assert number_code() == before
    for library in (np, scipy):
        with monkeypatch.context() as patched:
            patched.setattr(library, "__version__", "0.0")
            assert number_code() != before


def test_the_processor_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same library rounds otherwise where the processor has other instructions."""
    features = np._core._multiarray_umath.__cpu_features__
    before = number_code()
    some = next(iter(features))
    monkeypatch.setitem(features, some, not features[some])
    assert number_code() != before


def test_it_loads_no_parts_of_scipy() -> None:
    program = (
        "import sys; from clench.core.caching.number_code import number_code; number_code(); "
        "print([n for n in ('numba', 'scipy.linalg', 'scipy.spatial') if n in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout == "[]\n"
