"""Entry point of `clench bench NAME`: choose the benchmark, print what it measured."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

from clench.apps.cli.parsing import parse_call
from clench.base.defaults import FRICTION, MASS
from clench.base.errors import CommandError, UnknownNameError

from .bench_options import at_least, drawable, print_report, writable
from .planning_benchmarks import confidence, displacement


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
    hand: str = "patent15",
    object: str = "mug",
    scale: float = 1.0,
    collision_source: Literal["engine", "raw", "visual"] | None = None,
    order: Literal["proximal-first", "together", "fingertip"] = "proximal-first",
    planes: int = 5,
    poses: int = 100,
    passes: int = 5,
    seed: int = 0,
    json: bool = False,
) -> int:
    """Time solves of a whole hand from many approach poses, with their stages.

    Args:
        hand: built-in name, or path to a .urdf or .xml file.
        object: built-in name, path to a mesh, or a shape such as cylinder:r=0.03,h=0.1.
        scale: multiplies the object's lengths, e.g. 0.001 for a mesh in millimetres.
        collision_source: geometry of the hand; its default without it.
        order: in which the joints close.
        planes: curl planes per finger.
        poses: how many approach poses are solved.
        passes: how often each is timed.
        seed: of the approach poses.
        json: print one JSON document on standard output.
    """
    import clench

    from .solving import bench_solve

    at_least(1, planes=planes, poses=poses, passes=passes)
    source = None if collision_source is None else clench.CollisionSource(collision_source)
    asked = clench.GraspCommand(
        hand_pose=clench.Pose.identity(),
        preshape="open",
        order=clench.ClosingOrder(order),
        planes=planes,
        collision_source=source,
        seed=seed,
    )
    return print_report(bench_solve(hand, object, scale, asked, poses, passes), json)


def batch(
    *,
    hand: str = "patent15",
    object: str = "mug",
    scale: float = 1.0,
    planes: int = 5,
    poses: int = 200,
    passes: int = 5,
    stream: int = 2000,
    seed: int = 0,
    json: bool = False,
) -> int:
    """Time many solves at once, on one core and on all, with and without the full width, and stream poses.

    Args:
        hand: built-in name, or path to a .urdf or .xml file.
        object: built-in name, path to a mesh, or a shape such as cylinder:r=0.03,h=0.1.
        scale: multiplies the object's lengths, e.g. 0.001 for a mesh in millimetres.
        planes: curl planes per finger.
        poses: how many approach poses are solved.
        passes: how often they are timed.
        stream: how many poses are streamed.
        seed: of the approach poses.
        json: print one JSON document on standard output.
    """
    from .batching import bench_batch

    at_least(1, planes=planes, poses=poses, passes=passes, stream=stream)
    return print_report(bench_batch(hand, object, scale, planes, poses, passes, stream, seed), json)


def peers(
    *,
    hand: str = "robonaut2",
    object: tuple[str, ...] = ("sphere:r=0.035", "cylinder:r=0.03,h=0.12", "box:x=0.05,y=0.06,z=0.1", "mug"),
    scale: float = 1.0,
    planes: int = 5,
    poses: int = 30,
    passes: int = 5,
    seed: int = 0,
    simulate: bool = True,
    plot: Path | None = None,
    table: Path | None = None,
    json: bool = False,
) -> int:
    """Close by stepping as GraspIt!, Simox and OpenRAVE do, in MuJoCo, and by our solve: time, queries, gaps left.

    Args:
        hand: built-in name, or path to a .urdf or .xml file.
        object: built-in names, paths to meshes, or shapes such as cylinder:r=0.03,h=0.1.
        scale: multiplies the objects' lengths, e.g. 0.001 for meshes in millimetres.
        planes: curl planes per finger.
        poses: how many approach poses per object.
        passes: how often each is timed, all kinds in turn.
        seed: of the approach poses.
        simulate: also close in MuJoCo.
        plot: file (.png, .pdf, .svg, …) for a picture of cost against accuracy, with steps of several sizes.
        table: file for a table (Markdown).
        json: print one JSON document on standard output.
    """
    from .peers import PeerBench, bench_peers

    at_least(1, planes=planes, poses=poses, passes=passes)
    drawable(plot)
    writable(table)
    asked = PeerBench(planes, poses, passes, seed, simulate, show_progress=not json)
    return print_report(bench_peers(hand, object, scale, asked, plot, table), json)


def scaling(
    *,
    hand: str = "robonaut2",
    object: str = "ellipsoid:a=0.03,b=0.035,c=0.05",
    scale: float = 1.0,
    poses: int = 10,
    passes: int = 3,
    triangles: int = 1_300_000,
    batch: int = 1024,
    stream: int = 2000,
    seed: int = 0,
    plot: Path | None = None,
    table: Path | None = None,
    json: bool = False,
) -> int:
    """Time a solve against triangles, planes, fingers, threads and poses at once; memory of a fine mesh and a stream.

    Args:
        hand: built-in name, or path to a .urdf or .xml file.
        object: built-in name, path to a mesh, or a shape; its triangles are parted into four again and again.
        scale: multiplies the object's lengths, e.g. 0.001 for a mesh in millimetres.
        poses: how many approach poses are solved at every place.
        passes: how often each is timed; the quickest counts.
        triangles: of the finest mesh, at most.
        batch: poses at once, at most.
        stream: how many poses are streamed.
        seed: of the approach poses.
        plot: file (.png, .pdf, .svg, …) for a picture of every axis.
        table: file for a table of every axis (Markdown).
        json: print one JSON document on standard output.
    """
    from .scaling import ScalingBench, bench_scaling

    at_least(1, poses=poses, passes=passes, triangles=triangles, batch=batch, stream=stream)
    drawable(plot)
    writable(table)
    asked = ScalingBench(poses, passes, triangles, batch, stream, seed, show_progress=not json)
    return print_report(bench_scaling(hand, object, scale, asked, plot, table), json)


def choose(
    *,
    hand: str = "patent15",
    object: str = "mug",
    alternatives: int = 8,
    poses: int = 20,
    passes: int = 3,
    seed: int = 0,
    json: bool = False,
) -> int:
    """Time the choice over all fingers, with criteria that add up and with steadiness.

    Args:
        hand: built-in name, or path to a .urdf or .xml file.
        object: built-in name, path to a mesh, or a shape such as cylinder:r=0.03,h=0.1.
        alternatives: sets per finger.
        poses: how many approach poses are chosen for.
        passes: how often each is timed.
        seed: of the approach poses.
        json: print one JSON document on standard output.
    """
    from .choosing import bench_choice

    at_least(1, alternatives=alternatives, poses=poses, passes=passes)
    return print_report(bench_choice(hand, object, alternatives, poses, passes, seed), json)


def steadiness(
    *,
    contacts: int = 12,
    grasps: int = 40,
    passes: int = 3,
    seed: int = 0,
    plot: Path | None = None,
    json: bool = False,
) -> int:
    """Time epsilon, its fast lower bound and volume of random grasps, and the forces of a hand on a sphere.

    Args:
        contacts: of every grasp.
        grasps: how many.
        passes: how often each is timed.
        seed: of the grasps.
        plot: file (.png, .pdf, .svg, …) for a picture of the lower bound and the exact value, for 3 contacts and more.
        json: print one JSON document on standard output.
    """
    from .steadiness import bench_steadiness

    at_least(2, contacts=contacts)
    at_least(1, grasps=grasps, passes=passes)
    drawable(plot)
    return print_report(bench_steadiness(contacts, grasps, passes, seed, plot), json)


def hold(
    *,
    hand: tuple[str, ...] = ("robonaut2",),
    object: tuple[str, ...] = ("ball", "bottle"),
    scale: float = 1.0,
    proposals: int = 200,
    best: int = 5,
    others: int = 5,
    test: Literal["pulls", "lift"] = "pulls",
    mass: float = MASS,
    friction: float = FRICTION,
    seed: int = 0,
    table: Path | None = None,
    trials: Path | None = None,
    json: bool = False,
) -> int:
    """Plan grasps, and see in simulation whether the best ones hold.

    Args:
        hand: built-in names, or paths to .urdf or .xml files.
        object: built-in names, paths to meshes, or shapes such as cylinder:r=0.03,h=0.1.
        scale: multiplies the objects' lengths, e.g. 0.001 for meshes in millimetres.
        proposals: of the planner per hand and object.
        best: how many of the grasps are tried, the best by score.
        others: grasps over all scores that are tried besides, to see what the score is worth.
        test: pull in six directions without gravity, or lift from a table.
        mass: of the object, kg.
        friction: of its contacts.
        seed: of the planner.
        table: file for a table (Markdown).
        trials: file for every grasp that was tried, with its reports (JSON).
        json: print one JSON document on standard output.
    """
    from clench.execution.hold import Hold

    from .holding import HoldBench, HoldFiles, bench_hold

    for key, count, least in (("proposals", proposals, 1), ("best", best, 1), ("others", others, 0), ("seed", seed, 0)):
        if count < least:
            raise CommandError(f"--{key}: expected at least {least}, got {count}.")
    writable(table, trials)
    asked = HoldBench(proposals, best, others, seed, Hold(mass=mass, friction=friction, test=test))
    return print_report(bench_hold(hand, object, scale, asked, HoldFiles(table, trials), show_progress=not json), json)


BENCHMARKS: dict[str, Callable[..., int]] = {
    "confidence": confidence,
    "displacement": displacement,
    "solve": solve,
    "batch": batch,
    "choose": choose,
    "steadiness": steadiness,
    "hold": hold,
    "peers": peers,
    "scaling": scaling,
}
