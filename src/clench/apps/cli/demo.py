"""The demo: the whole way from a hand and an object to files and a simulated hold."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from clench.models.command import GraspCommand
from clench.solve.solution import FingerStatus, GraspSolution, SolutionStatus

from .commands import exit_code, loadable
from .results import make_folder, print_json, write_results

if TYPE_CHECKING:
    from collections.abc import Callable

    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject

#: How many approach poses are tried.
TRIES = 24
STEPS = 5


def run_demo(hand_model: str, object_model: str, out: Path, seed: int, json: bool) -> int:
    """Load, solve, draw, carry out and record; print what happened and where the files are.

    Returns:
        0 when the hand grasps and the simulated hand reaches the computed angles, else 1.
    """
    import clench

    from .printing import print_report, print_solution

    make_folder(out)
    with _progress() as step:
        step(f"Loading hand '{hand_model}' and object '{object_model}'")
        hand, obj = clench.Hand.load(hand_model), clench.GraspObject.load(object_model)
        step(f"Solving {TRIES} approach poses")
        command, solution = best_of(hand, obj, seed)
        solution = replace(solution, hand_model=loadable(hand_model), object_model=loadable(object_model))
        step("Drawing")
        files = write_results(hand, obj, command, solution, out)
        step("Closing the simulated hand")
        report = clench.execute(solution, clench.SimulatedHand(hand, obj), force=True)
        report.save(out / "execution.json")
        step("Recording")
        with clench.Record(out / "record.db") as record:
            record.append(solution)
    files += [out / "execution.json", out / "record.db"]
    if json:
        print_json(solution.to_dict())
    else:
        print_report(report)
        print_solution(solution, [*hand.warnings, *obj.warnings], files)
    return 0 if report.success and exit_code(solution, strict=False) == 0 else 1


def best_of(hand: Hand, obj: GraspObject, seed: int) -> tuple[GraspCommand, GraspSolution]:
    """Solve a few approach poses and return the best: grasps first, then those with most touching fingers."""
    import clench

    solved = []
    for pose in clench.approach_poses(hand, obj, TRIES, seed):
        command = GraspCommand(hand_pose=pose, seed=seed)
        solved.append((command, clench.solve(hand, obj, command)))
    return max(solved, key=lambda pair: _merit(pair[1]))


def _merit(solution: GraspSolution) -> tuple[bool, bool, int, float]:
    touching = sum(f.status is FingerStatus.TOUCH for f in solution.fingers.values())
    grasp = solution.status is SolutionStatus.GRASP
    return grasp, solution.is_valid(), touching, -(solution.max_penetration or 0.0)


@contextmanager
def _progress() -> Iterator[Callable[[str], None]]:
    """Show a bar on standard error; the function that is given names the next step."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=Console(stderr=True)) as progress:
        task = progress.add_task("", total=STEPS)
        started = False

        def step(description: str) -> None:
            nonlocal started
            progress.update(task, description=description, advance=1 if started else 0)
            started = True

        yield step
        progress.update(task, description="Done", completed=STEPS)
