"""The report of a benchmark: flat keys and values, and the machine of the measurement."""

from __future__ import annotations

import os
import platform
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

Value = str | int | float | bool


@dataclass
class BenchReport:
    """Collect flat keys and values, in the order of printing; `errors` are sentences about wrong answers."""

    values: dict[str, Value] = field(default_factory=dict)
    errors: list[str] = field(default_factory=list)

    def lines(self) -> Iterator[str]:
        """Yield `key value` lines; numbers with five digits."""
        for key, value in self.values.items():
            yield f"{key} {value:.5g}" if isinstance(value, float) else f"{key} {value}"

    def distribution(self, key: str, seconds: Sequence[float]) -> None:
        """Add median, 90 %, 99 % and largest of times [s], in milliseconds."""
        milliseconds = np.asarray(seconds) * 1e3
        for name, percent in (("median", 50), ("p90", 90), ("p99", 99), ("max", 100)):
            self.values[f"{key}_{name}_ms"] = float(np.percentile(milliseconds, percent))


def describe_place() -> dict[str, Value]:
    """Return what a number depends on besides the code's input: commit, versions, hardware."""
    from clench import __version__

    packages = {f"{name}_version": _version(name) for name in ("numpy", "numba", "scipy", "mujoco")}
    return {
        "clench_version": __version__,
        "commit": _commit(),
        "python_version": platform.python_version(),
        **packages,
        "system": f"{platform.system()} {platform.machine()}",
        "processor": _processor(),
        "cores": os.cpu_count() or 0,
    }


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"


def _commit() -> str:
    """Return the commit of this source, with `+changes` when files differ from it; `unknown` outside its repository."""
    source = Path(__file__)

    def git(*arguments: str) -> str:
        run = subprocess.run(["git", *arguments], cwd=source.parent, capture_output=True, text=True, check=True)
        return run.stdout.strip()

    try:
        # An installed copy may lie inside a repository of something else.
        git("ls-files", "--error-unmatch", source.name)
        return git("rev-parse", "--short=12", "HEAD") + ("+changes" if git("status", "--porcelain") else "")
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or "unknown"


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """Return what a call returns, and how long it took [s]."""
    start = time.perf_counter()
    result = call()
    return result, time.perf_counter() - start
