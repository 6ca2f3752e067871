"""The benchmark of displaced objects: planned grasps are carried out while the object stands elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import clench
from clench.core.pose import FloatArray, Pose
from clench.execution.simulation.convex_pieces import in_pieces
from clench.execution.simulation.hold import Hold
from clench.execution.simulation.pulling import hold_and_pull
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.objects.mass import mass_properties
from clench.planner.grasp_plan import GraspPlan

from ..bench_options import Case
from ..bench_report import BenchReport, Value, describe_place
from .proportions import wilson

#: How far an object turns for every millimetre of its displacement [rad/mm].
TURN = float(np.deg2rad(0.6))


@dataclass(frozen=True)
class DisplacementBench:
    """The settings of the trial.

    Args:
        grasps: of each plan. proposals: of each plan. draws: directions of every displacement, the same for all grasps.
        distances: of the displacements [m]. sigma: what robust grasps are planned for [m]. seed: of plans and draws.
        hold: the test.
    """

    grasps: int
    proposals: int
    draws: int
    distances: Sequence[float]
    sigma: float
    seed: int
    hold: Hold


def bench_displacement(case: Case, asked: DisplacementBench, *, show: bool) -> BenchReport:
    """Plan the best grasps for an object in place and for a displaced one, and hold displaced objects with both.

    Args:
        case: the loaded models. asked: settings of the trial. show: show a bar.
    """
    hand, loaded = case.load()
    obj = in_pieces(loaded, show_progress=show)
    report = BenchReport(values={"benchmark": "displacement", **describe_place()})
    for name, sigma in (("in_place", None), ("robust", asked.sigma)):
        plan = clench.plan_grasps(
            hand,
            obj,
            asked.grasps,
            pose_sigma=sigma,
            most=asked.proposals,
            effort=max(asked.proposals // asked.grasps, 1),
            friction=asked.hold.friction,
            mass=asked.hold.mass,
            seed=asked.seed,
        )
        report.values[f"{name}.grasps"] = len(plan)
        for distance in asked.distances:
            held = _held(plan, hand, obj, distance, asked)
            report.values |= _share(f"{name}.{1e3 * distance:g}mm", held)
    return report


def displaced_poses(obj: GraspObject, distance: float, draws: int, seed: int) -> list[Pose]:
    """Return poses of an object that is off by a distance in random directions, and turned by 0.6° per mm.

    It turns about its centre of mass.

    Args:
        obj: the object. distance: [m]. draws: how many. seed: the same for every distance gives the same directions.
    """
    rng = np.random.default_rng(seed)
    middle = obj.pose.apply(mass_properties(obj).center)
    poses = []
    for _ in range(draws):
        way, axis = _direction(rng), _direction(rng)
        half = 0.5 * TURN * distance * 1e3
        turn = Pose(wxyz=[np.cos(half), *(np.sin(half) * axis)])
        moved = Pose(middle + distance * way) @ turn @ Pose(-middle)
        poses.append(moved @ obj.pose)
    return poses


def _held(plan: GraspPlan, hand: Hand, obj: GraspObject, distance: float, asked: DisplacementBench) -> list[bool]:
    """Return whether every grasp held the object at every displacement."""
    outcomes = []
    for grasp in plan:
        way = grasp.trajectory
        if way is None:
            continue
        for pose in displaced_poses(obj, distance, asked.draws if distance else 1, asked.seed):
            outcomes.append(hold_and_pull(grasp.solution, hand, obj.posed(pose), asked.hold, way).held)
    return outcomes


def _share(key: str, held: Sequence[bool]) -> dict[str, Value]:
    low, high = wilson(sum(held), len(held))
    return {key: f"{sum(held)} of {len(held)} held ({100 * low:.0f}-{100 * high:.0f} %)"}


def _direction(rng: np.random.Generator) -> FloatArray:
    vector = rng.normal(size=3)
    unit: FloatArray = vector / np.linalg.norm(vector)
    return unit
