"""Film a grasp: the hand closes, then the view turns around it; or take one picture of the end."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from clench.core.exceptions import FileError
from clench.core.files.json_files import check_writable, write_atomically
from clench.core.pose import FloatArray
from clench.models.appearance import Solid, solid_pose
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.solution import GraspSolution

from .drawing import style
from .drawing.camera import Camera, Image, fitted_camera, look_along
from .drawing.contact_labels import photograph
from .drawing.dots import dotted
from .drawing.stage import Stage, solution_poses, solution_solids
from .drawing.viewpoints import focus_of, viewpoints

if TYPE_CHECKING:
    from clench.execution.trajectory import Trajectory

#: Endings of films.
ENDINGS: Final = (".webp", ".gif")
#: Pictures a second, of the closing, and of the turn after it.
_RATE: Final = 20
_CLOSING: Final = 36
_TURNING: Final = 60
#: The first picture stands still so long [s].
_PAUSE: Final = 0.4
#: How far the view turns to either side [rad].
_TURN: Final = 0.6
_QUALITY: Final = 72
#: Radius of the dot of a contact, as a share of the height of the picture.
_DOT: Final = 0.011


def draw_still(
    hand: Hand, obj: GraspObject, solution: GraspSolution, path: str | Path, size: tuple[int, int] = (960, 720)
) -> Path:
    """Write one picture of a closed hand with its contacts, without any text.

    Args:
        hand, obj, solution: the grasp to draw. path: the file, in a format by its ending. size: of the picture [px].

    Raises:
        FileError: the file cannot be written, or no figure has its ending.
    """
    file = Path(path)
    style.check_figure(file)
    with Stage.of(hand, obj, solution) as stage:
        focus, points = focus_of(stage), _touching(solution)
        image = _taken(stage, fitted_camera(viewpoints(stage, focus, points, 1)[0], focus, size), points)
    figure = style.new_figure(*size)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.imshow(image, interpolation="nearest", aspect="auto")
    axes.set_axis_off()
    return style.save_figure(figure, file)


def draw_film(
    hand: Hand,
    obj: GraspObject,
    solution: GraspSolution,
    path: str | Path,
    trajectory: Trajectory | None = None,
    size: tuple[int, int] = (560, 440),
) -> Path:
    """Write a film of a hand that closes, and of a look around the grasp: WebP or GIF, about five seconds.

    Args:
        hand, obj, solution: the grasp to film. path: the file, .webp or .gif. size: of the pictures [px].
        trajectory: the way to the touch; without one the joints go straight from the open hand to the touch.

    Raises:
        FileError: the file cannot be written, or has another ending.
    """
    from PIL import Image as Pillow

    file = Path(path)
    if file.suffix.lower() not in ENDINGS:
        raise FileError(file, f"no film has the ending '{file.suffix}'; expected {' or '.join(ENDINGS)}.")
    check_writable(file)
    images = [
        Pillow.fromarray(np.round(255.0 * image).astype(np.uint8))
        for image in _frames(hand, obj, solution, trajectory, size)
    ]
    durations = [round(1000 / _RATE)] * len(images)
    durations[0] = round(1000 * _PAUSE)
    options: dict[str, Any] = (
        {"quality": _QUALITY, "method": 4} if file.suffix.lower() == ".webp" else {"optimize": True}
    )
    content = io.BytesIO()
    first, *others = images
    kind = file.suffix[1:].upper()
    first.save(content, kind, save_all=True, append_images=others, duration=durations, loop=0, **options)
    write_atomically(file, content.getvalue())
    return file


def _frames(
    hand: Hand, obj: GraspObject, solution: GraspSolution, trajectory: Trajectory | None, size: tuple[int, int]
) -> list[Image]:
    solids = solution_solids(hand, obj, solution)
    closed = solution_poses(hand, solids, solution)
    postures, points = _postures(hand, solution, trajectory), _touching(solution)
    images = []
    with Stage(solids, closed) as stage:
        focus = focus_of(stage)
        towards = viewpoints(stage, focus, points, 1)[0]
        stage.pose(_placed(hand, solids, solution, postures[0]))
        camera = _camera(towards, np.concatenate([focus, focus_of(stage)]), size, _TURN)
        for q in postures[:-1]:
            stage.pose(_placed(hand, solids, solution, q))
            images.append(_taken(stage, camera, points[:0]))
        stage.pose(closed)
        for angle in _TURN * np.sin(np.linspace(0.0, 2.0 * np.pi, _TURNING, endpoint=False)):
            right, up, back = look_along(_turned(towards, float(angle)), np.array([0.0, 0.0, 1.0]))
            images.append(_taken(stage, replace(camera, right=right, up=up, towards=back), points))
    return images


def _postures(hand: Hand, solution: GraspSolution, trajectory: Trajectory | None) -> list[FloatArray]:
    """Return the angles of all joints from the open hand to the touch, slow at both ends."""
    shares = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, _CLOSING))
    if trajectory is not None:
        order = [trajectory.joints.index(name) for name in hand.joint_names]
        return [trajectory.at(share * trajectory.duration)[order] for share in shares]
    closed = np.array([solution.joint_angles.get(j.name, j.open_value) for j in hand.joints])
    opened = np.array([solution.open_angles.get(j.name, q) for j, q in zip(hand.joints, closed, strict=True)])
    return [opened + share * (closed - opened) for share in shares]


def _placed(hand: Hand, solids: list[Solid], solution: GraspSolution, q: FloatArray) -> FloatArray:
    links = solution.hand_pose.matrix @ hand.link_poses(q)
    return np.array([solid_pose(solid, links, solution.object_pose.matrix) for solid in solids])


def _touching(solution: GraspSolution) -> FloatArray:
    return np.array([c.position for c in solution.contacts if not c.passed]).reshape(-1, 3)


def _turned(towards: FloatArray, angle: float) -> FloatArray:
    """Return a direction turned about the vertical axis."""
    c, s = np.cos(angle), np.sin(angle)
    turned: FloatArray = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ towards
    return turned


def _camera(towards: FloatArray, focus: FloatArray, size: tuple[int, int], turn: float) -> Camera:
    """Return a camera that stays at one distance: all points fit from every side of a turn."""
    scale = min(fitted_camera(_turned(towards, a), focus, size).scale for a in (-turn, 0.0, turn))
    middle = 0.5 * (focus.min(axis=0) + focus.max(axis=0))
    return fitted_camera(towards, middle[None], size, scale)


def _taken(stage: Stage, camera: Camera, points: FloatArray) -> Image:
    """Return the image of one moment with contacts marked, shape (H, W, 3)."""
    image, _, hidden = photograph(stage, camera, points)
    return dotted(image, camera.project(points)[:, :2], hidden, _DOT * camera.height)
