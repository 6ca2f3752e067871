"""Carry a solution out on whatever moves a hand."""

from __future__ import annotations

from typing import Protocol

from clench.base.errors import CommandError
from clench.models.hand.hand import Hand
from clench.solve.solution import GraspSolution

from .report import ExecutionReport
from .trajectory import Trajectory, plan_trajectory


class Actuator(Protocol):
    """Move a hand along a trajectory and report what was reached."""

    @property
    def name(self) -> str:
        """Name of the actuator, for reports."""

    @property
    def hand(self) -> Hand:
        """The hand that it moves."""

    def carry_out(self, solution: GraspSolution, trajectory: Trajectory) -> ExecutionReport:
        """Open the hand, follow the trajectory to the touch, and compare with the solution."""


def execute(solution: GraspSolution, actuator: Actuator, *, speed: float = 1.0, force: bool = False) -> ExecutionReport:
    """Carry out a solution: open, close along the computed path, all fingers arriving together.

    A solution that is not valid is not carried out; the report says why.

    Args:
        solution: what to carry out.
        actuator: what moves the hand, e.g. `SimulatedHand`.
        speed: fraction of the joints' velocity limits to use, above 0 and up to 1.
        force: carry it out although it is not valid.

    Raises:
        CommandError: the solution is for another hand, or `speed` is out of range.
    """
    if solution.hand != actuator.hand.name:
        raise CommandError(f"The solution is for hand '{solution.hand}', the actuator moves '{actuator.hand.name}'.")
    trajectory = plan_trajectory(solution, actuator.hand, speed=speed)
    if not (force or solution.is_valid()):
        found = solution.violations()
        why = found[0] if found else f"its status is '{solution.status.value}'"
        return ExecutionReport(actuator.name, success=False, reason=f"Not carried out: {why.rstrip('.')}.")
    return actuator.carry_out(solution, trajectory)
