"""A hash of what computes arrays changes with everything that may change a bit of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from clench.kernels.runtime.made_by import made_by
from clench.kernels.trees import bvh, tree_growth


def test_other_sources_and_other_code_of_libraries_have_another_hash(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same library rounds otherwise on another processor, and where the environment names one."""
    monkeypatch.setenv("OPENBLAS_CORETYPE", "Haswell")
    other = tmp_path / "maker.py"
    other.write_text("one = 1\n")

    def fresh(*files: str) -> str:
        made_by.cache_clear()
        return made_by(*files)

    found = [fresh(str(bvh.__file__)), fresh(str(tree_growth.__file__)), fresh(str(bvh.__file__), str(other))]
    again = fresh(str(bvh.__file__), str(other))
    other.write_text("one = 2\n")
    found.append(fresh(str(bvh.__file__), str(other)))
    monkeypatch.setenv("OPENBLAS_CORETYPE", "SkylakeX")
    found.append(fresh(str(bvh.__file__)))
    monkeypatch.setattr("scipy.__version__", "0.0")
    found.append(fresh(str(bvh.__file__)))
    made_by.cache_clear()
    assert len(set(found)) == len(found)
    assert again == found[2]
