"""Open a session from the arguments of the command line: load the models, and make the first state."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeVar

import clench
from clench.core.pose import Pose
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.hand.reading.model_files import builtin_names
from clench.models.objects.grasp_object import GraspObject
from clench.models.objects.object_loading import BUILTIN
from clench.solver.orders import settled
from clench.solver.preshapes.postures import preshape_angles

from .grasps.grasp_files import GraspFiles
from .grasps.listed_grasp import ListedGrasp
from .session.live_session import LiveSession, in_palm_frame
from .session.scene_code import call_code
from .session.shelf import Shelf
from .session.view_state import Ask, ViewState

Model = TypeVar("Model")

#: Shapes that the chooser of objects offers besides the built-in objects.
SHAPES: Final = ("cylinder:r=0.03,h=0.12", "box:x=0.05,y=0.05,z=0.12", "sphere:r=0.035")
#: Where the palm is until a grasp is planned: off the object [m].
_AWAY: Final = (0.0, 0.0, 0.3)


@dataclass(frozen=True, eq=False)
class Given:
    """The inputs that the user gave.

    Args:
        hand, object: the models. command: where to begin; None: at a planned grasp.
        asked: values for planned commands, such as the order.
        friction: of all contacts [-]; None: that of hand and object. mass: of the object [kg].
        planning: options of `clench.plan_grasps`.
        hand_model, object_model: what loads them again. hand_code: Python that loads the hand; object_code: lines that
            make `obj`; empty: by name.
    """

    hand: Hand
    object: GraspObject
    command: GraspCommand | None
    asked: Mapping[str, Any]
    friction: float | None
    mass: float
    planning: Mapping[str, Any]
    hand_model: str = ""
    object_model: str = ""
    hand_code: str = ""
    object_code: tuple[str, ...] = ()


def open_session(given: Given) -> LiveSession:
    """Return a session that begins with the given inputs; the user can also choose the built-in models.

    Raises:
        ClenchError: the command does not fit hand and object.
    """
    hands: dict[str, Callable[[], Hand]] = {n: partial(clench.Hand.load, n) for n in builtin_names()}
    objects: dict[str, Callable[[], GraspObject]] = {
        n: partial(clench.GraspObject.load, n) for n in (*BUILTIN, *SHAPES)
    }
    hand_name, object_name = given.hand.name, given.object.name
    hands = {hand_name: partial(_same, given.hand), **{n: make for n, make in hands.items() if n != hand_name}}
    objects = {object_name: partial(_same, given.object), **{n: m for n, m in objects.items() if n != object_name}}
    shelf = Shelf(
        hands,
        objects,
        {hand_name: given.hand_model} if given.hand_model else {},
        {object_name: given.object_model} if given.object_model else {},
        {hand_name: given.hand_code} if given.hand_code else {},
        {object_name: given.object_code} if given.object_code else {},
    )
    planning = {name: value for name, value in given.planning.items() if value is not None}
    if given.command is not None:
        command = placed_command(given.hand, given.object, replace(given.command, **given.asked))
        return LiveSession(shelf, ViewState(hand_name, object_name, command, given.friction, given.mass), planning)
    at = given.object.pose
    away = Pose(at.position + _AWAY, (0.0, 1.0, 0.0, 0.0))
    command = GraspCommand(away, object_pose=at, **given.asked)
    state = ViewState(hand_name, object_name, command, given.friction, given.mass)
    return LiveSession(shelf, state, planning, Ask.PLAN)


def open_list(
    files: GraspFiles, paths: Sequence[Path], friction: float | None, mass: float, planning: Mapping[str, Any]
) -> tuple[LiveSession, list[ListedGrasp]]:
    """Return a session that begins with the first grasp of files, and all of their grasps.

    Args:
        files: reads them. paths: of the files. friction, mass, planning: see `Given`.

    Raises:
        FileError: a file is missing or malformed. ClenchError: a model is missing.
    """
    listed = [grasp for path in paths for grasp in files.read(path)]
    first = listed[0]
    shelf = Shelf(
        {name: partial(_same, hand) for name, hand in files.hands.items()},
        {name: partial(_same, obj) for name, obj in files.objects.items()},
        hand_models=files.hand_models,
        object_models=files.object_models,
        hand_code={name: call_code("clench.Hand.load", model) for name, model in files.hand_models.items()},
        object_code={
            name: ("obj = " + call_code("clench.GraspObject.load", model, scale=files.objects[name].scale),)
            for name, model in files.object_models.items()
        },
    )
    options = {name: value for name, value in planning.items() if value is not None}
    return LiveSession(shelf, ViewState(first.hand, first.object, first.command(), friction, mass), options), listed


def _same(model: Model) -> Model:
    return model


def placed_command(hand: Hand, obj: GraspObject, command: GraspCommand) -> GraspCommand:
    """Return a command with the posture that clench chooses for it, by angles, and the pose of the palm.

    Raises:
        ClenchError: see `clench.solve`.
    """
    solution = clench.solve(hand, obj, command)
    chosen = settled(command, solution)
    if isinstance(chosen.preshape, str):
        chosen = replace(chosen, preshape=dict(preshape_angles(hand, chosen.preshape)))
    return in_palm_frame(chosen, solution)
