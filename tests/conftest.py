"""Shared fixtures: the folder of real hands and objects, and a solution written by hand."""

from __future__ import annotations

from pathlib import Path

import pytest

from clench.solve.solution import GraspSolution
from handmade import make_solution

SHARED = Path(__file__).parents[2] / "shared" / "data"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip, visibly, what needs the shared folder where it is absent."""
    if SHARED.is_dir():
        return
    for item in items:
        if item.get_closest_marker("shared"):
            item.add_marker(pytest.mark.skip(reason=f"needs {SHARED.parent.name}/{SHARED.name} beside the project"))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of real hands and objects."""
    return SHARED


@pytest.fixture
def solution() -> GraspSolution:
    """Return a small solution with every optional field in both forms."""
    return make_solution()
