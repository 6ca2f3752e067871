"""The benchmark of one solve: a whole hand, many approach poses, every stage."""

from __future__ import annotations

import time
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import partial

import numpy as np

import clench
from clench.closing.kernel_run import empty_answers, run_stages
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource
from clench.models.tessellation import shape_mesh
from clench.scoring.calibration import calibration_of
from clench.solver.alternatives import candidates_of
from clench.solver.problem import make_problem
from clench.solver.solution import GraspSolution

from ..bench_options import Case, Runs
from ..bench_report import BenchReport, describe_place, timed
from .answer_checks import Checked, Surface, check_answer

#: Wrong answers told before the rest is only counted.
_TOLD = 5


def bench_solve(case: Case, asked: GraspCommand, runs: Runs) -> BenchReport:
    """Check the answers for many approach poses, then time them.

    Args:
        case: the loaded models. asked: of every pose; its seed draws the poses. runs: how many poses, and how often.

    Returns:
        the report; with errors, and without times of solves, when an answer is wrong.
    """
    report = BenchReport(values={"benchmark": "solve", **describe_place()})
    hand, load_hand = timed(lambda: clench.Hand.load(case.hand))
    obj, load_object = timed(lambda: clench.GraspObject.load(case.object, scale=case.scale))
    poses, approach = timed(lambda: clench.approach_poses(hand, obj, runs.poses, asked.seed or 0))
    commands = [replace(asked, hand_pose=pose) for pose in poses]
    _, first = timed(lambda: clench.solve(hand, obj, commands[0]))
    _describe_problem(report, hand, obj, asked)
    report.values |= asdict(runs)
    _check(report, hand, obj, commands)
    if report.errors:
        return report
    # Compiling, or reading compiled code, falls into the first approach pose and the first solve.
    for key, seconds in (
        ("warmup_load_hand", load_hand),
        ("warmup_load_object", load_object),
        ("warmup_approach_poses", approach),
        ("warmup_first_solve", first),
    ):
        report.values[f"{key}_s"] = seconds
    _time_preparation(report, hand, obj, commands[0])
    _time_solves(report, hand, obj, commands, runs.passes)
    _time_stages(report, hand, obj, commands, runs.passes)
    return report


def _describe_problem(report: BenchReport, hand: Hand, obj: GraspObject, asked: GraspCommand) -> None:
    meshes = [shape.mesh for body in obj.bodies for shape in body.shapes if shape.mesh is not None]
    source = asked.collision_source or hand.default_source
    report.values |= {
        "hand": hand.name,
        "fingers": len(hand.fingers),
        "joints": len(hand.joints),
        "degrees_of_freedom": len(hand.joints) - len(hand.couplings),
        "collision_source": source.value,
        "hand_triangles": link_triangles(hand, source),
        "object": obj.name,
        "object_triangles": sum(len(mesh.triangles) for mesh in meshes),
        "order": asked.order.value,
        "planes": asked.planes,
        "seed": asked.seed or 0,
    }


def link_triangles(hand: Hand, source: CollisionSource) -> int:
    """Return how many triangles the meshes of the links have that are closed, convex hulls for `engine`.

    Boxes, spheres, capsules, cylinders and ellipsoids are no meshes, and count nothing.
    """
    shapes = [shape for link in hand.links for shape in link.shapes.get(source, ())]
    return sum(len(shape_mesh(shape, source).triangles) for shape in shapes if shape.mesh is not None)


def _check(report: BenchReport, hand: Hand, obj: GraspObject, commands: Sequence[GraspCommand]) -> None:
    checked, surface, wrong = Checked(), Surface(obj), []
    solutions = [clench.solve(hand, obj, command) for command in commands]
    for i, (command, solution) in enumerate(zip(commands, solutions, strict=True)):
        again = clench.solve(hand, obj, command)
        wrong += [f"pose {i}: {sentence}" for sentence in check_answer(solution, again, surface, checked)]
    if not checked.contacts:
        wrong.append("no pose gives a single contact, so nothing could be checked.")
    report.errors += wrong[:_TOLD]
    if len(wrong) > _TOLD:
        report.errors.append(f"and {len(wrong) - _TOLD} more.")
    report.values |= {
        "answers_right": not wrong,
        "checked_contacts": checked.contacts,
        "worst_gap_m": checked.worst_gap,
        "worst_overlap_m": checked.worst_overlap,
        "checked_surface_contacts": checked.surface_contacts,
        "worst_surface_distance_m": checked.worst_surface,
    }
    _describe_answers(report, solutions)


def _describe_answers(report: BenchReport, solutions: Sequence[GraspSolution]) -> None:
    statuses = Counter(s.status.value for s in solutions)
    depths = np.array([s.max_penetration or 0.0 for s in solutions])
    for status in ("grasp", "partial", "no_contact", "blocked"):
        report.values[f"status_{status}"] = statuses[status]
    report.values |= {
        "valid": sum(s.is_valid() for s in solutions),
        "penetration_median_mm": float(np.median(depths)) * 1e3,
        "penetration_p90_mm": float(np.percentile(depths, 90)) * 1e3,
        "penetration_max_mm": float(depths.max()) * 1e3,
    }


def _time_preparation(report: BenchReport, hand: Hand, obj: GraspObject, command: GraspCommand) -> None:
    """Time the parts that are computed once per hand and posture, and once per object, with everything compiled."""
    fresh = clench.solve(replace(hand), obj, command)
    report.values["prepare_hand_ms"] = fresh.timing["plan"] * 1e3
    body = obj.bodies[0]
    # A body of another name is another one, so the object is packed anew.
    renamed = replace(obj, bodies=(replace(body, name=f"{body.name} again"), *obj.bodies[1:]))
    report.values["prepare_object_ms"] = clench.solve(hand, renamed, command).timing["read"] * 1e3


def _time_solves(
    report: BenchReport, hand: Hand, obj: GraspObject, commands: Sequence[GraspCommand], passes: int
) -> None:
    whole: list[float] = []
    spent: list[float] = []
    contacts: list[float] = []
    everything: list[float] = []
    stages: dict[str, list[float]] = defaultdict(list)
    for command in [command for _ in range(passes) for command in commands]:
        began = time.process_time()
        solution, seconds = timed(lambda command=command: clench.solve(hand, obj, command))  # type: ignore[misc]
        spent.append(time.process_time() - began)
        whole.append(seconds)
        for stage, taken in solution.timing.items():
            stages[stage].append(taken)
        stages["assemble"].append(seconds - solution.timing["total"])
        contacts.append(timed(lambda solution=solution: solution.contacts)[1])  # type: ignore[misc]
        everything.append(timed(solution.to_dict)[1])
    report.distribution("solve", whole)
    # On a machine with other work the least of a few passes is what a pose takes, by the processor's time.
    report.distribution("solve_processor_least", np.array(spent).reshape(passes, -1).min(axis=0).tolist())
    report.distribution("then_read_contacts", contacts)
    report.distribution("then_read_everything", everything)
    for stage, taken in stages.items():
        if stage != "total":
            report.values[f"stage_{stage}_median_ms"] = float(np.median(taken)) * 1e3


def _time_stages(
    report: BenchReport, hand: Hand, obj: GraspObject, commands: Sequence[GraspCommand], passes: int
) -> None:
    for kind, full_width in (("width", True), ("planes", False)):
        spent = defaultdict[str, list[float]](list)
        for command in [replace(command, full_width=full_width) for _ in range(passes) for command in commands]:
            for stage, seconds in stage_times(hand, obj, command).items():
                spent[stage].append(seconds)
        for stage, times in spent.items():
            report.distribution(f"{kind}_{stage}", times)


def stage_times(hand: Hand, obj: GraspObject, command: GraspCommand) -> dict[str, float]:
    """Run the kernels of a solve stage by stage, where the solve itself runs them in one call; return the times [s].

    The kernels choose here as they do in a solve by their criteria, so the command may have no others.
    """
    from clench.kernels.closing.solve_layout import BLOCK, CHOOSE, CLOSE, FINISH

    problem = make_problem(hand, obj, command)
    packed = candidates_of(problem, calibration_of(command.criteria)).problem
    T, answers = problem.T_palm_object[None, :3], empty_answers(packed, 1)
    stages = {"close": CLOSE | BLOCK, "choose": CHOOSE, "finish": FINISH}
    return {name: timed(partial(run_stages, packed, T, answers, stage))[1] for name, stage in stages.items()}
