"""The controller: three inputs in, one solution out; saved, loaded and recorded.

`clench.solve(hand, obj, command)` is both this package and the call: the package is callable, because importing
any of its modules binds the package to that name.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from clench.models.command import GraspCommand
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject

    from .record import Record
    from .solution import GraspSolution


class _CallablePackage(ModuleType):
    """Let the package be called as its one verb."""

    def __call__(
        self, hand: Hand, obj: GraspObject, command: GraspCommand, *, record: Record | None = None
    ) -> GraspSolution:
        """Compute contacts and joint angles; see `clench.solve.controller.solve`."""
        from .controller import solve

        return solve(hand, obj, command, record=record)


sys.modules[__name__].__class__ = _CallablePackage
