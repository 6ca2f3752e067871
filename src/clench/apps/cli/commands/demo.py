"""The demo: the whole way from a hand and an object to files and a simulated hold."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from clench.apps.cli.inputs.command_files import loadable
from clench.apps.cli.output.results import exit_code, print_json, write_results
from clench.core.exceptions import CommandError
from clench.core.pose import Pose
from clench.models.command import GraspCommand

if TYPE_CHECKING:
    from collections.abc import Callable

    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject

#: Pose of the built-in hand's palm for the built-in mug: around its wall, away from the handle.
MUG_POSE = Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5])
STEPS = 6


def run_demo(models: tuple[str, str], out: Path, seed: int | None, page: Path, json: bool) -> int:
    """Load, solve, draw, carry out and record; print what happened and where the files are.

    Args:
        models: of hand and object. out: folder for the files. seed: of a planned grasp. page: file for the page.
        json: print the solution as a document.

    Returns:
        0 when the hand grasps and the simulated hand reaches the computed angles, else 1.
    """
    import clench
    from clench.apps.cli.output.preshape_tables import print_posture_choice
    from clench.apps.cli.output.printing import print_closure, print_files, print_report, print_solution
    from clench.apps.pages.page_files import check_page
    from clench.core.files.json_files import check_folder
    from clench.kernels.runtime.warming import warm_up

    check_folder(out)
    check_page(page, out)
    hand_model, object_model = models
    if out.is_dir():
        clench.Record.check(out / "record.sqlite")
    warm_up(motions=True)
    with _progress() as step:
        step(f"Loading hand '{hand_model}' and object '{object_model}'")
        hand, obj = clench.Hand.load(hand_model), clench.GraspObject.load(object_model)
        step("Solving")
        command = choose_command(hand, obj, models, seed)
        # The first call of a process loads the compiled kernels; this one shows the time of a solve.
        solution = clench.solve(hand, obj, command)
        solution = replace(solution, hand_model=loadable(hand_model), object_model=loadable(object_model))
        solution = clench.execution.complete(solution, hand, obj)
        step("Drawing every finger in its curl planes, and the hand")
        files = [*write_results(hand, obj, command, solution, out), clench.write_page(page, hand, obj, solution)]
        step("Closing the simulated hand")
        report = clench.execute(solution, clench.SimulatedHand(hand, obj), force=True)
        report.save(out / "execution.json")
        step("Recording")
        with clench.Record(out / "record.sqlite") as record:
            record.append(solution)
    files += [out / "execution.json", out / "record.sqlite"]
    if json:
        print_json(solution.to_dict())
    else:
        print_solution(solution, [*hand.warnings, *obj.warnings], [])
        print_closure(solution, hand, obj)
        print_posture_choice(solution)
        print_report(report)
        print_files(files)
    return 0 if report.success and exit_code(solution, strict=False) == 0 else 1


def choose_command(hand: Hand, obj: GraspObject, models: tuple[str, str], seed: int | None) -> GraspCommand:
    """Return the command kept for the built-in hand and mug, else that of a planned grasp.

    Args:
        hand, obj: hand and object. models: their model names or paths.
        seed: of the planned grasp; None takes the built-in pose if there is one.

    Raises:
        CommandError: no grasp was found.
    """
    import clench

    if seed is None and models == ("robonaut2", "mug"):
        command = GraspCommand(hand_pose=MUG_POSE)
        clench.solve(hand, obj, command)
        return command
    plan = clench.plan_grasps(hand, obj, 1, seed=seed or 0, path=False)
    if not len(plan):
        raise CommandError(f"demo: {plan.text}")
    return replace(plan[0].command, seed=seed)


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
