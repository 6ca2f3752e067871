"""`clench solve`: solve one grasp, and print it, draw it, or write it to files."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clench.apps.cli.inputs.choices import Order, Source
from clench.apps.cli.inputs.command_files import loadable, read_command
from clench.apps.cli.inputs.scene_options import with_scene
from clench.apps.cli.parsing import as_range

if TYPE_CHECKING:
    from clench.models.command import GraspCommand
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject
    from clench.planner.grasp_plan import GraspPlan, PlannedGrasp
    from clench.solver.solution import GraspSolution


def solve(
    *,
    hand: str,
    object: str,
    command: Path | None = None,
    hand_file: Path | None = None,
    palm: str | None = None,
    scale: float = 1.0,
    table: tuple[float, ...] | None = None,
    obstacle: tuple[str, ...] = (),
    collision_source: Source | None = None,
    planes: int | None = None,
    order: tuple[Order, ...] = (),
    criteria: str | None = None,
    seed: int = 0,
    out: Path | None = None,
    html: Path | None = None,
    record: Path | None = None,
    pose_error: tuple[float, float] | None = None,
    explain: bool = False,
    forces: bool = False,
    mass: tuple[float, ...] = (),
    friction: tuple[float, ...] = (),
    strict: bool = False,
    json: bool = False,
) -> int:
    """Compute contacts and joint angles for one hand, object and command.

    Args:
        hand: built-in name, path to a .urdf or .xml file, or a name that clench[hands] finds (docs/own-hand.md).
        object: built-in name, path to a mesh, or a shape such as cylinder:r=0.03,h=0.1.
        command: command file (JSON); without it clench plans one grasp with --seed, as `clench plan` does.
        hand_file: TOML file that overrides the interpretation of the hand's model.
        palm: name of the palm link, to pick a hand inside a whole robot.
        scale: multiplies the object's lengths, e.g. 0.001 for a mesh in millimetres.
        table: put a table under the object: at its lowest point, or with its top at this height of the world [m].
        obstacle: obstacle in the world, as MESH_OR_SHAPE@x,y,z or MESH_OR_SHAPE@x,y,z,qw,qx,qy,qz [m]; may be given
            several times (docs/surroundings.md).
        collision_source: geometry of the hand that is solved.
        planes: number of curl planes per finger.
        order: closing order of the joints; several orders are solved one by one, and the best answer is kept.
        criteria: weights of the choice: a preset (balanced, steady, gentle, quick) or a calibration file.
        seed: seed of the planned grasp; recorded with the result.
        out: folder for solution.json, trajectory.json and figures.
        html: file (.html) for a page that shows the closing in any browser, without a network (docs/pictures.md).
        record: SQLite record to append the solution to.
        pose_error: show the effect of an error of the object's pose up to this many metres and degrees, e.g. 0.002 2.
        explain: print the candidates of every finger with their scores, and the reason for the choice.
        forces: print the grasp's quality, and the forces that hold the object.
        mass: mass of the object for --forces [kg]; two numbers are a range; 0.1 by default.
        friction: friction between links and object for --forces; two numbers are a range; by default the values of
            hand file and object, else 0.6. The choice among candidates always takes the default.
        strict: exit with 1 unless the status is grasp.
        json: print the solution as one JSON document on standard output.
    """
    from dataclasses import replace
    from math import radians

    import clench
    from clench.apps.cli.inputs.kernel_loading import compile_kernels, load_kernels
    from clench.apps.cli.output.choice_tables import plain_front, print_choice
    from clench.apps.cli.output.preshape_tables import print_posture_choice
    from clench.apps.cli.output.printing import print_closure, print_forces, print_pose_error, print_solution
    from clench.apps.cli.output.results import exit_code, print_json, write_results
    from clench.closing.collision.sizes import warn_of_size
    from clench.models.objects.object_loading import size_warnings
    from clench.solver.orders import settled

    forces = forces or bool(mass or friction)
    carried, gripped = _checked_forces(mass, friction, criteria)
    _check_files(out, html, record)
    the_hand = clench.Hand.load(hand, hand_file=hand_file, palm=palm, collision_source=collision_source)
    the_object = clench.GraspObject.load(object, scale=scale)
    told = size_warnings(the_object) if warn_of_size(the_hand, the_object) else ()
    given, planned = None if command is None else read_command(command, the_hand), None
    the_object = with_scene(the_object, None if given is None else given.object_pose, table, obstacle)
    asked: dict[str, Any] = {k: v for k, v in (("planes", planes), ("criteria", criteria)) if v is not None}
    compile_kernels()
    if given is None:
        plan = clench.plan_grasps(the_hand, the_object, 1, mass=carried, friction=gripped, seed=seed, path=False)
        if not len(plan):
            return _no_grasp(plan, json)
        given, planned = replace(plan[0].command, seed=seed), plan[0]
    the_command = in_orders(replace(given, **asked), order or ())
    load_kernels()
    solution = clench.solve(the_hand, the_object, the_command)
    the_command = settled(the_command, solution)
    solution = replace(solution, hand_model=loadable(hand), object_model=loadable(object))
    if json or forces or any((out, html, record)):
        solution = clench.execution.complete(solution, the_hand, the_object, mass=carried, friction=gripped)
    files = [] if out is None else write_results(the_hand, the_object, the_command, solution, out)
    files += _page_and_record(the_hand, the_object, solution, html, record)
    error = None
    if pose_error is not None:
        off = pose_error[0], radians(pose_error[1])
        error = clench.mechanics.pose_error(the_hand, the_object, the_command, *off, solution=solution)
    if json:
        more: dict[str, Any] = {} if error is None else {"pose_error": error.to_dict()}
        if explain:
            more["pareto_front"] = plain_front(solution)
        print_json(solution.to_dict() | more)
    else:
        untold = [warning for warning in the_object.warnings if warning not in told]
        print_solution(solution, [*the_hand.warnings, *untold], files)
        if not forces:
            print_closure(solution, the_hand, the_object)
        _tell_planned(planned)
        print_posture_choice(solution)
        if error is not None:
            print_pose_error(error)
        if explain:
            print_choice(solution)
        if forces:
            print_forces(solution)
    return exit_code(solution, strict)


def _page_and_record(
    hand: Hand, obj: GraspObject, solution: GraspSolution, html: Path | None, record: Path | None
) -> list[Path]:
    """Write the page of a solution, and append the solution to a record; return the files."""
    import clench

    files = [] if html is None else [clench.write_page(html, hand, obj, solution)]
    if record is not None:
        with clench.Record(record) as kept:
            kept.append(solution)
        files.append(record)
    return files


def _check_files(out: Path | None, html: Path | None, record: Path | None) -> None:
    """Refuse a folder, a page or a record that cannot be written, before anything is loaded."""
    import clench
    from clench.apps.pages.page_files import check_page
    from clench.core.files.json_files import check_folder

    if out is not None:
        check_folder(out)
    if html is not None:
        check_page(html, out)
    if record is not None:
        clench.Record.check(record)


def _checked_forces(mass: tuple[float, ...], friction: tuple[float, ...], criteria: str | None) -> tuple[Any, Any]:
    """Check options that need neither hand nor object, before any loading or compiling.

    Returns:
        Mass [kg] and friction [-], numbers or ranges; the friction may be None.
    """
    from clench.core.defaults import MASS
    from clench.mechanics.grasp.contacts import friction_range
    from clench.mechanics.grasp.loads import mass_range
    from clench.scoring.calibration import calibration_of

    carried, gripped = as_range(mass, "--mass"), as_range(friction, "--friction")
    if gripped is not None:
        friction_range(gripped, "--friction")
    mass_range(MASS if carried is None else carried, "--mass")
    calibration_of(criteria)
    return MASS if carried is None else carried, gripped


def _tell_planned(grasp: PlannedGrasp | None) -> None:
    """Say which grasp was planned, where no command was given."""
    if grasp is not None:
        place = ", ".join(f"{1e3 * x:z.0f}" for x in grasp.hand_pose.position)
        said = f"preshape {grasp.preshape}, palm at [{place}] mm, epsilon {grasp.epsilon:z.3f}"
        sys.stdout.write(f"without a command, one grasp was planned: {said}; 'clench plan' finds more\n")


def _no_grasp(plan: GraspPlan, json: bool) -> int:
    """Say why planning found no grasp, and return the exit code for an answer that is no grasp."""
    from clench.apps.cli.output.plan_table import print_plan
    from clench.apps.cli.output.results import print_json

    document = plan.to_dict()
    if json:
        print_json(document)
    else:
        print_plan(document, plan.text)
    return 1


def in_orders(command: GraspCommand, names: Sequence[Order]) -> GraspCommand:
    """Return a command for one closing order, or for several as alternatives; without an order, unchanged."""
    from dataclasses import replace

    from clench.models.command import ClosingOrder

    orders = tuple(map(ClosingOrder, names))
    if len(orders) == 1:
        return replace(command, order=orders[0], orders=())
    return replace(command, orders=orders) if orders else command
