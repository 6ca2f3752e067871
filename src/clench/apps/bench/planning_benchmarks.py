"""The benchmarks of planned grasps that need a simulation: confidence, and displaced objects."""

from __future__ import annotations

from pathlib import Path

from clench.base.defaults import FRICTION, MASS

from .bench_options import at_least, print_report, writable


def confidence(
    *,
    hands: tuple[str, ...] = ("robonaut2",),
    objects: tuple[str, ...] = ("mug", "bottle", "screwdriver", "ball"),
    scale: float = 1.0,
    proposals: int = 128,
    grasps: int = 6,
    mass: float = MASS,
    friction: float = FRICTION,
    seed: int = 0,
    out: Path | None = None,
    json: bool = False,
) -> int:
    """Try planned grasps of all scores in simulation, and tabulate the share that holds: the confidence of a score.

    Args:
        hands: built-in names, or paths to .urdf or .xml files.
        objects: built-in names, paths to meshes, or shapes such as cylinder:r=0.03,h=0.1.
        scale: multiplies the objects' lengths, e.g. 0.001 for meshes in millimetres.
        proposals: per hand and object.
        grasps: tried of them, spread evenly over the scores.
        mass: of the objects [kg].
        friction: of all contacts.
        seed: of the proposals.
        out: file for the table (JSON), as `src/clench/planner/confidence.json`.
        json: print one JSON document on standard output.
    """
    from clench.execution.hold import Hold

    from .confidence_bench import ConfidenceBench, bench_confidence

    at_least(1, proposals=proposals, grasps=grasps)
    writable(out)
    asked = ConfidenceBench(proposals, grasps, seed, Hold(mass=mass, friction=friction))
    return print_report(bench_confidence(hands, objects, scale, asked, out, not json), json)


def displacement(
    *,
    hand: str = "robonaut2",
    object: str = "mug",
    scale: float = 1.0,
    grasps: int = 3,
    proposals: int = 200,
    draws: int = 16,
    distances: tuple[float, ...] = (0.0, 0.002, 0.004, 0.006, 0.008, 0.01),
    sigma: float = 0.005,
    seed: int = 0,
    json: bool = False,
) -> int:
    """Carry planned grasps out while the object stands elsewhere, and count those that hold.

    Args:
        hand: built-in name, or path to a .urdf or .xml file.
        object: built-in name, path to a mesh, or a shape such as cylinder:r=0.03,h=0.1.
        scale: multiplies the object's lengths, e.g. 0.001 for a mesh in millimetres.
        grasps: tried of each plan, the best ones.
        proposals: of each plan.
        draws: directions of every displacement.
        distances: of the displacements [m]; the object also turns by 0.6 degrees for every millimetre.
        sigma: what robust grasps are planned for [m].
        seed: of plans and directions.
        json: print one JSON document on standard output.
    """
    from clench.execution.hold import Hold

    from .displacement_bench import DisplacementBench, bench_displacement

    at_least(1, grasps=grasps, proposals=proposals, draws=draws)
    asked = DisplacementBench(grasps, proposals, draws, distances, sigma, seed, Hold())
    return print_report(bench_displacement(hand, object, scale, asked, not json), json)
