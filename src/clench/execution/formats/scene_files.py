"""Write the scene of a grasp for other programs: hand, object and contacts where they are at the touch."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from clench.core.exceptions import CommandError, FileError
from clench.core.extras import how_to_install
from clench.core.files.json_files import check_writable, write_atomically
from clench.core.pose import FloatArray
from clench.execution.executing import check_geometry
from clench.models.appearance import Solid, hand_solids, object_solids
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.solution import GraspSolution

#: Endings of scene files.
ENDINGS: Final = (".glb", ".usd", ".usda", ".usdc")


@dataclass(frozen=True, eq=False)
class PosedScene:
    """What a scene file holds, in the world [m].

    Args:
        solution: whose hand is shown. links, bodies: of hand and object, in their own frames.
        link_poses: of the links that are shown, shape (L, 4, 4). object_pose: of all bodies, shape (4, 4).
        grasp_lines: from one side of each grasp to the other, through the object, shape (G, 2, 3).
    """

    solution: GraspSolution
    links: tuple[Solid, ...]
    bodies: tuple[Solid, ...]
    link_poses: FloatArray
    object_pose: FloatArray
    grasp_lines: FloatArray


def is_scene_file(path: str | Path) -> bool:
    """Say whether a file is written as a scene, by its ending."""
    return Path(path).suffix.lower() in ENDINGS


def export_scene(
    path: str | Path,
    solutions: GraspSolution | Sequence[GraspSolution],
    hand: Hand,
    obj: GraspObject | None = None,
) -> Path:
    """Write hand, object and contacts of a grasp as GLB or USD, by the file's ending (docs/exporting.md).

    A USD file has a grasp line (`UsdGeom.BasisCurves`) for every grasp, which runs through the object from the contacts
    of one side to those of the other. It shows the hand of the first one. A GLB file holds one grasp.

    Args:
        path: the file: .glb, .usd, .usda or .usdc. solutions: one, or for USD several on one object.
        hand, obj: what was solved; without the object, the file has hand and contacts.

    Returns:
        the path of the file.

    Raises:
        CommandError: no grasp, several for GLB, a hand or object of another geometry, or USD without its library.
        FileError: the file cannot be written, or has another ending.
    """
    file = Path(path)
    if not is_scene_file(file):
        raise FileError(path, f"the ending names no scene; expected {', '.join(ENDINGS)}.")
    several = [solutions] if isinstance(solutions, GraspSolution) else list(solutions)
    if not several:
        raise CommandError("scene: expected at least one grasp, got none.")
    if file.suffix.lower() == ".glb" and len(several) > 1:
        raise CommandError(f"glb: one file holds one grasp, got {len(several)}; export them separately, or as USD.")
    for solution in several:
        check_geometry(solution, hand, obj)
    check_writable(file)
    scene = posed_scene(several, hand, obj)
    if file.suffix.lower() == ".glb":
        from .scene_glb import glb_bytes

        content = glb_bytes(scene)
    else:
        if importlib.util.find_spec("pxr") is None:
            raise CommandError(f"usd: needs usd-core: {how_to_install('usd')}, or choose a .glb file.")
        from .scene_usd import usd_bytes

        content = usd_bytes(scene, file.suffix.lower())
    write_atomically(file, content)
    return file


def posed_scene(solutions: Sequence[GraspSolution], hand: Hand, obj: GraspObject | None) -> PosedScene:
    """Return the scene of grasps of one hand and object: the hand of the first, the grasp lines of all."""
    first = solutions[0]
    links = hand_solids(hand, first.collision_source)
    q = np.array([first.joint_angles.get(j.name, j.open_value) for j in hand.joints])
    poses = first.hand_pose.matrix @ hand.link_poses(q)
    bodies = [] if obj is None else object_solids(obj, first.object_collision_source)
    thumbs = {finger.name for finger in hand.fingers if finger.is_thumb}
    lines = []
    for solution in solutions:
        line = grasp_line(solution, thumbs)
        if line is not None:  # the object of the first is shown; lines of the others move with theirs
            moved = first.object_pose @ solution.object_pose.inverse()
            lines.append(moved.apply(line))
    return PosedScene(
        first,
        tuple(links),
        tuple(bodies),
        poses[[link.index for link in links]].reshape(-1, 4, 4),
        first.object_pose.matrix,
        np.array(lines).reshape(-1, 2, 3),
    )


def grasp_line(solution: GraspSolution, thumbs: set[str]) -> FloatArray | None:
    """Return the line along which a grasp opposes [m], shape (2, 3); None with fewer than two places of contact.

    It runs from the middle of the thumb's contacts to the middle of the other fingers'. Without a thumb, or if only
    thumbs touch, it joins the two contacts whose normals oppose most.
    """
    lasting = [c for c in solution.contacts if not c.passed]
    points = np.array([c.position for c in lasting]).reshape(-1, 3)
    of_thumb = np.array([c.finger in thumbs for c in lasting], dtype=np.bool_)
    if of_thumb.any() and not of_thumb.all():
        return np.array([points[of_thumb].mean(axis=0), points[~of_thumb].mean(axis=0)])
    if len(points) < 2:
        return None
    normals = np.array([c.normal for c in lasting])
    a, b = np.unravel_index(int(np.argmin(normals @ normals.T)), (len(points), len(points)))
    return points[[a, b]] if np.linalg.norm(points[a] - points[b]) > 0.0 else None
