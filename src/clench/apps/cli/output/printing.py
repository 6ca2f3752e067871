"""Tables for people, on standard output."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .tables import console_out, plain, print_table, table_with

if TYPE_CHECKING:
    from rich.console import Console

    from clench.execution.execution_report import ExecutionReport, NextStepReached
    from clench.execution.formats.exchange import ExportReport
    from clench.execution.simulation.hold import HoldReport
    from clench.models.hand.hand import Hand
    from clench.models.hand.hand_report import HandReport
    from clench.models.objects.grasp_object import GraspObject
    from clench.solver.analysis.pose_error import PoseErrorReport
    from clench.solver.analysis.record import RecordEntry
    from clench.solver.solution import FingerResult, GraspSolution


def print_solution(solution: GraspSolution, warnings: Sequence[str], files: Sequence[Path]) -> None:
    """Print the answer: status, fingers, joint angles, violations, and where the files are."""
    console = console_out()
    console.print(f"[bold]{solution.status.value}[/bold]: {plain(solution.reason.get('text', ''))}")
    table = table_with(
        f"{solution.hand} on {solution.object}", "finger", "status", "chosen", "touches with", "angles [deg]"
    )
    for name, finger in solution.fingers.items():
        table.add_row(*map(plain, _finger_row(name, finger, solution)))
    print_table(console, table)
    for name, finger in solution.fingers.items():
        if finger.cause is not None:
            console.print(
                f"{plain(name)} ({plain(finger.cause['code'])}): {plain(finger.cause['text'])}", soft_wrap=True
            )
    if solution.max_penetration is not None:
        console.print(f"largest penetration of the whole hand: {solution.max_penetration * 1e3:z.4f} mm")
    if solution.certificate is not None:
        word = "certified" if solution.certified else "not certified"
        console.print(f"{word}: {plain(solution.certificate['text'])}")
    if "total" in solution.timing:
        console.print(f"computed in {solution.timing['total'] * 1e3:z.2f} ms")
    _sentences(console, "violation", solution.violations())
    _sentences(console, "warning", warnings)
    print_files(files)


def print_closure(solution: GraspSolution, hand: Hand, obj: GraspObject) -> None:
    """Print whether a grasp resists every wrench; nothing for an answer without a grasp.

    Args:
        solution: the answer; without its quality, a fast lower bound of epsilon decides. hand, obj: as solved.
    """
    if solution.status.value not in ("grasp", "partial"):
        return
    from clench.mechanics.epsilon.epsilon_quality import epsilon_bound
    from clench.solver.analysis.holding import hold

    contacts = hold(solution, hand, obj).held
    at = f"at friction {contacts.contacts.friction.min(initial=np.inf):g}"
    exact = None if solution.quality is None else solution.quality["epsilon"]
    radius, word = (epsilon_bound(contacts), "at least ") if exact is None else (exact, "")
    if radius > 0.0:
        text = f"force closure: the grasp resists every wrench {at}; epsilon is {word}{radius:z.3f}"
    else:
        text = f"no force closure found {at}: some pulls may move the object; 'clench plan' finds poses that resist all"
    console_out().print(plain(text), soft_wrap=True)


def print_forces(solution: GraspSolution) -> None:
    """Print how steady a completed solution is, and the forces, torques and offsets of its squeeze."""
    console = console_out()
    quality, squeeze = solution.quality or {}, solution.squeeze or {}
    effort = quality["actuation"]
    closure = "force closure" if quality["force_closure"] else "no force closure"
    console.print(
        f"{closure}: epsilon {quality['epsilon']:z.4f} ({quality['norm']}, {quality['edges']} edges, length scale "
        f"{quality['length_scale'] * 1e3:z.1f} mm, {quality['contact_model']} contacts), volume {quality['volume']:.4g}"
    )
    if effort["worst_torque"] is None:
        console.print(f"{effort['mass']:g} kg are not held in every direction of gravity: {plain(effort['reason'])}")
    else:
        tension = "" if effort["worst_tension"] is None else f" and {effort['worst_tension']:z.1f} N in tendons"
        console.print(
            f"{effort['mass']:g} kg in any direction of gravity take {effort['worst_torque']:z.3f} Nm{tension}"
        )
    console.print(plain(squeeze["text"]))
    if not squeeze["forces"]:
        return
    table = table_with(
        "squeeze, forces on the object", "finger", "link", "friction [-]", "force [N]", "x [N]", "y [N]", "z [N]"
    )
    for contact, mu, force in zip(squeeze["contacts"], squeeze["friction"], squeeze["forces"], strict=True):
        numbers = [f"{mu:g}", f"{float(np.linalg.norm(force)):z.2f}", *(f"{f:z.2f}" for f in force)]
        table.add_row(*map(plain, (contact["finger"], contact["link"], *numbers)))
    print_table(console, table)
    table = table_with("squeeze, degrees of freedom", "joint", "torque [Nm]", "offset [deg]")
    for name, torque in squeeze["torques"].items():
        offset = squeeze["offsets"].get(name)
        table.add_row(plain(name), f"{torque:z.3f}", "" if offset is None else f"{np.rad2deg(offset):z.2f}")
    print_table(console, table)


def print_pose_error(error: PoseErrorReport) -> None:
    """Print the effect of an error of the object's pose on angles and touching links."""
    console = console_out()
    size = f"±{error.translation * 1e3:g} mm and ±{np.rad2deg(error.rotation):g}°"
    table = table_with(f"the object off by {size}", "joint", "stopped by", "to first order [deg]", "solved again [deg]")
    for name, predicted, measured in zip(error.sensitivity.joints, error.predicted, error.measured, strict=True):
        stopped = error.sensitivity.stopped_by.get(name, "")
        table.add_row(*map(plain, (name, stopped, _degrees(predicted), _degrees(measured))))
    print_table(console, table)
    for text, links in (("still touch", error.kept), ("touch as well", error.gained)):
        if links:
            listed = ", ".join(f"{link} {share:.0%}" for link, share in links.items())
            console.print(f"{text}, of {len(error.corners)} corners: {plain(listed)}")
    statuses = ", ".join(f"{status} {count}" for status, count in error.statuses.items())
    console.print(f"answers at the corners: {statuses}")
    _sentences(console, "no number", list(dict.fromkeys(error.sensitivity.reasons.values())))


def print_hand(report: HandReport) -> None:
    """Print the interpretation of a hand."""
    console = console_out()
    summary = table_with(f"hand {report.name}", "", "")
    for row in report.summary_rows():
        summary.add_row(*map(plain, row))
    print_table(console, summary)
    joints = table_with("joints", "finger", "joint", "role", "closes", "open [deg]", "limits [deg]")
    for joint in report.joint_rows():
        joints.add_row(*map(plain, joint[:-1]))
    print_table(console, joints)
    console.print("why:")
    for joint in report.joint_rows():
        console.print(f"  [bold]{plain(joint[1])}[/bold]: {plain(joint[-1])}", soft_wrap=True)
    couplings = report.coupling_rows()
    if couplings:
        table = table_with("coupled joints", "joint", "follows", "why")
        for coupling in couplings:
            table.add_row(*map(plain, coupling))
        print_table(console, table)
    pairs = ", ".join(f"{a} - {b}" for a, b in report.allowed_pairs)
    console.print(f"may overlap: {plain(pairs) or 'none'}")
    if not report.findings:
        console.print("[green]nothing looks wrong[/green]")
    for finding in report.findings:
        label = "[yellow]warning[/yellow]" if finding.severity == "warning" else "note"
        console.print(f"{label} ({finding.code}): {plain(finding.text)}", soft_wrap=True)
        for number, line in enumerate(finding.advice.split("\n") if finding.advice else ()):
            console.print(f"{'       ' if number else '    -> '}{plain(line)}", soft_wrap=True)


def print_report(report: ExecutionReport) -> None:
    """Print the state that an actuator reached."""
    console = console_out()
    good, bad = ("reached", "not reached") if report.joints else ("done", "failed")
    if report.hold is not None:
        good, bad = "held", "not reached" if report.hold.held else "dropped" if report.hold.pulls else "not tested"
    verdict = f"[bold green]{good}[/bold green]" if report.success else f"[bold red]{bad}[/bold red]"
    console.print(f"{verdict}: {plain(report.reason)}")
    if report.joints:
        table = table_with(
            f"joints ({report.actuator} hand)", "joint", "computed [deg]", "reached [deg]", "error [deg]"
        )
        for name, joint in report.joints.items():
            angles = (joint.computed, joint.reached, joint.error)
            table.add_row(plain(name), *(f"{np.rad2deg(a):z.3f}" for a in angles))
        print_table(console, table)
    if report.contacts:
        table = table_with("contacts", "finger", "link", "gap [mm]", "moved from computed [mm]")
        for c in report.contacts:
            table.add_row(plain(c.finger), plain(c.link), _millimetres(c.gap), _millimetres(c.displacement))
        print_table(console, table)
    times = ", ".join(f"{n} {t:z.3f} s" if t is not None else f"{n} never" for n, t in report.first_touch.items())
    if times:
        console.print(f"first touch: {plain(times)}")
    if report.hold is not None:
        _print_hold(console, report.hold)
    if report.next_steps:
        _print_steps(console, report.next_steps)
    _sentences(console, "note", report.notes)


def _print_hold(console: Console, hold: HoldReport) -> None:
    asked = hold.settings
    lifted = asked.test == "lift"
    load = f"lifted {asked.height:g} m" if lifted else f"{asked.pull * asked.mass:g} N for {asked.duration:g} s"
    console.print(
        f"hold: {asked.mass:g} kg, friction {asked.friction:g}, torsion {asked.torsion:g} m, {load}; "
        f"it counts as dropped from {asked.max_distance * 1e3:g} mm or {np.rad2deg(asked.max_angle):.3g}° on"
    )
    console.print(f"plan: {plain(hold.plan)}")
    if hold.closed is None or hold.squeezed is None:
        return
    table = table_with("free object", "after", "held", "moved [mm]", "turned [deg]")
    for step, motion in (("closing", hold.closed), ("squeeze alone", hold.squeezed)):
        table.add_row(step, "", _millimetres(motion.distance), f"{np.rad2deg(motion.angle):z.2f}")
    for direction, pulled in hold.pulls.items():
        moved = _millimetres(pulled.motion.distance), f"{np.rad2deg(pulled.motion.angle):z.2f}"
        table.add_row(direction if lifted else f"pull {direction}", "yes" if pulled.held else "no", *moved)
    print_table(console, table)
    if hold.touch_spread is not None:
        console.print(f"fingers touched the free object within {hold.touch_spread * 1e3:z.0f} ms")


def _print_steps(console: Console, steps: Sequence[NextStepReached]) -> None:
    known = {None: "", True: "yes", False: "no"}
    table = table_with("next steps", "step", "reached", "largest error [deg]", "touching", "held", "object moved [mm]")
    for number, step in enumerate(steps, start=1):
        error = max((abs(joint.error) for joint in step.joints.values()), default=0.0)
        touching = "" if step.touching is None else ", ".join(step.touching) or "none"
        moved = "" if step.motion is None else _millimetres(step.motion.distance)
        row = (str(number), known[step.reached], f"{np.rad2deg(error):z.3f}", touching, known[step.held], moved)
        table.add_row(*map(plain, row))
    print_table(console, table)


def print_entries(entries: Sequence[RecordEntry], total: int) -> None:
    """Print a list of recorded solves."""
    console = console_out()
    table = table_with(
        f"{len(entries)} of {total} solves", "id", "time [UTC]", "hand", "object", "status", "touching", "seed"
    )
    for e in entries:
        seed = "" if e.seed is None else str(e.seed)
        row = (str(e.id), e.time[:19], e.hand, e.object, e.status.value, str(e.touching_fingers), seed)
        table.add_row(*map(plain, row))
    print_table(console, table)


def print_batch(document: Mapping[str, Any]) -> None:
    """Print how the poses of a batch ended, and how long that took; see `clench batch --json`."""
    console = console_out()
    count, seconds = document["poses"], document["seconds"]
    table = table_with(f"{document['hand']} on {document['object']}: {count} poses", "status", "poses", "share")
    for name, number in {**document["status"], "certified": document["certified"]}.items():
        table.add_row(plain(name), str(number), f"{100.0 * number / max(count, 1):z.1f} %")
    print_table(console, table)
    rate = f", {count / seconds:z.0f} a second" if count and seconds > 0.0 else ""
    console.print(f"solved in {seconds:z.2f} s{rate}")


def print_weights(weights: Mapping[str, float], sentence: str) -> None:
    """Print fitted weights, and a sentence about them."""
    console = console_out()
    if weights:
        table = table_with("fitted weights", "criterion", "weight [-]")
        for name, weight in weights.items():
            table.add_row(plain(name), f"{weight:.4g}")
        print_table(console, table)
    console.print(plain(sentence))


def print_exported(report: ExportReport, notes: Sequence[str]) -> None:
    """Print the files of an export with the confidence of their grasps, and sentences about missing data."""
    console, each = console_out(), report.confidences
    console.print("files:")
    for i, file in enumerate(report.files):
        said = Counter(each if len(report.files) == 1 else each[i : i + 1])
        counted = [f"{c:g} ({n} grasp{'' if n == 1 else 's'})" for c, n in said.items()]
        listed = ", ".join(counted) if len(each) > len(report.files) else f"{each[i]:g}"
        console.print(f"  {plain(file)}: confidence {listed}", soft_wrap=True)
    for note in notes:
        console.print(f"note: {plain(note)}", soft_wrap=True)


def print_files(files: Sequence[Path]) -> None:
    """Print where the files are."""
    console = console_out()
    if files:
        console.print("files:")
    for file in files:
        console.print(f"  {plain(file)}", soft_wrap=True)


def _finger_row(name: str, finger: FingerResult, solution: GraspSolution) -> tuple[str, ...]:
    links = dict.fromkeys(c.link for c in solution.contacts if c.finger == name and not c.passed)
    chosen = finger.best
    if chosen is None:
        return name, finger.status.value, "", finger.reason, ""
    plane = "full width" if chosen.plane is None else f"plane {chosen.plane}"
    angles = " ".join(f"{np.rad2deg(a):z.1f}" for a in chosen.joint_angles.values())
    return name, finger.status.value, plane, ", ".join(links) or finger.reason, angles


def _sentences(console: Console, label: str, sentences: Sequence[str]) -> None:
    for sentence in sentences:
        console.print(f"[yellow]{label}:[/yellow] {plain(sentence)}")


def _millimetres(length: float) -> str:
    return f"{length * 1e3:z.3f}"


def _degrees(angle: float) -> str:
    return f"±{np.rad2deg(angle):z.2f}" if np.isfinite(angle) else "no number"
