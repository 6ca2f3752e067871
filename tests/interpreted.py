"""Let the kernels run as plain Python, so that coverage sees them and mistakes can be put into them.

A plugin: ``python -m pytest -p interpreted --at-most 10``. Only the kernels do: what else is compiled, like oracles,
stays fast, which NUMBA_DISABLE_JIT would not allow. Tests that take longer so are ended, and said to be skipped.
"""

import re
import signal
import sys
from collections.abc import Generator
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

from clench.kernels.runtime import compiling

OWN = tuple(str(Path(__file__).resolve().parents[1] / part) for part in ("src", "benchmarks", "tests"))
#: When it is looked again whether a test that takes too long can be ended [s].
LATER = 0.01


def _as_it_is(function: Any, **options: bool) -> Any:
    return function


_compiled_already = [n for n in sys.modules if re.match(r"clench\.kernels\.(?!runtime\b)", n)]
assert not _compiled_already, _compiled_already
compiling._compiled = _as_it_is


def pytest_addoption(parser: pytest.Parser) -> None:
    """Say how long a test may take."""
    parser.addoption("--at-most", type=float, default=0.0, help="skip what takes longer [s of processor time]")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None, Any, Any]:
    """End what a test needs where that takes too long."""
    return (yield from _ended(item))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, Any, Any]:
    """End a test that takes too long."""
    return (yield from _ended(item))


def _may_end(frame: FrameType | None) -> bool:
    """Say whether an error raised here does no harm.

    A library may be about to take or give back a lock, for which the test would wait without end; and what is raised
    while an oracle compiles may end the process.
    """
    if frame is None or not frame.f_code.co_filename.startswith(OWN):
        return False
    names = []
    while frame is not None:
        names.append(frame.f_code.co_filename)
        frame = frame.f_back
    return not any("llvmlite" in name or "numba" in name for name in names)


def _ended(item: pytest.Item) -> Generator[None, Any, Any]:
    seconds = item.config.getoption("--at-most")
    sentence = f"takes more than {seconds:g} s with kernels as Python"
    ended = []

    def end(_: int, frame: FrameType | None) -> None:
        if not _may_end(frame):
            signal.setitimer(signal.ITIMER_PROF, LATER)
            return
        ended.append(True)
        pytest.skip(sentence)

    before = signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        # Compiled kernels say nothing of numbers that are not finite.
        with np.errstate(all="ignore"):
            return (yield)
    except BaseException:
        # What generates examples makes an error of its own of it.
        if ended:
            pytest.skip(sentence)
        raise
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
