"""The command that plans grasps: no wrist pose is needed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from clench.apps.cli.inputs.choices import Kind
from clench.apps.cli.inputs.scene_options import with_scene
from clench.apps.cli.parsing import as_angle, as_range

if TYPE_CHECKING:
    from clench.execution.simulation.hold import HoldReport
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject
    from clench.planner.grasp_plan import GraspPlan, PlannedGrasp


def plan(
    *,
    hand: str,
    object: str,
    count: int = 10,
    hand_file: Path | None = None,
    palm: str | None = None,
    scale: float = 1.0,
    friction: tuple[float, ...] = (),
    mass: tuple[float, ...] = (),
    gravity: tuple[float, float, float] | None = None,
    kinds: tuple[Kind, ...] = (),
    fingers: tuple[str, ...] = (),
    min_fingers: int = 2,
    approach: tuple[float, float, float] | None = None,
    approach_angle: float = 45.0,
    table: tuple[float, ...] | None = None,
    obstacle: tuple[str, ...] = (),
    pose_sigma: float | None = None,
    apart: float | None = None,
    effort: int | None = None,
    most: int | None = None,
    seconds: float | None = None,
    seed: int = 0,
    threads: int | None = None,
    without_path: bool = False,
    hold: bool = False,
    out: Path | None = None,
    html: Path | None = None,
    json: bool = False,
) -> int:
    """Plan grasps of an object: wrist poses, preshapes, contacts, squeezes and free paths (docs/planning.md).

    Args:
        hand: built-in name, path to a .urdf or .xml file, or a name that clench[hands] finds (docs/own-hand.md).
        object: built-in name, path to a mesh, or a shape such as cylinder:r=0.03,h=0.1.
        count: number of grasps.
        hand_file: TOML file that overrides the interpretation of the hand's model.
        palm: name of the palm link, to pick a hand inside a whole robot.
        scale: multiplies the object's lengths, e.g. 0.001 for a mesh in millimetres.
        friction: friction between links and object; two numbers are a range; by default the values of hand file and
            object, else 0.6.
        mass: mass of the object [kg]; two numbers are a range; 0.1 by default.
        gravity: direction of gravity in the world; by default every direction.
        kinds: kinds of grasps; any by default.
        fingers: names of the fingers that may close; all by default.
        min_fingers: smallest number of fingers that touch.
        approach: direction in the world in which the palm approaches.
        approach_angle: largest angle between the palm's direction and --approach [degrees].
        table: put a table under the object: at its lowest point, or with its top at this height of the world [m].
        obstacle: obstacle in the world, as MESH_OR_SHAPE@x,y,z or MESH_OR_SHAPE@x,y,z,qw,qx,qy,qz [m]; may be given
            several times (docs/surroundings.md).
        pose_sigma: standard deviation of the object's position [m]; the object also turns by 0.6 degrees for every
            millimetre.
        apart: smallest difference of two grasps: a root mean square over all links [m]; 0.02 by default.
        effort: number of proposals per grasp; the best of them is returned; 40 by default.
        most: largest number of proposals.
        seconds: time after which no proposal begins [s].
        seed: seed of the proposals; the same seed gives the same grasps.
        threads: number of threads; all cores by default.
        without_path: leave out the free paths, which take most of the time.
        hold: test every grasp in simulation: close on the free object, squeeze, pull in six directions
            (docs/hold.md); the exit code is 1 if an object is dropped.
        out: folder for plan.json, the solution and trajectory of every grasp, and pictures: the best grasps, where
            all of them touch the object, and the zones in which the hand grasps.
        html: file (.html) for a page that shows all grasps in any browser, without a network (docs/pictures.md).
        json: print one JSON document on standard output.
    """
    import clench
    from clench.apps.cli.output.plan_table import print_plan
    from clench.apps.cli.output.printing import print_files
    from clench.apps.cli.output.results import print_json
    from clench.apps.pages.page_files import check_page
    from clench.closing.collision.sizes import warn_of_size
    from clench.core.files.json_files import check_folder
    from clench.kernels.runtime.warming import warm_up

    if out is not None:
        check_folder(out)
    if html is not None:
        check_page(html, out)
    asked: dict[str, Any] = {
        "friction": as_range(friction, "--friction"),
        "gravity": gravity,
        "kinds": kinds or None,
        "fingers": fingers or None,
        "min_fingers": min_fingers,
        "approach": approach,
        "approach_angle": as_angle(approach_angle, "--approach-angle"),
        "pose_sigma": pose_sigma,
        "most": most,
        "seconds": seconds,
        "seed": seed,
        "threads": threads,
        "path": not without_path,
    }
    given = {"mass": as_range(mass, "--mass"), "apart": apart, "effort": effort}
    asked |= {key: value for key, value in given.items() if value is not None}
    the_hand = clench.Hand.load(hand, hand_file=hand_file, palm=palm)
    the_object = clench.GraspObject.load(object, scale=scale)
    the_object = with_scene(the_object, None, table, obstacle)
    warn_of_size(the_hand, the_object)
    warm_up(motions=True)
    found = _searched(the_hand, the_object, count, asked)
    held = [_held(grasp, the_hand, the_object, asked["friction"]) for grasp in found] if hold else []
    document = found.to_dict()
    for entry, report in zip(document["grasps"], held, strict=False):
        entry["hold"] = report.to_dict()
    files = [] if out is None else _write(found, document, out)
    if out is not None:
        from clench.apps.figures import draw_plan

        files += draw_plan(found, the_hand, the_object, out, [report.held for report in held] if hold else None)
    if html is not None and len(found):
        files.append(clench.write_page(html, the_hand, the_object, found))
    if json:
        print_json(document)
    else:
        print_plan(document, found.text)
        print_files(files)
    return 0 if len(found) and all(report.held for report in held) else 1


def _searched(hand: Hand, obj: GraspObject, count: int, asked: dict[str, Any]) -> GraspPlan:
    """Return the plan; a bar on standard error counts the grasps that are found."""
    import clench
    from clench.solver.batch.batch_progress import shown

    search = clench.iter_grasps(hand, obj, count, **asked)
    with shown(count, None) as advance:
        for _ in search:
            advance(1)
    return search.plan()


def _held(grasp: PlannedGrasp, hand: Hand, obj: GraspObject, friction: Any) -> HoldReport:
    from clench.core.defaults import FRICTION
    from clench.execution.simulation.hold import Hold
    from clench.execution.simulation.piece_hold import hold_as_collided
    from clench.execution.trajectory import plan_trajectory
    from clench.mechanics.grasp.contacts import friction_range

    # Tried at the largest mass and the lowest friction that were planned for.
    lowest = FRICTION if friction is None else friction_range(friction)[0]
    way = grasp.trajectory or plan_trajectory(grasp.solution, hand, obj=obj, force=True)
    return hold_as_collided(grasp.solution, hand, obj, Hold(mass=grasp.squeeze.mass, friction=lowest), way)


def _write(found: GraspPlan, document: dict[str, Any], folder: Path) -> list[Path]:
    """Write the plan, and the solution and trajectory of every grasp; return the paths of the files."""
    from clench.core.files.file_bytes import make_folder
    from clench.core.files.json_files import write_json

    make_folder(folder)
    write_json(folder / "plan.json", document, "plan")
    written = [folder / "plan.json"]
    for number, grasp in enumerate(found, start=1):
        written.append(folder / f"grasp-{number:02}.json")
        grasp.solution.save(written[-1])
        if grasp.trajectory is not None:
            written.append(folder / f"grasp-{number:02}-trajectory.json")
            grasp.trajectory.save(written[-1])
    return written
