"""A hash of what computes arrays changes with everything that may change a bit of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numba
import pytest
from numba.core.registry import cpu_target

from clench.kernels.runtime import made_by as module
from clench.kernels.runtime.made_by import made_by
from clench.kernels.trees import bvh, tree_growth

KERNELS = str(bvh.__file__)


@pytest.fixture
def fresh() -> Iterator[Callable[..., str]]:
    def found(*files: str) -> str:
        made_by.cache_clear()
        return made_by(*files)

    yield found
    made_by.cache_clear()


def test_other_sources_have_another_hash(tmp_path: Path, fresh: Callable[..., str]) -> None:
    other = tmp_path / "maker.py"
    other.write_text("one = 1\n")
    found = [fresh(KERNELS), fresh(str(tree_growth.__file__)), fresh(KERNELS, str(other))]
    assert fresh(KERNELS, str(other)) == found[2]
    other.write_text("one = 2\n")
    found.append(fresh(KERNELS, str(other)))
    assert len(set(found)) == len(found)


def test_other_code_of_libraries_has_another_hash(monkeypatch: pytest.MonkeyPatch, fresh: Callable[..., str]) -> None:
    before = fresh(KERNELS)
    for owner, name, other in (
        (module, "number_code", lambda: "another processor or version"),
        (numba, "__version__", "0.0"),
        (numba.config, "DISABLE_JIT", not numba.config.DISABLE_JIT),
        # Numba compiles for another processor where the environment names one.
        (cpu_target.target_context.codegen(), "magic_tuple", lambda: ("x86_64", "another", "")),
    ):
        with monkeypatch.context() as patched:
            patched.setattr(owner, name, other)
            assert fresh(KERNELS) != before, name
    assert fresh(KERNELS) == before
