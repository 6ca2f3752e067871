"""The command that opens the viewer: a page in the browser that solves while the user drags."""

from __future__ import annotations

import contextlib
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clench.apps.cli.inputs.choices import Kind, Order, Source
from clench.apps.cli.inputs.command_files import read_command
from clench.apps.cli.inputs.scene_options import SceneOptions, scene_code, with_scene
from clench.apps.cli.parsing import as_angle, as_range
from clench.core.exceptions import CommandError

if TYPE_CHECKING:
    from clench.apps.viewer.grasps.listed_grasp import ListedGrasp
    from clench.apps.viewer.opening import Given
    from clench.apps.viewer.session.live_session import LiveSession
    from clench.core.pose import Pose
    from clench.models.objects.grasp_object import GraspObject

HAND, OBJECT = "robonaut2", "mug"


def view(
    files: tuple[Path, ...] = (),
    /,
    *,
    hand: str | None = None,
    object: str | None = None,
    command: Path | None = None,
    hand_file: Path | None = None,
    palm: str | None = None,
    scale: float = 1.0,
    table: tuple[float, ...] | None = None,
    obstacle: tuple[str, ...] = (),
    collision_source: Source | None = None,
    order: Order | None = None,
    criteria: str | None = None,
    mass: tuple[float, ...] = (),
    friction: tuple[float, ...] = (),
    gravity: tuple[float, float, float] | None = None,
    kinds: tuple[Kind, ...] = (),
    fingers: tuple[str, ...] = (),
    min_fingers: int = 2,
    approach: tuple[float, float, float] | None = None,
    approach_angle: float = 45.0,
    seed: int = 0,
    host: str = "localhost",
    port: int = 8765,
    dark: bool = False,
    without_browser: bool = False,
    json: bool = False,
) -> int:
    """Open a page in the browser where hand and object can be dragged, and every move is solved (docs/viewer.md).

    Args:
        files: grasps to look through: solutions, plan.json of `clench plan --out`, a record, a batch (.npz), the folder
            of a dataset, or a file of another program that `clench import` reads.
        hand: built-in name (robonaut2 by default), path to a .urdf or .xml file, or a name that clench[hands] finds
            (docs/own-hand.md); for files the one that they name.
        object: built-in name (mug by default), path to a mesh, or a shape such as cylinder:r=0.03,h=0.1; for files the
            one that they name.
        command: command file (JSON); without it clench plans a grasp with --seed.
        hand_file: TOML file that overrides the interpretation of the hand's model.
        palm: name of the palm link, to pick a hand inside a whole robot.
        scale: multiplies the object's lengths, e.g. 0.001 for a mesh in millimetres.
        table: put a table under the object: at its lowest point, or with its top at this height of the world [m].
        obstacle: obstacle in the world, as MESH_OR_SHAPE@x,y,z or MESH_OR_SHAPE@x,y,z,qw,qx,qy,qz [m]; may be given
            several times (docs/surroundings.md).
        collision_source: geometry of the hand that is solved.
        order: closing order of the joints.
        criteria: weights of the choice: a preset (balanced, steady, gentle, quick) or a calibration file.
        mass: mass of the object [kg]; of two numbers, the larger one counts; 0.1 by default.
        friction: friction between links and object; of two numbers, the smaller one counts; by default the values of
            hand file and object, else 0.6.
        gravity: direction of gravity in the world, for planned grasps; by default every direction.
        kinds: kinds of planned grasps; any by default.
        fingers: names of the fingers that may close in planned grasps; all by default.
        min_fingers: smallest number of fingers that touch in planned grasps.
        approach: direction in the world in which the palm approaches in planned grasps.
        approach_angle: largest angle between the palm's direction and --approach [degrees].
        seed: seed of planned grasps.
        host: address of the page's server. For any address but this machine itself, clench prints the page's address
            with a token.
        port: port of the page's server; 0 takes a free one.
        dark: start with a dark page.
        without_browser: print the page's address, and open no browser.
        json: print the address as one JSON document on standard output.
    """
    from clench.apps.viewer.opening import open_session
    from clench.apps.viewer.serving import check_viewer, serve
    from clench.core.defaults import MASS
    from clench.kernels.runtime.warming import warm_up
    from clench.mechanics.grasp.contacts import friction_range
    from clench.mechanics.grasp.loads import mass_range
    from clench.planner.options import PlanOptions

    check_viewer()
    carried, gripped = as_range(mass, "--mass"), as_range(friction, "--friction")
    forces: dict[str, Any] = {
        "friction": None if gripped is None else friction_range(gripped, "--friction")[0],
        "mass": mass_range(MASS if carried is None else carried, "--mass")[1],
        "planning": {
            "gravity": gravity,
            "kinds": kinds or None,
            "fingers": fingers or None,
            "min_fingers": min_fingers,
            "approach": approach,
            "approach_angle": as_angle(approach_angle, "--approach-angle"),
            "seed": seed,
        },
    }
    # The page plans when it is asked to: wrong options are told before it opens.
    PlanOptions(**{name: value for name, value in forces["planning"].items() if value is not None})
    loaded = {"hand_file": hand_file, "palm": palm, "collision_source": collision_source}
    if files:
        if command is not None:
            raise CommandError("view: files of grasps have their own commands; leave out --command.")
        size = None if scale == 1.0 else scale
        session, grasps = _of_files(files, (hand, object), loaded, size, (table, obstacle), forces)
    else:
        asked = {"order": order, "criteria": criteria, "collision_source": collision_source}
        around = command, table, obstacle
        session, grasps = open_session(_given(hand or HAND, object or OBJECT, loaded, scale, around, asked, forces)), []
    warm_up(motions=True)
    with serve(session, host, port, grasps, dark) as page:
        _announce(page.url, without_browser, json)
        _wait()
    return 0


def _of_files(
    files: Sequence[Path],
    models: tuple[str | None, str | None],
    loaded: dict[str, Any],
    scale: float | None,
    scene: SceneOptions,
    forces: dict[str, Any],
) -> tuple[LiveSession, list[ListedGrasp]]:
    """Return a session with the grasps of files, of given models or of those that the files name."""
    import clench
    from clench.apps.cli.inputs.command_files import loadable
    from clench.apps.viewer.grasps.grasp_files import GraspFiles
    from clench.apps.viewer.opening import open_list

    def load_object(model: str, named: float, geometry: str) -> GraspObject:
        return clench.GraspObject.load(model, scale=named if scale is None else scale, collision_source=geometry)

    def around(obj: GraspObject, pose: Pose | None) -> GraspObject:
        return with_scene(obj, pose, *scene)

    hand, object = (None if model is None else loadable(model) for model in models)
    asked = None if scene == (None, ()) else around
    read = GraspFiles(lambda model: clench.Hand.load(model, **loaded), load_object, hand, object, asked)
    return open_list(read, files, **forces)


def _given(
    hand: str,
    object: str,
    loaded: dict[str, Any],
    scale: float,
    around: tuple[Path | None, tuple[float, ...] | None, tuple[str, ...]],
    asked: dict[str, Any],
    forces: dict[str, Any],
) -> Given:
    """Return the inputs that the options of a single scene give."""
    import clench
    from clench.apps.cli.inputs.command_files import loadable
    from clench.apps.viewer.opening import Given
    from clench.apps.viewer.session.scene_code import call_code
    from clench.models.command import ClosingOrder
    from clench.models.shapes import CollisionSource

    command, table, obstacle = around
    the_hand = clench.Hand.load(hand, **loaded)
    the_object = clench.GraspObject.load(object, scale=scale)
    the_command = None if command is None else read_command(command, the_hand)
    placed = the_object, None if the_command is None else the_command.object_pose, table, obstacle
    enums = {"order": ClosingOrder, "collision_source": CollisionSource}
    requested = {name: enums.get(name, str)(value) for name, value in asked.items() if value is not None}
    code = {name: str(v.resolve()) if isinstance(v, Path) else v for name, v in loaded.items()}
    size = None if scale == 1.0 else scale
    return Given(
        the_hand,
        with_scene(*placed),
        the_command,
        requested,
        **forces,
        hand_model=loadable(hand),
        object_model=loadable(object),
        hand_code=call_code("clench.Hand.load", loadable(hand), **code),
        object_code=(
            "obj = " + call_code("clench.GraspObject.load", loadable(object), scale=size),
            *scene_code(*placed),
        ),
    )


def _announce(url: str, without_browser: bool, json: bool) -> None:
    """Say where the page is, and open it where there is a browser."""
    import webbrowser

    from clench.apps.cli.output.results import print_json

    if json:
        print_json({"schema": "clench.view/1", "url": url})
    else:
        sys.stdout.write(f"clench view: {url} (Ctrl+C ends it)\n")
        sys.stdout.flush()
    if not without_browser:
        with contextlib.suppress(webbrowser.Error):
            webbrowser.open(url)


def _wait() -> None:
    """Wait until the user interrupts."""
    with contextlib.suppress(KeyboardInterrupt):
        threading.Event().wait()
