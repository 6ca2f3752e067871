"""The benchmark of commands: whole processes, from their start to their end, with kernels on disk and without."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

import clench
from clench.core.exceptions import CommandError
from clench.models.hand.hand import JointRole

from ..bench_options import Case
from ..bench_report import BenchReport, describe_place

#: Variables that name the folders of caches.
_CACHES: Final = ("NUMBA_CACHE_DIR", "CLENCH_CACHE_DIR")
#: Approach poses that are tried for a grasp.
_POSES: Final = 64
#: Exit codes of an answer, and of a command that a version does not have.
ANSWERED, MISSING = (0, 1), 2


#: The arguments of each process, by version and name.
Runs = Mapping[tuple[str, str], Sequence[str]]


class Ran(NamedTuple):
    """One process: its exit code, its standard output, processor time and time by the clock [s]."""

    code: int
    output: str
    processor: float
    wall: float


@dataclass(frozen=True)
class CommandBench:
    """How often each command runs, whether the first demo without any kernel on disk is timed, another Python."""

    passes: int
    cold: bool
    other: str | None
    seed: int


def bench_commands(case: Case, asked: CommandBench) -> BenchReport:
    """Run each command once untimed, check what it prints, then time all of them in turns.

    Args:
        case: hand and object. asked: see `CommandBench`.
    """
    report = BenchReport(values={"benchmark": "commands", **describe_place(), "passes": asked.passes})
    programs = {"": program_of(sys.executable)}
    if asked.other is not None:
        programs["other_"] = program_of(asked.other)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        commands = _commands(case, place / "command.json", asked.seed)
        runs: Runs = {
            (prefix, name): [program, *arguments]
            for prefix, program in programs.items()
            for name, arguments in commands.items()
        }
        runs = _checked(report, runs, place)
        if not report.errors:
            _time(report, runs, place, asked.passes)
            if asked.cold:
                _time_cold(report, programs, place)
    report.values["answers_right"] = not report.errors
    return report


def program_of(python: str) -> str:
    """Return the program `clench` of an environment.

    Raises:
        CommandError: there is none beside its Python.
    """
    found = shutil.which("clench", path=str(Path(python).parent))
    if found is None:
        raise CommandError(f"{python}: expected the program 'clench' beside it.")
    return found


def _commands(case: Case, file: Path, seed: int) -> Mapping[str, Sequence[str]]:
    """Return the arguments of each command, and write the command file of a grasp."""
    hand, obj = case.load()
    poses = clench.approach_poses(hand, obj, _POSES, seed)
    batch = clench.solve_batch(hand, obj, poses, clench.GraspCommand(hand_pose=poses[0], preshape="open"))
    best = int(np.argmax(batch.status == "grasp"))
    pose = {"position": list(map(float, poses[best].position)), "wxyz": list(map(float, poses[best].wxyz))}
    # Versions without named preshapes read this, too: a posture joint at its open angle, where there is one.
    opened = zip(hand.joints, map(float, hand.open_angles()), strict=True)
    posture = {joint.name: angle for joint, angle in opened if joint.role is JointRole.POSTURE}
    file.write_text(json.dumps({"hand_pose": pose, "preshape": dict(list(posture.items())[:1])}), encoding="utf-8")
    model = _anywhere(case.hand)
    which = ["--object", _anywhere(case.object), "--scale", str(case.scale), "--hand", model]
    solve = ["solve", *which, "--command", str(file)]
    return {
        "help": ["--help"],
        "hand": ["hand", model],
        "solve": solve,
        "solve_json": [*solve, "--json"],
        "plan": ["plan", *which, "--count", "1"],
        "demo": ["demo"],
    }


def _anywhere(model: str) -> str:
    """Return what names a model from every folder."""
    return str(Path(model).resolve()) if Path(model).is_file() else model


def _checked(report: BenchReport, runs: Runs, place: Path) -> Runs:
    """Return the runs that a version knows; add sentences about wrong answers."""
    known = dict[tuple[str, str], Sequence[str]]()
    for key, arguments in runs.items():
        ran = run(arguments, place)
        if key[0] and ran.code == MISSING:
            report.values["".join(key) + "_refused"] = True
            continue
        if ran.code not in ANSWERED or not ran.output.strip():
            report.errors.append(f"{''.join(key)}: ended with exit code {ran.code}.")
        elif key[1] == "solve_json" and not _is_solution(ran.output):
            report.errors.append(f"{''.join(key)}: printed no solution.")
        known[key] = arguments
    return known


def _is_solution(output: str) -> bool:
    try:
        document: dict[str, Any] = json.loads(output)
    except ValueError:
        return False
    return str(document.get("schema", "")).startswith("clench.solution/") and bool(document.get("joint_angles"))


def _time(report: BenchReport, runs: Runs, place: Path, passes: int) -> None:
    spent: dict[tuple[str, str], list[Ran]] = {key: [] for key in runs}
    for _ in range(passes):
        for key, arguments in runs.items():
            spent[key].append(run(arguments, place))
    for (prefix, name), ran in spent.items():
        report.values[f"{prefix}{name}_processor_s"] = float(np.median([r.processor for r in ran]))
        report.values[f"{prefix}{name}_s"] = float(np.median([r.wall for r in ran]))
        if prefix:
            pairs = zip(spent["", name], ran, strict=True)
            report.values[f"{name}_over_other"] = float(np.median([a.processor / b.processor for a, b in pairs]))


def _time_cold(report: BenchReport, programs: Mapping[str, str], place: Path) -> None:
    """Add the time of a demo that compiles all its kernels."""
    for prefix, program in programs.items():
        with tempfile.TemporaryDirectory() as caches:
            ran = run([program, "demo"], place, dict.fromkeys(_CACHES, caches))
        if ran.code not in ANSWERED:
            report.errors.append(f"{prefix}cold_demo: ended with exit code {ran.code}.")
        report.values |= {f"{prefix}cold_demo_processor_s": ran.processor, f"{prefix}cold_demo_s": ran.wall}


def run(arguments: Sequence[str], place: Path, more: Mapping[str, str] | None = None) -> Ran:
    """Run a program in a folder to its end; without `os.wait4`, on Windows, processor time is the clock's.

    Args:
        more: variables of its environment.
    """
    began = time.perf_counter()
    process = subprocess.Popen(
        arguments,
        cwd=place,
        env={**os.environ, **(more or {})},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        encoding="utf-8",
    )
    assert process.stdout is not None
    output = process.stdout.read()
    wait: Callable[[int, int], tuple[int, int, Any]] | None = getattr(os, "wait4", None)
    if wait is None:
        code, wall = process.wait(), time.perf_counter() - began
        return Ran(code, output, wall, wall)
    _, status, used = wait(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return Ran(process.returncode, output, used.ru_utime + used.ru_stime, time.perf_counter() - began)
