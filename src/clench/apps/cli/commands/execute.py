"""`clench execute`: carry a solution out, on a simulated hand or on another controller."""

from __future__ import annotations

import sys
from pathlib import Path

from clench.apps.cli.inputs.actuators import (
    ActuatorName,
    ActuatorOptions,
    DriveName,
    Interface,
    make_actuator,
    make_film,
    make_hold,
    report_of,
    stop_of,
)
from clench.apps.cli.inputs.scene_options import with_scene
from clench.apps.cli.interrupts import stopped_by_signals
from clench.apps.cli.parsing import EXIT_INTERRUPTED
from clench.core.exceptions import FileError
from clench.core.files.json_files import check_writable


def execute(
    solution: Path,
    /,
    *,
    actuator: ActuatorName = "simulated",
    hand: str | None = None,
    object: str | None = None,
    hand_file: Path | None = None,
    palm: str | None = None,
    scale: float | None = None,
    table: tuple[float, ...] | None = None,
    obstacle: tuple[str, ...] = (),
    speed: float = 1.0,
    force: bool = False,
    skip_next_steps: bool = False,
    hold: bool = False,
    lift: bool = False,
    mass: float | None = None,
    friction: float | None = None,
    drive: DriveName | None = None,
    controller: str | None = None,
    joint_states: str | None = None,
    interface: Interface | None = None,
    joint_map: Path | None = None,
    config: Path | None = None,
    video: Path | None = None,
    stills: Path | None = None,
    squeeze: float | None = None,
    timeout: float = 5.0,
    to: str | None = None,
    record: Path | None = None,
    log: Path | None = None,
    out: Path | None = None,
    strict: bool = False,
    json: bool = False,
) -> int:
    """Execute a solution and report the reached state.

    Args:
        solution: file written by `clench solve --out` or `GraspSolution.save`.
        actuator: the kind of hand to move.
        hand: model of the hand; by default the solution's own.
        object: model of the object; by default the solution's own.
        hand_file: TOML file of the solution's hand.
        palm: palm link of the solution's hand, if it was given.
        scale: scale of the object; by default the solution's own.
        table: table of the solution, as for `clench solve`.
        obstacle: obstacles of the solution, as for `clench solve`; may be given several times.
        speed: fraction of the joints' velocity limits, above 0 and up to 1.
        force: also execute a solution that has violations, or next steps that drive links into each other.
        skip_next_steps: end after the touch and the squeeze, and leave out the solution's next steps.
        hold: simulated: close on the free object, squeeze it as planned, pull it in six directions.
        lift: simulated: close on the object on a table, squeeze it as planned, lift it.
        mass: hold, lift: mass of the object [kg] (0.1).
        friction: hold, lift: friction of its contacts (0.6).
        drive: simulated: what moves the joints: stiff servos, or the model's own actuators (servo).
        controller: ros2: name of the joint_trajectory_controller (hand_controller).
        joint_states: ros2: topic of the joint states (/joint_states).
        interface: ros2: program interface (auto: rclpy, else cyclonedds).
        joint_map: ros2, orca: TOML file with the controller's joint names, units, offsets and limits.
        config: orca: the hand's config.yaml.
        video: simulated: file for a moving picture (.gif, or .mp4 with clench[video]).
        stills: simulated: folder for pictures of the start, the touch, the squeeze, the end and next steps (PNG).
        squeeze: ros2, orca: share of the squeeze plan's angle offsets that is added to the touch (1).
        timeout: time to look for the controller [s].
        to: signal: file:PATH, tcp:HOST:PORT, unix:PATH or topic:NAME.
        record: signal: record (SQLite file) to which the solution is appended.
        log: file for targets and measurements on the way (MCAP).
        out: file for the report (JSON).
        strict: exit with 1 unless the solution's status is grasp.
        json: print the report as one JSON document on standard output.
    """
    from dataclasses import replace

    import clench
    from clench.apps.cli.output.printing import print_report
    from clench.apps.cli.output.results import exit_code, print_json

    for file in (out, log):
        if file is not None:
            check_writable(file)
    if record is not None:
        clench.Record.check(record)
    film = make_film(video, stills)
    tested = make_hold(hold, lift, mass, friction)
    the_solution = clench.GraspSolution.load(solution)
    the_hand = clench.Hand.load(_named(hand, the_solution.hand_model, solution, "hand"), hand_file=hand_file, palm=palm)
    the_object = clench.GraspObject.load(
        _named(object, the_solution.object_model, solution, "object"),
        scale=the_solution.object_scale if scale is None else scale,
        collision_source=the_solution.object_collision_source,
    )
    the_object = with_scene(the_object, the_solution.object_pose, table, obstacle)
    options = ActuatorOptions(
        controller, joint_states, interface, joint_map, config, timeout, to, record, tested, squeeze, film, drive
    )
    moved = make_actuator(actuator, the_hand, the_object, options, show_progress=not json)
    interrupted = False
    try:
        with stopped_by_signals(stop_of(moved)):
            report = clench.execute(the_solution, moved, speed=speed, force=force, next_steps=not skip_next_steps)
    except KeyboardInterrupt:
        report, interrupted = report_of(moved), True
    if film is not None and not film.finish():
        report = replace(report, notes=(*report.notes, "Nothing moved: no picture was written."))
    if log is not None and report.history is None:
        report = replace(report, notes=(*report.notes, "Nothing was measured on the way: no log was written."))
    elif log is not None:
        clench.formats.write_log(log, report, the_solution)
    if out is not None:
        report.save(out)
    if json:
        print_json(report.to_dict())
    else:
        print_report(report)
    if interrupted:
        # The report is the one document on standard output.
        sys.stderr.write("clench: error: interrupted.\n")
        return EXIT_INTERRUPTED
    return 0 if report.success and exit_code(the_solution, strict) == 0 else 1


def _named(given: str | None, recorded: str, solution: Path, what: str) -> str:
    name = given or recorded
    if not name:
        raise FileError(solution, f"{what}_model: the solution does not name it; give --{what}.")
    return name
