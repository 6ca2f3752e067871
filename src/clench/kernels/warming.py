"""Compile the kernels of a solve ahead of it, in two processes at once.

A first solve compiles for most of a minute, one kernel after another. Half of it is the closing, so a second process
compiles that into the cache on disk, from where this one loads it. Nothing depends on the second process: what it does
not deliver is compiled when it is called.
"""

from __future__ import annotations

import inspect
import os
import subprocess
import sys
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

import numba
import numpy as np

from .advance import advance
from .closing import close_items
from .exact import planes_only
from .family_section import cut_first_families
from .frames import FrameArrays, place_links, relate_poses
from .layout import (
    ChainArrays,
    ClosingArrays,
    HandArrays,
    ItemArrays,
    OutlineArrays,
    RoundArrays,
    SectionArrays,
    Work,
)
from .link_meshes import LinkMeshArrays, ObjectMesh, find_contained, measure_depths
from .nearness import smallest_gap
from .overlap import find_overlaps
from .settling import settle_pair
from .stage_sweep import sweep_stage
from .sweeping import SweepWork
from .touches import SurfaceArrays, TouchArrays, read_touches
from .touching import describe_hit, settle_hit
from .tree import MeshTree, build_tree

#: What each process compiles, in this order. What both need, like the cutting of sections, is first in one of them
#: and late in the other.
HERE: tuple[Any, ...] = (
    cut_first_families,
    sweep_stage,
    settle_pair,
    settle_hit,
    describe_hit,
    find_overlaps,
    smallest_gap,
    relate_poses,
    place_links,
    measure_depths,
    find_contained,
    read_touches,
)
THERE: tuple[Any, ...] = (advance, close_items)

#: The second process is given up after this long [s].
PATIENCE = 300.0

_MODULE = "clench.kernels.warming"
_TYPES: dict[str, Any] = {"f": np.float64, "i": np.int64, "s": np.int32, "b": np.uint8}


def warm_up() -> None:
    """Compile what a solve calls where none of it has been compiled before; else do nothing."""
    if (os.cpu_count() or 1) < 2 or not _is_cold():
        return
    quiet = subprocess.DEVNULL
    try:
        other = subprocess.Popen([sys.executable, "-m", _MODULE], stdin=quiet, stdout=quiet, stderr=quiet)
    except OSError:
        return
    try:
        build_tree(np.zeros((1, 3)), np.zeros((1, 3)))
        compile_ahead(HERE)
        other.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        pass
    finally:
        other.kill()
        other.wait()


def compile_ahead(kernels: Iterable[Any]) -> None:
    """Compile kernels for the arrays that a solve hands them, or load them from the cache."""
    values = sample_values()
    for kernel in kernels:
        kernel.compile(argument_types(kernel, values))


def argument_types(kernel: Any, values: dict[str, Any]) -> tuple[Any, ...]:
    """Return the types of a kernel's arguments, which its parameters' names tell."""
    typeof: Any = numba.typeof
    return tuple(typeof(values[name]) for name in inspect.signature(kernel.py_func).parameters)


def sample_values() -> dict[str, Any]:
    """Return a value of the right type for every parameter of the kernels above, by name; arrays are empty."""
    chain = ChainArrays(*_arrays("i1 i1 f2 f1 f1 f1 f1 f1 i1"))
    outlines = OutlineArrays(*_arrays("i1 i1 f1 i1 f2 i1 f2 i1 f2"))
    hand: tuple[Any, ...] = (*_arrays("i1 i1"), chain, outlines, *_arrays("f3 i1 f1 f1 f1 i1"))
    sections = SectionArrays(*_arrays("f3 i2 f3 i2 f3 i2 i2"))
    tree = MeshTree(*_arrays("f2 s2 f2 s1 s1 f2 f2 s1 s1 s1 s1"))
    values: dict[str, Any] = {
        "hand": HandArrays(*hand),
        "rounds": RoundArrays(*_arrays("i1 f2 f3")),
        "items": ItemArrays(*_arrays("i1 i1 i1 f2")),
        "answer": ClosingArrays(*_arrays("f2 f2 i1 i3 f3 f4 i1 i1 i1")),
        "exact": planes_only(0, 0),
        "chain": chain,
        "sweep": SweepWork(*_arrays("f2 f2 f2 f2 f2 f2 f2 f2 f3 f2 i1 i2 f1 f1 f1 i1 i1 i1")),
        "work": Work(*_arrays("f2 f2 f1 f2 f2 f2 f2 f2 f1 f1 f1 i1 f3 i1")),
    }
    values |= {"links": values["exact"].links, "target": values["exact"].object}
    values["frames"] = FrameArrays(*_arrays("i1 i1 f3 f2 f2 f1 i1 f1 f1 f1 i1 i1 f1 f1 f2 i1 i1"))
    owners = _arrays("b1")[0]
    values["meshes"] = LinkMeshArrays(*[*_arrays("i1 i1 f2 f1 i1 f2 i1 i1 i1"), tree, owners])
    values["solid"] = ObjectMesh(tree, owners, True, _arrays("f2")[0])
    values["surface"] = SurfaceArrays(*[*_arrays("f2 s1"), values["rounds"], *_arrays("s1 s1 i1")])
    values["touches"] = TouchArrays(*_arrays("i3 f3"))
    values |= dict.fromkeys(("sections", "shared", "own"), sections)
    values["tree"] = tree
    values |= dict.fromkeys(("closed", "together"), True)
    values |= dict.fromkeys(("family", "start", "base", "low", "high", "times", "group", "plane", "entry"), 0)
    kinds = {
        "f1": ("turns", "rates", "point", "q"),
        "f2": ("T_palm_object", "first", "second", "out", "postures"),
        "i1": ("overlaps", "hit", "wanted"),
        "f3": ("poses", "placed", "scratch", "families"),
    }
    for kind, names in kinds.items():
        values |= dict.fromkeys(names, _arrays(kind)[0])
    return {**values, "length": 0.0, "best": 0.0, "touch": 0.0}


def _arrays(kinds: str) -> list[Any]:
    """Return empty arrays, each given by a letter for its numbers and how many axes it has."""
    return [np.empty((0,) * int(kind[1]), dtype=_TYPES[kind[0]]) for kind in kinds.split()]


@cache
def announce(batch: bool = False) -> None:
    """Say on standard error that what comes compiles, where it does; once per process.

    Args:
        batch: the kernels of a batch are asked for, too.
    """
    if _is_cold():
        sys.stderr.write("clench: compiling its kernels, once on this machine; this takes one to two minutes.\n")
    if batch:
        from .batch_solving import solve_poses

        if _is_cold(solve_poses):
            sys.stderr.write("clench: compiling the kernels of a batch, once on this machine; about a minute more.\n")


def _is_cold(kernel: Any = close_items) -> bool:
    """Say whether the cache on disk has no closing yet; never where NUMBA_DISABLE_JIT leaves functions as they are."""
    stats = getattr(kernel, "stats", None)
    if stats is None:
        return False
    function = kernel.py_func
    name = f"{function.__module__.rpartition('.')[2]}.{function.__name__}"
    return not any(Path(stats.cache_path).glob(f"{name}-*.nbi"))


if __name__ == "__main__":
    compile_ahead(THERE)
