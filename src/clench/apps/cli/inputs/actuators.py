"""Make the actuator for `clench execute` from its options."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from clench.core.exceptions import CommandError

if TYPE_CHECKING:
    from clench.execution.executing import Executor
    from clench.execution.execution_report import ExecutionReport
    from clench.execution.hardware.driver import HandDriver
    from clench.execution.simulation.filming import Film
    from clench.execution.simulation.hold import Hold
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject

ActuatorName = Literal["simulated", "ros2", "orca", "orca-mock", "signal"]
DriveName = Literal["servo", "model"]
Interface = Literal["auto", "rclpy", "cyclonedds", "action"]


@dataclass(frozen=True)
class ActuatorOptions:
    """The options of `clench execute` for the connection to a hand; None is the actuator's own default."""

    controller: str | None
    joint_states: str | None
    interface: Interface | None
    joint_map: Path | None
    config: Path | None
    timeout: float
    to: str | None
    record: Path | None
    hold: Hold | None = None
    squeeze: float | None = None
    film: Film | None = None
    drive: DriveName | None = None


#: Options by actuator; any other given option is refused.
_TAKEN: dict[str, tuple[str, ...]] = {
    "simulated": ("hold", "film", "drive"),
    "ros2": ("controller", "joint_states", "interface", "joint_map", "squeeze"),
    "orca": ("joint_map", "config", "squeeze"),
    "orca-mock": ("joint_map", "config", "squeeze"),
    "signal": ("to", "record"),
}
#: Option names that differ from the names here.
_SAID = {"hold": "hold or --lift", "film": "video or --stills"}


def make_actuator(
    name: ActuatorName, hand: Hand, obj: GraspObject, options: ActuatorOptions, show_progress: bool
) -> Executor:
    """Return the actuator that was asked for.

    Raises:
        CommandError: the actuator does not take an option, or a required option is missing.
    """
    import clench

    for option in sorted({option for taken in _TAKEN.values() for option in taken} - set(_TAKEN[name])):
        if getattr(options, option) is not None:
            given = _SAID.get(option, option.replace("_", "-"))
            raise CommandError(f"--{given} means nothing to --actuator {name}.")
    if not options.timeout > 0.0:
        raise CommandError(f"--timeout: expected seconds above 0, got {options.timeout:g}.")
    if name == "simulated":
        drive = options.drive or "servo"
        return clench.SimulatedHand(
            hand, obj, show_progress=show_progress, hold=options.hold, drive=drive, film=options.film
        )
    if name == "signal":
        if options.to is None or options.record is None:
            raise CommandError("--actuator signal needs --to (file:PATH, tcp:HOST:PORT, …) and --record DB.")
        return clench.execution.ReadySignal(hand, options.record, options.to, obj=obj, timeout=options.timeout)
    joint_map = None if options.joint_map is None else clench.execution.JointMap.load(options.joint_map)
    driver = _driver(name, options)
    squeeze = 1.0 if options.squeeze is None else options.squeeze
    return clench.execution.HardwareHand(
        hand, driver, joint_map=joint_map, obj=obj, connect_timeout=options.timeout, squeeze=squeeze
    )


def stop_of(actuator: Executor) -> Callable[[], None]:
    """Return a function that forbids further commands to a hardware hand, at any moment and without waiting for its
    driver.

    The interrupt that follows tells the hand to stop. Nothing is done for other actuators.
    """
    import clench

    return actuator.supervision.stop if isinstance(actuator, clench.execution.HardwareHand) else lambda: None


def report_of(actuator: Executor) -> ExecutionReport:
    """Return the report of an interrupted execution on a hardware hand.

    Raises:
        KeyboardInterrupt: there is no report, because the interrupt came before the execution, or to another actuator.
    """
    import clench

    if not isinstance(actuator, clench.execution.HardwareHand) or actuator.last_report is None:
        raise KeyboardInterrupt
    return actuator.last_report


def make_film(video: Path | None, stills: Path | None) -> Film | None:
    """Return the film that was asked for.

    Raises:
        FileError: a file or folder cannot be written.
    """
    if video is None and stills is None:
        return None
    from clench.execution.simulation.filming import Film

    return Film(video, stills)


def make_hold(hold: bool, lift: bool, mass: float | None, friction: float | None) -> Hold | None:
    """Return the hold test that was asked for, None without `--hold` and `--lift`.

    Raises:
        CommandError: an option of the test without it; a value out of range.
    """
    import clench

    given: dict[str, Any] = {"mass": mass, "friction": friction}
    given = {key: value for key, value in given.items() if value is not None}
    if hold and lift:
        raise CommandError("--hold and --lift are two tests: give one of them.")
    if not (hold or lift) and given:
        raise CommandError(f"--{next(iter(given))} means nothing without --hold or --lift.")
    return clench.execution.Hold(test="lift" if lift else "pulls", **given) if hold or lift else None


def _driver(name: ActuatorName, options: ActuatorOptions) -> HandDriver:
    import clench

    if name == "ros2":
        return clench.execution.Ros2Driver(
            options.controller or "hand_controller",
            joint_states=options.joint_states or "/joint_states",
            interface=options.interface or "auto",
        )
    return clench.execution.OrcaDriver(options.config, mock=name == "orca-mock")
