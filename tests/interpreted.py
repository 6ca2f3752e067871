"""Let the kernels run as plain Python, so that coverage sees them and mistakes can be put into them.

A plugin: ``python -m pytest -p interpreted --at-most 10``. Only the kernels do: what else is compiled, like oracles,
stays fast, which NUMBA_DISABLE_JIT would not allow. Tests that take longer so are ended, and said to be skipped.
"""

import signal
import sys
from collections.abc import Generator
from types import FrameType
from typing import Any

import numpy as np
import pytest

from clench.kernels import compiling

#: When it is looked again whether a test that takes too long can be ended [s].
LATER = 0.1


def _as_it_is(function: Any, **options: bool) -> Any:
    return function


_compiled_already = [n for n in sys.modules if n.startswith("clench.kernels.") and n != compiling.__name__]
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


def _ended(item: pytest.Item) -> Generator[None, Any, Any]:
    seconds = item.config.getoption("--at-most")
    sentence = f"takes more than {seconds:g} s with kernels as Python"
    ended = []

    def end(_: int, frame: FrameType | None) -> None:
        # What is raised while an oracle compiles may end the process: a little later it will have.
        while frame is not None:
            if "llvmlite" in frame.f_code.co_filename or "numba" in frame.f_code.co_filename:
                signal.setitimer(signal.ITIMER_PROF, LATER)
                return
            frame = frame.f_back
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
