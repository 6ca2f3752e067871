"""The benchmarks by name, with their options: entry point of `clench bench NAME`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, Literal

from clench.apps.cli.inputs.choices import Order, Source
from clench.apps.cli.parsing import parse_call
from clench.core.defaults import FRICTION, MASS
from clench.core.exceptions import UnknownNameError

from .bench_options import (
    Case,
    Common,
    Hands,
    Objects,
    Pages,
    Runs,
    at_least,
    drawable,
    print_report,
    writable,
)
from .user_commands import commands, hands, planning

_COMMON: Final = Common()
_HANDS: Final = Hands()
_PAGES: Final = Pages()
#: Five fingers of three joints each.
_FREE: Final = Case(hand="patent15")
_CASE: Final = Case()
_FINE: Final = Case(object="ellipsoid:a=0.03,b=0.035,c=0.05")
_SHAPES: Final = Objects(("sphere:r=0.035", "cylinder:r=0.03,h=0.12", "box:x=0.05,y=0.06,z=0.1", "mug"))
_HELD: Final = Objects(("ball", "bottle"))
_TRIED: Final = Objects(("mug", "bottle", "screwdriver", "ball"))
_SOLVES: Final = Runs(100, 5)
_BATCHES: Final = Runs(200, 5)
_CLOSINGS: Final = Runs(30, 5)
_PLACES: Final = Runs(10, 3)
_CHOICES: Final = Runs(20, 3)


def main(argv: Sequence[str]) -> int:
    """Run a benchmark.

    Args:
        argv: its name and its options.

    Returns:
        0; 1 when its answers are wrong, which it says before it measures anything; 2 for wrong options.

    Raises:
        ClenchError: bad input.
    """
    name, *rest = list(argv) or ["--help"]
    if name in ("-h", "--help"):
        lines = [f"  {n:<14}{(b.__doc__ or '').splitlines()[0]}" for n, b in BENCHMARKS.items()]
        sys.stdout.write("usage: clench bench NAME ...\n\nbenchmarks:\n" + "\n".join(lines) + "\n")
        return 0
    if name not in BENCHMARKS:
        raise UnknownNameError("benchmark", name, "clench bench", BENCHMARKS)
    return parse_call(f"clench bench {name}", BENCHMARKS[name], rest)()


def solve(
    *,
    case: Case = _FREE,
    runs: Runs = _SOLVES,
    collision_source: Source | None = None,
    order: Order = "proximal-first",
    planes: int = 5,
    common: Common = _COMMON,
) -> int:
    """Time solves of a whole hand from many approach poses, with their stages.

    Args:
        collision_source: geometry of the hand; its default without it.
        order: in which the joints close.
        planes: curl planes per finger.
    """
    import clench

    from .speed.solving import bench_solve

    runs.check()
    at_least(1, planes=planes)
    source = None if collision_source is None else clench.types.CollisionSource(collision_source)
    asked = clench.GraspCommand(
        hand_pose=clench.Pose.identity(),
        preshape="open",
        order=clench.ClosingOrder(order),
        planes=planes,
        collision_source=source,
        seed=common.seed,
    )
    return print_report(bench_solve(case, asked, runs), common)


def batch(
    *,
    case: Case = _FREE,
    runs: Runs = _BATCHES,
    planes: int = 5,
    stream: int = 2000,
    common: Common = _COMMON,
) -> int:
    """Time many solves at once, on one core and on all, with and without the full width, and stream poses.

    Args:
        planes: curl planes per finger.
        stream: how many poses are streamed.
    """
    from .speed.many_poses import bench_batch

    runs.check()
    at_least(1, planes=planes, stream=stream)
    return print_report(bench_batch(case, runs, planes, stream, common.seed), common)


def peers(
    *,
    hand: str = "robonaut2",
    objects: Objects = _SHAPES,
    runs: Runs = _CLOSINGS,
    planes: int = 5,
    simulate: bool = True,
    pages: Pages = _PAGES,
    common: Common = _COMMON,
) -> int:
    """Close by stepping as GraspIt!, Simox and OpenRAVE do, in MuJoCo, and by our solve: time, queries, gaps left.

    The picture shows cost against accuracy, with steps of several sizes.

    Args:
        hand: built-in name, or path to a .urdf or .xml file.
        planes: curl planes per finger.
        simulate: also close in MuJoCo.
    """
    from .peers.peers import PeerBench, bench_peers

    runs.check()
    at_least(1, planes=planes)
    pages.check()
    asked = PeerBench(runs, planes, common.seed, simulate, show_progress=not common.json)
    return print_report(bench_peers(hand, objects, asked, pages), common)


def scaling(
    *,
    case: Case = _FINE,
    runs: Runs = _PLACES,
    triangles: int = 1_300_000,
    batch: int = 1024,
    stream: int = 2000,
    pages: Pages = _PAGES,
    common: Common = _COMMON,
) -> int:
    """Time a solve against triangles, planes, fingers, threads and poses at once; memory of a fine mesh and a stream.

    The object's triangles are parted into four again and again. Of every place the quickest pass counts.

    Args:
        triangles: of the finest mesh, at most.
        batch: poses at once, at most.
        stream: how many poses are streamed.
    """
    from .speed.scaling import ScalingBench, bench_scaling

    runs.check()
    at_least(1, triangles=triangles, batch=batch, stream=stream)
    pages.check()
    asked = ScalingBench(runs, triangles, batch, stream, common.seed, show_progress=not common.json)
    return print_report(bench_scaling(case, asked, pages), common)


def packing(
    *,
    triangles: int = 1_000_000,
    passes: int = 3,
    points: int = 8,
    mesh: tuple[Path, ...] = (),
    common: Common = _COMMON,
) -> int:
    """Time how long a fine sphere and a scan take to load and to be packed for the kernels, and their memory.

    Args:
        triangles: of the sphere and of the scan, about.
        passes: how often each is timed; the quickest pass counts.
        points: whose distances are checked against all triangles.
        mesh: files to time besides.
    """
    from .speed.packing_time import PackingBench, bench_packing

    at_least(12, triangles=triangles)
    at_least(1, passes=passes, points=points)
    return print_report(bench_packing(PackingBench(triangles, passes, points, common.seed), mesh), common)


def choose(*, case: Case = _FREE, runs: Runs = _CHOICES, alternatives: int = 8, common: Common = _COMMON) -> int:
    """Time the choice over all fingers, with criteria that add up and with steadiness.

    Args:
        alternatives: sets per finger.
    """
    from .speed.choice_timing import bench_choice

    runs.check()
    at_least(1, alternatives=alternatives)
    return print_report(bench_choice(case, runs, alternatives, common.seed), common)


def steadiness(
    *,
    contacts: int = 12,
    grasps: int = 40,
    passes: int = 3,
    plot: Path | None = None,
    common: Common = _COMMON,
) -> int:
    """Time epsilon, its fast lower bound and volume of random grasps, and the forces of a hand on a sphere.

    Args:
        contacts: of every grasp.
        grasps: how many.
        passes: how often each is timed.
        plot: file (.png, .pdf, .svg, …) for a picture of the lower bound and the exact value, for 3 contacts and more.
    """
    from .speed.epsilon_timing import bench_steadiness

    at_least(2, contacts=contacts)
    at_least(1, grasps=grasps, passes=passes)
    drawable(plot)
    return print_report(bench_steadiness(contacts, grasps, passes, common.seed, plot), common)


def hold(
    *,
    hands: Hands = _HANDS,
    objects: Objects = _HELD,
    proposals: int = 200,
    best: int = 5,
    others: int = 5,
    test: Literal["pulls", "lift"] = "pulls",
    mass: float = MASS,
    friction: float = FRICTION,
    table: Path | None = None,
    trials: Path | None = None,
    common: Common = _COMMON,
) -> int:
    """Plan grasps, and see in simulation whether the best ones hold.

    Args:
        proposals: of the planner per hand and object.
        best: how many of the grasps are tried, the best by score.
        others: grasps over all scores that are tried besides, to see what the score is worth.
        test: pull in six directions without gravity, or lift from a table.
        mass: of the object, kg.
        friction: of its contacts.
        table: file for a table (Markdown).
        trials: file for every grasp that was tried, with its reports (JSON).
    """
    from clench.execution.simulation.hold import Hold

    from .holding.hold_bench import HoldBench, HoldFiles, bench_hold

    at_least(1, proposals=proposals, best=best)
    at_least(0, others=others, seed=common.seed)
    writable(table, trials)
    asked = HoldBench(proposals, best, others, common.seed, Hold(mass=mass, friction=friction, test=test))
    files = HoldFiles(table, trials)
    return print_report(bench_hold(hands, objects, asked, files, show_progress=not common.json), common)


def confidence(
    *,
    hands: Hands = _HANDS,
    objects: Objects = _TRIED,
    proposals: int = 128,
    grasps: int = 6,
    mass: float = MASS,
    friction: float = FRICTION,
    out: Path | None = None,
    common: Common = _COMMON,
) -> int:
    """Try planned grasps of all scores in simulation, and tabulate the share that holds: the confidence of a score.

    Args:
        proposals: per hand and object.
        grasps: tried of them, spread evenly over the scores.
        mass: of the objects [kg].
        friction: of all contacts.
        out: file for the table (JSON), as `src/clench/planner/confidence.json`.
    """
    from clench.execution.simulation.hold import Hold

    from .holding.confidence_bench import ConfidenceBench, bench_confidence

    at_least(1, proposals=proposals, grasps=grasps)
    writable(out)
    asked = ConfidenceBench(proposals, grasps, common.seed, Hold(mass=mass, friction=friction))
    return print_report(bench_confidence(hands, objects, asked, out, show=not common.json), common)


def displacement(
    *,
    case: Case = _CASE,
    grasps: int = 3,
    proposals: int = 200,
    draws: int = 16,
    distances: tuple[float, ...] = (0.0, 0.002, 0.004, 0.006, 0.008, 0.01),
    sigma: float = 0.005,
    common: Common = _COMMON,
) -> int:
    """Carry planned grasps out while the object stands elsewhere, and count those that hold.

    Args:
        grasps: tried of each plan, the best ones.
        proposals: of each plan.
        draws: directions of every displacement.
        distances: of the displacements [m]; the object also turns by 0.6 degrees for every millimetre.
        sigma: what robust grasps are planned for [m].
    """
    from clench.execution.simulation.hold import Hold

    from .holding.displacement_bench import DisplacementBench, bench_displacement

    at_least(1, grasps=grasps, proposals=proposals, draws=draws)
    asked = DisplacementBench(grasps, proposals, draws, distances, sigma, common.seed, Hold())
    return print_report(bench_displacement(case, asked, show=not common.json), common)


BENCHMARKS: dict[str, Callable[..., int]] = {
    "solve": solve,
    "batch": batch,
    "hands": hands,
    "commands": commands,
    "planning": planning,
    "packing": packing,
    "choose": choose,
    "steadiness": steadiness,
    "peers": peers,
    "scaling": scaling,
    "hold": hold,
    "confidence": confidence,
    "displacement": displacement,
}
