"""One HTML file that shows grasps without a network: the hand closes, and the numbers stand beside it."""

from __future__ import annotations

import base64
import hashlib
import html
import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any, Final

import numpy as np

import clench
from clench.core.argument_types import check_type
from clench.core.exceptions import CommandError, MotionError
from clench.core.files.json_files import check_writable, write_atomically
from clench.core.pose import FloatArray
from clench.core.showing.visible_text import visible
from clench.models.appearance import Solid, hand_solids, object_solids, solid_pose
from clench.models.shapes import CollisionSource
from clench.solver.solution import GraspSolution

from .facts import hand_facts, solution_facts, text
from .packed_scene import Mark, Motion, packed_motion, packed_solid, packed_view

if TYPE_CHECKING:
    from clench.execution.trajectory import Trajectory
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject
    from clench.planner.grasp_plan import GraspPlan, PlannedGrasp

#: Round shapes are off by at most this [m], and a shape has at most so many triangles: files stay small.
_DEVIATION: Final = 1.5e-4
_MOST_TRIANGLES: Final = 20_000
#: Moments of a motion, of one grasp and of each of many.
_FRAMES: Final = 72
_FEW_FRAMES: Final = 24
#: How long the hand takes to close where there is no planned path [s].
_CLOSING: Final = 1.2
_IN_STEP: Final = "The animation goes straight from the open hand to the touch; no path was planned."


@dataclass(frozen=True, eq=False)
class Shown:
    """One grasp on a page: a name and a line for its button, its motion, its contacts, and its facts as HTML."""

    label: str
    caption: str
    motion: Motion
    marks: tuple[Mark, ...]
    facts: str


def write_page(
    path: str | Path,
    hand: Hand,
    obj: GraspObject,
    shown: GraspSolution | GraspPlan | PlannedGrasp | Sequence[GraspSolution],
    trajectory: Trajectory | None = None,
) -> Path:
    """Write one HTML file that shows grasps in any browser, without a network (docs/pictures.md).

    The page animates the closing, along the planned path where there is one. It has the status, the reason, the
    certificate, the contacts and the numbers of every grasp.

    Args:
        path: the file, usually .html. hand, obj: the solved models.
        shown: a solution, several of the same hand and object, a plan, or one of its grasps.
        trajectory: of a single solution; without one, a path is planned in engine geometry. In other geometry, the
            joints go straight to the touch.

    Returns:
        the path of the file.

    Raises:
        CommandError: no grasp to show. FileError: the file cannot be written.
    """
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject

    file = Path(path)
    check_writable(file)
    check_type(hand, Hand, "hand")
    check_type(obj, GraspObject, "obj")
    write_atomically(file, page_html(hand, obj, shown, trajectory).encode())
    return file


def page_html(
    hand: Hand,
    obj: GraspObject,
    shown: GraspSolution | GraspPlan | PlannedGrasp | Sequence[GraspSolution],
    trajectory: Trajectory | None = None,
) -> str:
    """Return the page that `write_page` writes."""
    from clench.planner.grasp_plan import GraspPlan

    entries = _entries(shown)
    first = entries[0] if isinstance(entries[0], GraspSolution) else entries[0].solution
    solids = [
        *hand_solids(hand, first.collision_source, _DEVIATION, _MOST_TRIANGLES),
        *object_solids(obj, first.object_collision_source, _DEVIATION, _MOST_TRIANGLES),
    ]
    frames = _FRAMES if len(entries) == 1 else _FEW_FRAMES
    made = [_shown(hand, obj, solids, entry, trajectory, frames) for entry in entries]
    title = f"{first.hand} on {first.object}"
    heading = ""
    if isinstance(shown, GraspPlan):
        heading = f"<p>{text(shown.text)}</p>"
    return _page(title, solids, made, heading)


def _entries(
    shown: GraspSolution | GraspPlan | PlannedGrasp | Sequence[GraspSolution],
) -> list[GraspSolution | PlannedGrasp]:
    """Return the grasps of a page as a list.

    Raises:
        CommandError: there is none, or `shown` is something else.
    """
    from clench.planner.grasp_plan import GraspPlan, PlannedGrasp

    given: list[Any] = list(shown) if isinstance(shown, GraspPlan | list | tuple) else [shown]
    entries: list[GraspSolution | PlannedGrasp] = []
    for entry in given:
        if not isinstance(entry, GraspSolution | PlannedGrasp):
            raise CommandError(f"shown: expected solutions, a plan or a planned grasp, got {type(entry).__name__}.")
        entries.append(entry)
    if not entries:
        why = f" {shown.text}" if isinstance(shown, GraspPlan) else ""
        raise CommandError(f"page: expected at least one grasp to show.{why}")
    return entries


def hand_page_html(hand: Hand) -> str:
    """Return a page of a hand alone: it closes from open to the limits of its closing joints, in its palm's frame."""
    solids = hand_solids(hand, hand.default_source, _DEVIATION, _MOST_TRIANGLES)
    start = hand.open_angles()
    end = start.copy()
    for finger in hand.fingers:
        for j in finger.joints:
            if hand.joints[j].role.value == "closing":
                end[j] = hand.joints[j].upper if hand.joints[j].direction > 0 else hand.joints[j].lower
    shares = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.linspace(0.0, 1.0, _FRAMES))  # closed, and open again
    postures = [hand.coupled(start + share * (end - start)) for share in shares]
    poses = np.array([hand.link_poses(q)[[s.index for s in solids]] for q in postures])
    shown = Shown(hand.name, "", Motion(poses, 2.0 * _CLOSING), (), hand_facts(hand))
    return _page(hand.name, solids, [shown], "")


def _shown(
    hand: Hand,
    obj: GraspObject,
    solids: Sequence[Solid],
    entry: GraspSolution | PlannedGrasp,
    trajectory: Trajectory | None,
    frames: int,
) -> Shown:
    """Return the contents of a page for a solution or a planned grasp."""
    planned = None if isinstance(entry, GraspSolution) else entry
    solution = entry if planned is None else planned.solution
    assert isinstance(solution, GraspSolution)
    way = trajectory if planned is None else planned.trajectory
    told = _IN_STEP
    if way is None and planned is None:
        way, told = _planned_way(solution, hand, obj)
    if way is not None:
        told = f"The animation goes along the planned path, which takes {way.duration:z.2f} s."
    postures = _postures(hand, solution, way, frames)
    duration = _CLOSING if way is None else way.duration
    poses = []
    for q in postures:
        links = solution.hand_pose.matrix @ hand.link_poses(q)
        poses.append([solid_pose(solid, links, solution.object_pose.matrix) for solid in solids])
    marks = tuple(Mark(c.position, c.normal) for c in solution.contacts)
    label, caption = solution.status.value.replace("_", " "), ""
    if planned is not None:
        label, caption = planned.kind.value, f"epsilon {planned.epsilon:z.3f}"
    motion = Motion(np.array(poses).reshape(len(postures), -1, 4, 4), duration)
    return Shown(label, caption, motion, marks, solution_facts(solution, told, planned))


def _planned_way(solution: GraspSolution, hand: Hand, obj: GraspObject) -> tuple[Trajectory | None, str]:
    """Return the planned path of a solution, else why there is none."""
    from clench.execution.trajectory import plan_trajectory

    # In other geometry than the engine's, planning takes minutes for hands of many triangles.
    if solution.rounds != 1 or not solution.contacts or solution.collision_source != CollisionSource.ENGINE:
        return None, _IN_STEP
    try:
        return plan_trajectory(solution, hand, obj=obj), ""
    except (MotionError, CommandError) as error:
        return None, f"{_IN_STEP} {error}"


def _postures(hand: Hand, solution: GraspSolution, way: Trajectory | None, frames: int) -> list[FloatArray]:
    """Return angles of all joints at even times, from the open hand to the touch."""
    if way is not None:
        order = [way.joints.index(name) for name in hand.joint_names]
        return [way.at(t)[order] for t in np.linspace(0.0, way.duration, frames)]
    closed = np.array([solution.joint_angles.get(j.name, j.open_value) for j in hand.joints])
    opened = np.array([solution.open_angles.get(j.name, q) for j, q in zip(hand.joints, closed, strict=True)])
    return [opened + share * (closed - opened) for share in np.linspace(0.0, 1.0, frames)]


def _page(title: str, solids: Sequence[Solid], shown: Sequence[Shown], heading: str) -> str:
    scene: dict[str, Any] = {
        "solids": [packed_solid(solid) for solid in solids],
        "grasps": [
            {
                "label": visible(each.label),
                "caption": visible(each.caption),
                "duration": each.motion.duration,
                "tracks": packed_motion(each.motion),
                "contacts": [{"position": m.position.tolist(), "normal": m.normal.tolist()} for m in each.marks],
                "view": packed_view(solids, each.motion.poses[-1], each.marks),
            }
            for each in shown
        ],
    }
    articles = [f"<article{'' if k == 0 else ' hidden'}>{each.facts}</article>" for k, each in enumerate(shown)]
    style, script = _part("page.css"), _part("page.js")
    return Template(_part("page.html")).substitute(
        title=html.escape(visible(title)),
        style=style,
        style_hash=_hash(style),
        script=script,
        script_hash=_hash(script),
        facts="\n".join([heading, *articles]),
        made=f"Made with clench {clench.__version__}. This file needs no network.",
        version=clench.__version__,
        scene=_inert(json.dumps(scene, separators=(",", ":"), allow_nan=False)),
    )


def _part(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


def _hash(content: str) -> str:
    """Return the hash by which the page allows this style or script, and no other."""
    return base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()


def _inert(document: str) -> str:
    """Return JSON that ends no script element, whatever its texts are."""
    for character in "<>&\u2028\u2029":
        document = document.replace(character, f"\\u{ord(character):04x}")
    return document
