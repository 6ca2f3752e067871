"""Compile the kernels of a solve ahead of it, in as many processes as there are cores.

The processes take the kernels below one after another, and share what these call (`claims.py`). Nothing depends on the
other processes: kernels that they do not deliver are compiled when they are called.
"""

from __future__ import annotations

import gc
import inspect
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clench.kernels.closing.close_candidate import close_candidate
from clench.kernels.closing.contact_reading import PalmContactArrays, SurfaceArrays, read_contacts
from clench.kernels.closing.first_meetings import find_first_meetings
from clench.kernels.closing.in_turn import close_in_turn
from clench.kernels.closing.layout import (
    CandidateArrays,
    ChainArrays,
    ClosingArrays,
    HandArrays,
    OutlineArrays,
    RoundArrays,
    SectionArrays,
    Work,
)
from clench.kernels.closing.settling import settle_pair
from clench.kernels.closing.solve_layout import (
    Arena,
    Closed,
    Closing,
    CommandArrays,
    ObjectArrays,
    ProblemArrays,
    Solved,
    Workspace,
)
from clench.kernels.closing.solve_poses import make_workspace, solve_poses
from clench.kernels.closing.verdict import judge_pose
from clench.kernels.geometry.bodies import pack_triangles
from clench.kernels.geometry.link_frames import FrameArrays, place_links, relate_poses
from clench.kernels.geometry.link_meshes import DepthWork, LinkMeshArrays, ObjectMesh, measure_depths
from clench.kernels.geometry.smallest_gap import smallest_gap
from clench.kernels.meetings.at_once import close_at_once
from clench.kernels.meetings.meeting_layout import FingerLinks, Meetings, MeetingWork
from clench.kernels.meetings.meeting_search import look_at
from clench.kernels.sections.advance import advance
from clench.kernels.sections.plane_contact import describe_contact, settle_contact
from clench.kernels.sections.plane_sections import cut_first_axis_groups
from clench.kernels.toi.full_width import planes_only
from clench.kernels.toi.toi_links import Stage, sweep_stage
from clench.kernels.toi.toi_work import SweepWork
from clench.kernels.trees.bvh import MeshTree, build_tree, feature_owners
from clench.kernels.trees.connectivity import connected_parts

from .by_reference import by_reference, kept, type_of
from .claims import CLAIMS
from .compiling import is_kept
from .kernel_compiler import claim_of

#: What the processes compile, in this order: long ones first, and what others need before these. The last ones are
#: short and need no other, so that both of two processes have work while `solve_poses` compiles.
JOBS: tuple[Any, ...] = (
    sweep_stage,
    cut_first_axis_groups,
    advance,
    judge_pose,
    look_at,
    close_at_once,
    make_workspace,
    settle_contact,
    settle_pair,
    close_candidate,
    measure_depths,
    smallest_gap,
    close_in_turn,
    solve_poses,
    read_contacts,
    describe_contact,
    relate_poses,
    place_links,
    find_first_meetings,
)

#: These have an entry from Python, but in a solve other kernels call them, or Python hands them pointers.
_BY_POINTER: tuple[Any, ...] = (cut_first_axis_groups, close_candidate, place_links)

#: So many jobs at the end are the short ones that need no other.
TAIL = 4
#: Another process is given up after this long [s].
PATIENCE = 300.0
#: More processes than these wait for each other most of the time.
MOST_PROCESSES = 4

#: What this process has compiled or found on disk: the kernels of a solve (False), and of motions (True).
_WARM: set[bool] = set()
_ONE_AT_A_TIME = threading.Lock()
_MODULE = "clench.kernels.runtime.warming"
_TYPES: dict[str, Any] = {"f": np.float64, "i": np.int64, "s": np.int32, "b": np.uint8}


class Job(NamedTuple):
    """Kernels that one process compiles.

    Args:
        name: the same in all processes. do: compiles them.
    """

    name: str
    do: Callable[[], object]


def warm_up(*, motions: bool = False) -> None:
    """Compile what a solve calls where none of it has been compiled before, and say so; else do nothing.

    Args:
        motions: forces and motions follow the solve; compile what these call, too.
    """
    with _ONE_AT_A_TIME:
        if motions not in _WARM:
            _WARM.update((False, motions))
            if _is_cold(motions) and _is_first_process():
                _compile_together(motions)


def _compile_together(motions: bool) -> None:
    """Compile all jobs, in several processes that share them."""
    sys.stderr.write("clench: compiling its kernels, once on this machine; this takes one to two minutes.\n")
    with tempfile.TemporaryDirectory(prefix="clench-") as folder:
        others = _others(min(os.cpu_count() or 1, MOST_PROCESSES) - 1, [folder, *["motions"] * motions])
        CLAIMS.share(Path(folder), lambda: all(other.poll() in (None, 0) for other in others))
        try:
            jobs = _jobs(motions)
            with _bar(len(jobs)) as show:
                for done in _jobs_done(jobs):
                    show(done)
            for other in others:
                other.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            pass
        finally:
            CLAIMS.share(None)
            for other in others:
                other.kill()
                other.wait()


def _is_first_process() -> bool:
    """Say whether this process is no worker of another one."""
    import multiprocessing  # where all kernels are on disk, nothing else needs it

    return multiprocessing.parent_process() is None


def _others(count: int, words: list[str]) -> list[subprocess.Popen[bytes]]:
    """Start processes that take jobs, too.

    There are none in a program that contains Python: `sys.executable` would start that program again.

    Args:
        count: of processes. words: the folder for their claims, and `motions` where these are wanted.
    """
    if not Path(sys.executable or "").name.lower().startswith("python"):
        return []
    quiet = subprocess.DEVNULL
    command = [sys.executable, "-m", _MODULE, *words]
    try:
        return [subprocess.Popen(command, stdin=quiet, stdout=quiet, stderr=quiet) for _ in range(count)]
    except OSError:
        return []


def _jobs(motions: bool) -> list[Job]:
    """Return what there is to compile."""
    values = sample_values()
    jobs = [_job(kernel, values) for kernel in JOBS]
    jobs.insert(1, Job("trees", pack_one_triangle))
    if motions:
        from .motion_samples import MOTIONS, motion_values

        values |= motion_values(values)
        jobs[-TAIL:-TAIL] = [_job(kernel, values) for kernel in MOTIONS]
    return jobs


def _job(kernel: Any, values: dict[str, Any]) -> Job:
    kinds = argument_types(kernel, values)
    return Job(claim_of(kernel, kinds), partial(kernel.compile, kinds))


def pack_one_triangle() -> None:
    """Compile the kernels of trees: pack the least that every one of them is called for."""
    tree = build_tree(np.eye(3), np.arange(3)[None])
    pack_triangles(tree)
    feature_owners(tree)
    connected_parts(np.zeros((1, 2), dtype=np.int64), 1)


def _jobs_done(jobs: list[Job]) -> Iterator[int]:
    """Compile the jobs that no other process has taken; give after each how many are done, by any process."""
    for job in jobs:
        if CLAIMS.take_job(job.name):
            job.do()
            CLAIMS.note_done(job.name)
        yield CLAIMS.count_done()


@contextmanager
def _bar(total: int) -> Iterator[Callable[[int], None]]:
    """Show a bar on standard error; the function that is given moves it."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True, refresh_per_second=2) as progress:
        task = progress.add_task("Compiling", total=total)
        yield lambda done: progress.update(task, completed=done)


def compile_ahead(kernels: Iterable[Any]) -> None:
    """Compile kernels for the arrays that a solve hands them, or load them from the cache."""
    values = sample_values()
    for kernel in kernels:
        kernel.compile(argument_types(kernel, values))


def argument_types(kernel: Any, values: dict[str, Any]) -> tuple[Any, ...]:
    """Return the types of a kernel's arguments, which its parameters' names tell."""
    kinds = (type_of(values[name]) for name in inspect.signature(kernel.py_func).parameters)
    return tuple(map(by_reference, kinds) if is_inner(kernel) or kernel in _BY_POINTER else kinds)


def is_inner(kernel: Any) -> bool:
    """Say whether only other kernels call a kernel."""
    return bool(kernel.targetoptions.get("no_cpython_wrapper"))


def sample_values() -> dict[str, Any]:
    """Return a value of the right type for every parameter of the kernels above, by name; arrays are empty."""
    chain = ChainArrays(*_arrays("i1 i1 f2 f1 f1 f1 f1 f1 i1"))
    outlines = OutlineArrays(*_arrays("i1 i1 f1 i1 f2 i1 f2 i1 f2"))
    hand: tuple[Any, ...] = (*_arrays("i1 i1"), chain, outlines, *_arrays("f3 i1 f1 f1 f1 i1"))
    sections = SectionArrays(*_arrays("f3 i2 f3 i2 f3 i2 i2 f3"))
    tree = MeshTree(*_arrays("f2 s2 f2 s1 s1 f2 f2 s1 s1 s1 s1 f2"))
    values: dict[str, Any] = {
        "hand": HandArrays(*hand),
        "rounds": RoundArrays(*_arrays("i1 f2 f3")),
        "candidates": CandidateArrays(*_arrays("i1 i1 i1 f2")),
        "answer": ClosingArrays(*_arrays("f2 f2 i1 i3 f3 f4 i1 i1 i1")),
        "full_width": planes_only(0, 0),
        "chain": chain,
        "sweep": SweepWork(
            *_arrays("f2 f2 f2 f2 f2 f2 f2 f2 f3 f2 i1 i2 f1 f1 f2 f1 f2 f2 f2 f2 f2 i1 f1 i1 f2 f1 i1 i1 i1 i1 i1")
        ),
        "work": Work(*_arrays("f2 f2 f1 f2 f2 f2 f2 f2 f1 f1 f1 i1 f3 i1")),
    }
    values |= {"links": values["full_width"].links, "target": values["full_width"].object}
    values["frames"] = FrameArrays(*_arrays("i1 i1 f3 f2 f2 f1 i1 f1 f1 f1 i1 i1 f1 f1 f2 i1 i1 f1 i1"))
    owners = _arrays("b1")[0]
    values["meshes"] = LinkMeshArrays(*[*_arrays("i1 i1 f2 f1 i1 f2 i1 i1 i1 i1"), tree, owners])
    values["solid"] = ObjectMesh(tree, owners, True, _arrays("f2")[0])
    values["mesh"] = values["solid"]
    values["surface"] = SurfaceArrays(*[*_arrays("f2 s1"), values["rounds"], *_arrays("s1 s1 i1")])
    values["palm_contacts"] = PalmContactArrays(*_arrays("i3 f3"))
    values |= dict.fromkeys(("sections", "shared", "own"), sections)
    values["tree"] = tree
    values |= dict.fromkeys(("closed", "together"), True)
    values |= dict.fromkeys(
        ("axis_group", "start", "base", "times", "dof", "plane", "finger_posture", "i", "n", "p"), 0
    )
    values |= _solve_values(values)
    kinds = {
        "f1": ("turns", "rates", "point", "q"),
        "f2": ("T_palm_object", "first", "second", "out", "postures"),
        "i1": ("overlaps", "contact", "which", "blocked", "anew", "chosen"),
        "f3": ("poses", "placed", "two", "axis_groups"),
    }
    for kind, names in kinds.items():
        values |= dict.fromkeys(names, _arrays(kind)[0])
    poses, turns, T = _arrays("f3 f1 f2")
    names = ("hand", "full_width", "obj", "candidates", "work", "sweep", "answer")
    held = {name: kept(values[name]) for name in names}
    values["closing"] = Closing(T_palm_object=T, shared=sections, own=sections, **held)
    values["stage"] = Stage(held["full_width"], kept(chain), 0, poses, T, turns, turns, 0.0)
    values |= dict.fromkeys(("planes", "finger_postures"), (0, 0))
    return {**values, "length": 0.0, "best": 0.0, "touch": 0.0}


def _solve_values(values: dict[str, Any]) -> dict[str, Any]:
    """Return values of the arguments of `solve_poses`, and of its scratch space."""
    target = ObjectArrays(values["tree"], values["rounds"], True, values["full_width"].object)
    counts: list[Any] = [*_arrays("f1 f3 i1 i1 i2 i2 i2 i1 i1 i1 f1 i1 i1"), 0.0, 0, *[True] * 5, 0, True]
    parts: list[Any] = [values[name] for name in ("hand", "full_width", "candidates")]
    parts += [target, target, *(values[name] for name in ("frames", "surface", "mesh", "meshes")), *_arrays("i2 i2")]
    answers = ClosingArrays(*_arrays("f3 f3 i2 i4 f4 f5 i2 i2 i2"))
    command, fingers = CommandArrays(*counts), FingerLinks(*_arrays("i1 i1 i1 f2 f1 i2"))
    parts += [command, fingers]
    arena, closed = Arena(*[values["sections"]] * 4), [answers, *_arrays("i2 i2 i1"), answers, *_arrays("i2 i2")]
    closed += [Meetings(*_arrays("i2 i3 f3")), *_arrays("i1")]
    written: list[Any] = [values["work"], values["sweep"], DepthWork(*_arrays("f1 s1 f3 f2 s2 f2")), values["answer"]]
    written += [values["candidates"], *_arrays("i1 f4 f1 f1 f1 f3"), values["palm_contacts"], *_arrays("i1")]
    written.append(meeting := MeetingWork(*_arrays("f2 f1 f1 f1 f1 f1 f2 f2 i2 f1 f2 f1 f3 f1")))
    return {
        "obj": target,
        "problem": kept(ProblemArrays(*parts)),
        "command": command,
        "fingers": fingers,
        "workspace": meeting,
        "arena": kept(arena),
        "space": Workspace(arena, *written),
        "found": Closed(*closed),
        "final": values["answer"],
        "solved": Solved(*_arrays("f2 i1 i1 i2 i2 i2 i4 f4")),
        "T_palm_objects": _arrays("f3")[0],
        "stages": 0,
        "nested": True,
    }


def _arrays(kinds: str) -> list[Any]:
    """Return empty arrays, each given by a letter for its numbers and how many axes it has."""
    return [np.empty((0,) * int(kind[1]), dtype=_TYPES[kind[0]]) for kind in kinds.split()]


def _is_cold(motions: bool) -> bool:
    """Say whether the cache on disk lacks the kernel of every solve, or of every motion that is checked."""
    if motions:
        from .motion_samples import MOTIONS

        return not is_kept(solve_poses) or not all(map(is_kept, MOTIONS))
    return not is_kept(solve_poses)


if __name__ == "__main__":
    gc.disable()  # The process ends soon.
    CLAIMS.share(Path(sys.argv[1]))
    for _ in _jobs_done(_jobs("motions" in sys.argv)):
        pass
    os._exit(0)  # Nothing is left to write; to take the interpreter apart takes half a second.
