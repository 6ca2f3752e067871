"""Pictures of solutions, plans and hands, for people who have not read the source: PNG files, made without a screen."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from clench.core.argument_types import check_type
from clench.core.files.file_bytes import make_folder

if TYPE_CHECKING:
    from clench.core.pose import Pose
    from clench.models.command import GraspCommand
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject
    from clench.planner.grasp_plan import GraspPlan
    from clench.solver.solution import GraspSolution

__all__ = ["draw_plan", "draw_solution"]


def draw_solution(
    hand: Hand, obj: GraspObject, command: GraspCommand | Pose, solution: GraspSolution, directory: str | Path
) -> list[Path]:
    """Draw every finger in its curl planes, its candidates, and the hand from three sides.

    Args:
        hand, obj, command: the solved problem, as given to `clench.solve`. solution: the answer.
        directory: the folder of the pictures `<finger>_plane.png`, `<finger>_candidates.png` and `grasp.png`. It is
            created if missing.

    Returns:
        the written files. A finger that closes no joint has no candidates, and no picture of its own.

    Raises:
        FileError: the folder cannot be made, or a file cannot be written. CommandError: an argument of another type.
    """
    from clench.models.command import as_command
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject
    from clench.solver.orders import settled
    from clench.solver.solution import GraspSolution

    from .planes.candidate_grid import draw_candidates
    from .planes.curl_plane import draw_finger
    from .planes.finger_scenes import FingerScenes
    from .sheets.hand_view import draw_hand

    check_type(hand, Hand, "hand")
    check_type(obj, GraspObject, "obj")
    check_type(solution, GraspSolution, "solution")
    command = settled(as_command(command), solution)
    folder = make_folder(directory)
    files = []
    for name, result in solution.fingers.items():
        if not 0 <= result.chosen < len(result.candidates):
            continue
        stem = re.sub(r"[^\w.-]+", "_", name)
        scenes = FingerScenes(hand, obj, command, solution, name, result.candidates[result.chosen])
        files.append(draw_finger(scenes, result, hand.name, obj.name, folder / f"{stem}_plane.png"))
        files.append(draw_candidates(scenes, result, hand.name, obj.name, folder / f"{stem}_candidates.png"))
    files.append(draw_hand(hand, obj, solution, folder / "grasp.png"))
    return files


def draw_plan(
    plan: GraspPlan, hand: Hand, obj: GraspObject, directory: str | Path, held: Sequence[bool] | None = None
) -> list[Path]:
    """Draw the best grasps of a plan, where all of them touch the object, and the opposition zones of the hand.

    Args:
        plan: the grasps. hand, obj: the hand and object of the plan.
        directory: an existing folder; `grasps.png`, `contacts.png` and `zones.png` are written there.
        held: whether each grasp held the object when it was tried; None: not tried.

    Returns:
        the files written.

    Raises:
        FileError: a file cannot be written.
    """
    from .maps.contact_map import draw_contacts
    from .maps.zone_map import draw_zones
    from .sheets.grasp_sheet import draw_grasps

    folder = Path(directory)
    return [
        draw_grasps(plan, hand, obj, folder / "grasps.png", held),
        draw_contacts(plan, hand, obj, folder / "contacts.png"),
        draw_zones(hand, folder / "zones.png"),
    ]
