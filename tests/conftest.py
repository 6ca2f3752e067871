"""Shared fixtures: the folder of real hands and objects, and a solution written by hand."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from clench.kernels.runtime.warming import warm_up
from clench.solver.solution import GraspSolution
from handmade import make_solution
from mug_grasp import MugGrasp, make_mug_grasp

# Tests make their hands, so that no test meets what another one made with patched code.
os.environ.setdefault("CLENCH_HAND_CACHE", "0")

SHARED = Path(__file__).parents[2] / "shared" / "data"

#: Files of half a minute and more, the longest first: one worker would still be busy with them while the other has
#: nothing left to do.
LONGEST = (
    "test_hostile_files.py",
    "test_guides.py",
    "test_ros2.py",
    "test_listed_sweep.py",
    "test_symbols.py",
    "test_cuda_closing.py",
    "test_viewer_page.py",
    "test_generating.py",
    "test_hull_sweep.py",
    "test_examples.py",
    "test_kernel_cache.py",
    "test_readme.py",
    "test_exported_files.py",
    "test_plan_grasps.py",
    "test_engine.py",
    "test_figures.py",
    "test_against_oracle.py",
    "test_fuzz.py",
    "test_invariance.py",
    "test_width.py",
)


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile what a solve calls once, before there are workers: each of them would do so, all at the same time."""
    if session.config.getoption("dist", "no") != "no" and not hasattr(session.config, "workerinput"):
        warm_up(motions=True)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with what takes longest; skip, visibly, what needs the shared folder where it is absent."""
    order = {name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: order.get(item.path.name, len(order)))
    if SHARED.is_dir():
        return
    for item in items:
        if item.get_closest_marker("shared"):
            item.add_marker(pytest.mark.skip(reason=f"needs {SHARED.parent.name}/{SHARED.name} beside the project"))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of real hands and objects."""
    return SHARED


@pytest.fixture(scope="session")
def mug_grasp() -> MugGrasp:
    """Return the grasp that tests of pictures, pages and scene files show."""
    return make_mug_grasp()


@pytest.fixture
def solution() -> GraspSolution:
    """Return a small solution with every optional field in both forms."""
    return make_solution()
