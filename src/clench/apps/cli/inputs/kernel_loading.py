"""Compile and load kernels ahead of a solve, so that its time is that of computing."""

from __future__ import annotations


def compile_kernels() -> None:
    """Compile the kernels that every solve calls, unless they are on disk, and say so."""
    from clench.kernels.runtime.warming import warm_up

    warm_up()


def load_kernels() -> None:
    """Load the kernels that a solve calls from disk, or compile them."""
    from clench.kernels.closing.solve_poses import solve_poses
    from clench.kernels.geometry.link_frames import place_links, relate_poses
    from clench.kernels.runtime.warming import compile_ahead

    compile_ahead((relate_poses, place_links, solve_poses))
