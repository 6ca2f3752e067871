"""The benchmark of steadiness: epsilon, volume and the fast bound of random grasps, and the forces of a real one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import clench
from clench.apps.figures.drawing.style import CHOSEN, FAINT, INK, new_figure, save_figure
from clench.core.pose import FloatArray
from clench.mechanics.epsilon.epsilon_quality import EDGES, epsilon, epsilon_bound
from clench.mechanics.epsilon.wrench_space import volume_l1
from clench.mechanics.forces.actuation import HoldingForces, least_effort
from clench.mechanics.forces.squeeze import squeeze_forces
from clench.mechanics.grasp.contacts import make_contacts
from clench.mechanics.grasp.held import HeldObject, held_by_contacts
from clench.mechanics.grasp.loads import six_pulls_and_twists, weight
from clench.solver.analysis.holding import hold

from ..bench_report import BenchReport, describe_place, timed

#: Two computations of epsilon may differ by this [-].
_AGREEMENT = 1e-6
#: The same seed's contacts are around a unit sphere, moved and turned by about this [-].
_NOISE = 0.1
_FRICTION = 0.5
_FEWEST = 3


class _Grasp(NamedTuple):
    held: HeldObject
    exact: float
    bound: float


def bench_steadiness(contacts: int, grasps: int, passes: int, seed: int, plot: Path | None) -> BenchReport:
    """Check epsilon and its bound on random grasps, then time them, and the forces of a hand on a sphere.

    Args:
        contacts: of every timed grasp. grasps: how many. passes: how often each is timed. seed: of the grasps.
        plot: where the bound is drawn against the exact value, for 3 to `contacts` contacts.
    """
    report = BenchReport(values={"benchmark": "steadiness", **describe_place()})
    rng = np.random.default_rng(seed)
    report.values |= {
        "contacts": contacts,
        "grasps": grasps,
        "passes": passes,
        "seed": seed,
        "edges": EDGES,
        "friction": _FRICTION,
        "norm": "L1",
        "contact_model": "point",
    }
    found = [_checked(report, _random_grasp(rng, contacts)) for _ in range(grasps)]
    if report.errors:
        return report
    _describe_bound(report, "bound", found)
    for name, function in (
        ("epsilon", lambda held: epsilon(held)),
        ("bound", lambda held: epsilon_bound(held)),
        ("volume", lambda held: volume_l1(held.edge_wrenches(EDGES))),
    ):
        report.distribution(name, _times(function, [g.held for g in found], passes))
    _time_forces(report, passes)
    if plot is not None:
        fewer = [
            _checked(report, _random_grasp(rng, int(rng.integers(min(_FEWEST, contacts), contacts + 1))))
            for _ in range(3 * grasps)
        ]
        draw_bound([*found, *fewer], plot)
        report.values["plot"] = str(plot)
    return report


def draw_bound(grasps: Sequence[_Grasp], path: Path) -> Path:
    """Draw the fast lower bound against the exact epsilon, and the ratio of both by the number of contacts."""
    closed = [g for g in grasps if g.exact > 0.0]
    exact, bound = (np.array([getattr(g, key) for g in closed]) for key in ("exact", "bound"))
    counts = np.array([len(g.held.contacts) for g in closed])
    figure = new_figure(1100, 480)
    left, right = figure.subplots(1, 2)
    top = float(exact.max(initial=0.1)) * 1.05
    left.plot([0.0, top], [0.0, top], color=INK, linewidth=1)
    left.scatter(exact, bound, s=12, color=CHOSEN, alpha=0.6, linewidths=0)
    left.set(xlim=(0, top), ylim=(0, top), xlabel="epsilon, exact (L1, 8 edges)", ylabel="epsilon, fast lower bound")
    left.set_title(f"{len(closed)} random grasps with force closure", fontsize=10)
    left.text(0.55 * top, 0.6 * top, "equal", color=INK, fontsize=9, rotation=40)
    present = sorted(set(counts.tolist()))
    right.boxplot([bound[counts == c] / exact[counts == c] for c in present], medianprops={"color": CHOSEN})
    right.set_xticks(range(1, len(present) + 1), [str(c) for c in present])
    right.set(xlabel="contacts", ylabel="lower bound / exact", ylim=(0, 1.05))
    right.axhline(1.0, color=FAINT, linewidth=1)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    figure.tight_layout()
    return save_figure(figure, path)


def _random_grasp(rng: np.random.Generator, count: int) -> HeldObject:
    n = rng.normal(size=(count, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    places, normals = (sign * n + _NOISE * rng.normal(size=n.shape) for sign in (-1.0, 1.0))
    return held_by_contacts(make_contacts(places, normals, _FRICTION), np.zeros(3), 1.0)


def _checked(report: BenchReport, held: HeldObject) -> _Grasp:
    """Compare epsilon with that of the hull of all wrenches at once, and the bound with epsilon."""
    exact, bound = epsilon(held).radius, epsilon_bound(held)
    whole = _radius_of_hull(held.edge_wrenches(EDGES).reshape(-1, 6))
    if abs(whole - exact) > _AGREEMENT:
        report.errors.append(f"epsilon by expansion is {exact:.9f}, by the whole hull {whole:.9f}.")
    if bound > exact + _AGREEMENT:
        report.errors.append(f"the lower bound {bound:.9f} is above epsilon, {exact:.9f}.")
    return _Grasp(held, exact, bound)


def _radius_of_hull(points: FloatArray) -> float:
    from scipy.spatial import ConvexHull

    hull = ConvexHull(np.vstack([points, np.zeros((1, points.shape[1]))]))
    return max(0.0, float(-hull.equations[:, -1].max()))


def _describe_bound(report: BenchReport, key: str, grasps: Sequence[_Grasp]) -> None:
    closed = [g for g in grasps if g.exact > 0.0]
    report.values["force_closure"] = len(closed)
    if closed:
        parts = np.array([g.bound / g.exact for g in closed])
        for name, percent in (("p5", 5), ("median", 50), ("p95", 95)):
            report.values[f"{key}_of_exact_{name}"] = float(np.percentile(parts, percent))


def _time_forces(report: BenchReport, passes: int) -> None:
    """Time the least torque for one load, and the squeeze, of the built-in hand on a sphere; check the results."""
    hand, ball = clench.Hand.load("robonaut2"), clench.GraspObject.load("sphere:r=0.03")
    pose = clench.approach_poses(hand, ball, 1, 1)[0]
    solution = clench.solve(hand, ball, clench.GraspCommand(hand_pose=pose, preshape="open"))
    grasp = hold(solution, hand, ball, friction=0.8)
    load = weight(0.2, grasp.palm_direction([0.0, 0.0, -1.0]))[0]
    pulls = six_pulls_and_twists(float(np.linalg.norm(load)))
    plans = [least_effort(grasp.held, load), squeeze_forces(grasp.held, load, pulls).plan]
    for name, plan in zip(("least torque", "squeeze"), plans, strict=True):
        if plan is None or not _balanced(grasp.held, plan):
            report.errors.append(f"the forces of the {name} do not balance the load inside the cones.")
    report.values["forces_contacts"] = len(grasp.contacts)
    report.distribution("least_torque", _times(lambda held: least_effort(held, load), [grasp.held], 10 * passes))
    report.distribution("squeeze", _times(lambda held: squeeze_forces(held, load, pulls), [grasp.held], 5 * passes))


def _balanced(held: HeldObject, plan: HoldingForces) -> bool:
    off = np.abs(held.grasp_map @ plan.forces.reshape(-1) + plan.load).max()
    return bool(off <= 1e-9 and held.contacts.cone_slack(plan.forces).min() >= -1e-8)


def _times(function: Callable[[HeldObject], Any], cases: Sequence[HeldObject], passes: int) -> list[float]:
    function(cases[0])  # compiles, or loads what is compiled
    return [timed(lambda held=held: function(held))[1] for _ in range(passes) for held in cases]  # type: ignore[misc]
