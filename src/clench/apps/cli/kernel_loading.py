"""Compile and load kernels ahead of a solve, so that its time is that of computing."""

from __future__ import annotations


def compile_kernels() -> None:
    """Compile what any solve calls, where it is not on disk, and say so."""
    from clench.kernels.runtime.warming import announce, warm_up

    announce()
    warm_up()


def load_kernels() -> None:
    """Load from disk what a solve calls, or compile it."""
    from clench.kernels.closing.solve_poses import solve_poses
    from clench.kernels.geometry.link_frames import place_links, relate_poses
    from clench.kernels.runtime.warming import compile_ahead

    compile_ahead((relate_poses, place_links, solve_poses))
