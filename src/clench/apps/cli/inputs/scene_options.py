"""The options --table and --obstacle: the surroundings of the object."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from clench.core.exceptions import ClenchError, CommandError

if TYPE_CHECKING:
    from clench.core.pose import Pose
    from clench.models.objects.grasp_object import GraspObject

#: The values of --table and --obstacle, see `with_scene`.
SceneOptions = tuple[tuple[float, ...] | None, tuple[str, ...]]
_FORM: Final = "MESH_OR_SHAPE@x,y,z or MESH_OR_SHAPE@x,y,z,qw,qx,qy,qz"


def with_scene(
    obj: GraspObject, object_pose: Pose | None, table: tuple[float, ...] | None, obstacles: Sequence[str]
) -> GraspObject:
    """Return an object with a table and obstacles, which are placed in the world.

    Args:
        obj: the object. object_pose: `T_world_object`; None is its own.
        table: None: no table; empty: its top is at the object's lowest point; one number: its height [m].
        obstacles: texts like ``"box:x=0.1,y=0.1,z=0.2@0.2,0,0.1"``, see `_FORM`.

    Raises:
        CommandError: several heights, or a malformed text. ClenchError: a mesh or a shape that cannot be read.
    """
    import clench

    if table is None and not obstacles:
        return obj
    posed = obj if object_pose is None else obj.posed(object_pose)
    T_object_world = posed.pose.inverse()
    scene = obj
    if table is not None:
        x, y, _ = posed.pose.position.tolist()
        top = clench.table(_height(posed, table))
        scene = scene.with_body(top.moved(T_object_world @ clench.Pose([x, y, 0.0])))
    for number, text in enumerate(obstacles, start=1):
        other, T_world_other = _obstacle(text, number)
        scene = scene.with_object(other, T_object_world @ T_world_other, "obstacle")
    return scene


def scene_code(
    obj: GraspObject, object_pose: Pose | None, table: tuple[float, ...] | None, obstacles: Sequence[str]
) -> tuple[str, ...]:
    """Return Python that adds to `obj` what `with_scene` adds, which has checked it."""
    from clench.apps.viewer.session.scene_code import pose_code

    if table is None and not obstacles:
        return ()
    posed = obj if object_pose is None else obj.posed(object_pose)
    lines = [f"T_object_world = {pose_code(posed.pose)}.inverse()"]
    if table is not None:
        x, y, _ = posed.pose.position.tolist()
        place = f"T_object_world @ clench.Pose([{x!r}, {y!r}, 0.0])"
        lines.append(f"obj = obj.with_body(clench.table({_height(posed, table)!r}).moved({place}))")
    for number, text in enumerate(obstacles, start=1):
        _, pose = _obstacle(text, number)
        other = f"clench.GraspObject.load({text.rpartition('@')[0]!r})"
        lines.append(f'obj = obj.with_object({other}, T_object_world @ {pose_code(pose)}, "obstacle")')
    return tuple(lines)


def _height(obj: GraspObject, table: tuple[float, ...]) -> float:
    from clench.execution.simulation.mujoco_scene import lowest

    if len(table) > 1:
        raise CommandError(f"--table: expected the height of its top in metres, or nothing, got {len(table)} numbers.")
    return table[0] if table else lowest(obj)


def _obstacle(text: str, number: int) -> tuple[GraspObject, Pose]:
    """Return the object that a text names, called by its number, and `T_world_other`."""
    from dataclasses import replace

    import clench

    model, at, place = text.rpartition("@")
    if not at or not model:
        raise CommandError(f"--obstacle: expected {_FORM}, got '{text}'.")
    try:
        numbers = [float(part) for part in place.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (3, 7):
        raise CommandError(f"--obstacle: expected {_FORM}, got '{place}' after the @.")
    try:
        pose = clench.Pose(numbers[:3], numbers[3:] or None, key="pose")
        other = clench.GraspObject.load(model)
    except ClenchError as error:
        raise CommandError(f"--obstacle {text}: {error}") from None
    bodies = tuple(replace(body, name=f"obstacle{number}") for body in other.bodies)
    return replace(other, bodies=bodies), pose
