"""Compile and load kernels ahead of a solve, so that its time is that of computing."""

from __future__ import annotations

from clench.models.command import ClosingOrder, GraspCommand


def compile_kernels() -> None:
    """Compile what any solve calls, where it is not on disk, and say so."""
    from clench.kernels.warming import announce, warm_up

    announce()
    warm_up()


def load_kernels(command: GraspCommand) -> None:
    """Load from disk what the solve of a command calls, or compile it.

    A solve calls one large kernel where joints close one after another, and others where they close in another order.
    These are loaded when they are called.
    """
    from clench.kernels.batch_solving import solve_poses
    from clench.kernels.frames import place_links, relate_poses
    from clench.kernels.warming import compile_ahead

    if command.order == ClosingOrder.PROXIMAL_FIRST and command.rounds == 1 and not command.check_sets:
        compile_ahead((relate_poses, place_links, solve_poses))
