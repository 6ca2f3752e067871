"""The benchmark of scaling: time against triangles, planes, fingers, threads and the number of poses at once."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from typing import Final

import numpy as np

import clench
from clench.closing.collision.packed_object import pack_object
from clench.core.files.json_files import write_atomically
from clench.core.pose import FloatArray, Pose
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import GraspObject
from clench.solver.batch.batch_progress import shown
from clench.solver.solution import GraspSolution

from ..bench_options import Case, Pages, Runs
from ..bench_report import BenchReport, describe_place, timed
from .many_poses import stream_memory
from .refined import base_mesh, refinements
from .scaling_picture import draw_scaling, scaling_table
from .solve_memory import solve_memory
from .solving import stage_times

PLANES: Final = (1, 2, 3, 5, 9, 17, 33)
BATCHES: Final = (1, 4, 16, 64, 256, 1024)
#: Poses that threads share, at most.
AT_ONCE: Final = 64
#: Triangles of the coarsest mesh, about.
COARSEST: Final = 1000
#: Tolerance of an angle for other triangles of the same surface [rad].
SAME_SURFACE: Final = 1e-6
SAME: Final = 1e-9


@dataclass
class Axis:
    """One axis: its name, its sizes, and the times there by part of the work [s]."""

    name: str
    at: list[int] = field(default_factory=list)
    seconds: dict[str, list[float]] = field(default_factory=dict)

    def add(self, at: int, seconds: Mapping[str, float]) -> None:
        """Add one place."""
        self.at.append(at)
        for part, taken in seconds.items():
            self.seconds.setdefault(part, []).append(taken)

    def exponent(self, part: str) -> float:
        """Return the fitted exponent p of time = c n^p; 0 for a single place."""
        if len(self.at) < 2:
            return 0.0
        return float(np.polyfit(np.log(self.at), np.log(np.maximum(self.seconds[part], 1e-9)), 1)[0])


@dataclass(frozen=True)
class ScalingBench:
    """The settings: poses and passes, most triangles, most poses per call, poses of the stream, seed."""

    runs: Runs
    triangles: int
    batch: int
    stream: int
    seed: int
    show_progress: bool = False


def bench_scaling(case: Case, asked: ScalingBench, pages: Pages) -> BenchReport:
    """Measure each axis alone; every answer is compared with a known answer before its times count.

    Args:
        case: the loaded models. asked: see there. pages: files for a picture and a table.
    """
    report = BenchReport(values={"benchmark": "scaling", **describe_place()})
    hand, given = case.load()
    meshes = list(refinements(base_mesh(given, COARSEST), asked.triangles))
    obj = _object(meshes[0])
    poses = clench.approach_poses(hand, obj, asked.runs.poses, asked.seed)
    report.values |= {"hand": hand.name, "object": given.name, **asdict(asked.runs)}
    # Before the fine meshes, whose memory would be told as that of the stream.
    streamed, command = (
        BenchReport(),
        GraspCommand(hand_pose=Pose.identity(), preshape="open", full_width=False, measure=False),
    )
    stream_memory(streamed, hand, obj, poses, command, asked.stream)
    batches = [count for count in BATCHES if count <= asked.batch]
    work = len(meshes) + len(PLANES) + len(hand.fingers) + _cores() + len(batches)
    with shown(work, None if asked.show_progress else False) as advance:
        bench = _Bench(hand, obj, poses, asked.runs.passes, report, partial(advance, 1))
        many = clench.approach_poses(hand, obj, max(batches), asked.seed)
        axes = [bench.triangles(meshes), bench.planes(), bench.fingers(), bench.threads(many)]
        axes.append(bench.batch(many, batches))
    report.values["answers_right"] = not report.errors
    if report.errors:
        return report
    for axis in axes:
        _report_axis(report, axis)
    report.values["memory_triangles"] = len(meshes[-1].triangles)
    report.values |= {f"memory_{key}": value for key, value in solve_memory(case.hand, meshes[-1]).items()}
    report.values |= streamed.values
    report.errors += streamed.errors
    if pages.plot is not None:
        report.values["plot"] = str(draw_scaling(axes, pages.plot))
    if pages.table is not None:
        write_atomically(pages.table, scaling_table(axes).encode())
        report.values["table"] = str(pages.table)
    return report


def _object(mesh: TriangleMesh) -> GraspObject:
    return GraspObject.from_meshes([(mesh.vertices, mesh.triangles)], name=f"{len(mesh.triangles)} triangles")


def _cores() -> int:
    return os.cpu_count() or 1


def _report_axis(report: BenchReport, axis: Axis) -> None:
    for part, seconds in axis.seconds.items():
        for at, taken in zip(axis.at, seconds, strict=True):
            report.values[f"{axis.name}_{at}_{part}_ms"] = taken * 1e3
        report.values[f"{axis.name}_exponent_{part}"] = axis.exponent(part)
    if len(axis.at) > 1:
        whole = next(iter(axis.seconds.values()))
        report.values[f"{axis.name}_growth"] = whole[-1] / whole[0]
        report.values[f"{axis.name}_log_growth"] = float(np.log(axis.at[-1]) / max(np.log(axis.at[0]), 1.0))


@dataclass
class _Bench:
    hand: Hand
    obj: GraspObject
    poses: Sequence[Pose]
    passes: int
    report: BenchReport
    advance: Callable[[], None]

    def triangles(self, meshes: Sequence[TriangleMesh]) -> Axis:
        """Solve the same surface with more and more triangles; the answers are those of the coarsest."""
        axis = Axis("triangles")
        commands = [GraspCommand(hand_pose=pose, preshape="open", measure=False) for pose in self.poses]
        first: list[FloatArray] = []
        for mesh in meshes:
            obj = _object(mesh)
            _, prepared = timed(lambda obj=obj: pack_object(obj))  # type: ignore[misc]
            angles = [_angles(clench.solve(self.hand, obj, command)) for command in commands]
            first = first or angles
            self._compare(f"{len(mesh.triangles)} triangles", angles, first, SAME_SURFACE)
            axis.add(len(mesh.triangles), {**self._times(obj, commands), "prepare": prepared})
            self.advance()
        return axis

    def planes(self) -> Axis:
        """Solve with more and more planes; the set over the full width is the same."""
        axis = Axis("planes")
        first: list[FloatArray] = []
        for count in PLANES:
            commands = [
                GraspCommand(hand_pose=pose, preshape="open", planes=count, measure=False) for pose in self.poses
            ]
            angles = [_angles(clench.solve(self.hand, self.obj, command)) for command in commands]
            first = first or angles
            self._compare(f"{count} planes", angles, first, SAME)
            axis.add(count, self._times(self.obj, commands))
            self.advance()
        return axis

    def fingers(self) -> Axis:
        """Close the first fingers alone; they end where they do when more fingers close after them."""
        axis = Axis("fingers")
        names = tuple(finger.name for finger in self.hand.fingers)
        whole = [_angles(clench.solve(self.hand, self.obj, _command(pose, names))) for pose in self.poses]
        for count in range(1, len(names) + 1):
            commands = [_command(pose, names[:count]) for pose in self.poses]
            own = [j for finger in self.hand.fingers[:count] for j in finger.joints]
            angles = [_angles(clench.solve(self.hand, self.obj, command))[own] for command in commands]
            self._compare(f"{count} fingers", angles, [q[own] for q in whole], SAME)
            axis.add(count, self._times(self.obj, commands))
            self.advance()
        return axis

    def threads(self, many: Sequence[Pose]) -> Axis:
        """Solve poses at once with more and more threads, to the bit as alone."""
        return self._batches("threads", [(n, many[:AT_ONCE], n) for n in range(1, _cores() + 1)])

    def batch(self, many: Sequence[Pose], counts: Sequence[int]) -> Axis:
        """Solve more and more poses at once on one core, to the bit as alone."""
        return self._batches("batch", [(count, many[:count], 1) for count in counts])

    def _batches(self, name: str, rows: Sequence[tuple[int, Sequence[Pose], int]]) -> Axis:
        axis = Axis(name)
        kinds = {
            part: GraspCommand(hand_pose=Pose.identity(), preshape="open", full_width=full, measure=False)
            for part, full in (("certified", True), ("planes", False))
        }
        alone = {
            part: [_angles(clench.solve(self.hand, self.obj, replace(command, hand_pose=pose))) for pose in self.poses]
            for part, command in kinds.items()
        }
        for at, poses, threads in rows:
            taken = {}
            for part, command in kinds.items():
                solve = partial(
                    clench.solve_batch, self.hand, self.obj, poses, command, threads=threads, progress=False
                )
                some = min(len(poses), len(self.poses))
                self._compare(f"{name} {at}, {part}", list(solve().joint_angles[:some]), alone[part][:some], 0.0)
                taken[part] = min(timed(solve)[1] for _ in range(self.passes)) / len(poses)
            axis.add(at, taken)
            self.advance()
        return axis

    def _compare(self, what: str, found: Sequence[FloatArray], right: Sequence[FloatArray], tolerance: float) -> None:
        for k, (one, other) in enumerate(zip(found, right, strict=True)):
            off = float(np.abs(one - other).max(initial=0.0))
            if not off <= tolerance:
                self.report.errors.append(f"{what}, pose {k}: an angle is off by {off:.3g} rad.")
                return

    def _times(self, obj: GraspObject, commands: Sequence[GraspCommand]) -> dict[str, float]:
        """Return times of a solve and of its parts alone [s]: of every pose the quickest pass, then the median."""
        rows: list[list[dict[str, float]]] = [[] for _ in commands]
        for _ in range(self.passes):
            for row, command in zip(rows, commands, strict=True):
                flat = replace(command, full_width=False)
                whole, planar = (timed(partial(clench.solve, self.hand, obj, c))[1] for c in (command, flat))
                closing, planes = (stage_times(self.hand, obj, c)["close"] for c in (command, flat))
                row.append({"whole": whole, "planar": planar, "fingers": closing, "on_planes": planes})
        quickest = [{part: min(one[part] for one in row) for part in row[0]} for row in rows]
        return {part: float(np.median([one[part] for one in quickest])) for part in quickest[0]}


def _command(pose: Pose, fingers: tuple[str, ...]) -> GraspCommand:
    return GraspCommand(hand_pose=pose, preshape="open", fingers=fingers, measure=False)


def _angles(solution: GraspSolution) -> FloatArray:
    return np.array(list(solution.joint_angles.values()))
