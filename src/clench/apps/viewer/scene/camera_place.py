"""Where the camera sees a grasp well: thumb and fingers on either side of the object."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from clench.apps.viewer.session.quick_answer import QuickAnswer
from clench.core.pose import FloatArray, Pose
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.models.objects.mass import mass_properties

#: Vertical field of view of the camera [rad].
FIELD_OF_VIEW: Final = 0.6
#: Size of the view over the size of hand and object: alone, and with a strip of small grasps [-].
ROOM: Final = 1.2
ROOM_FOR_STRIP: Final = 1.7
#: How much the camera is lifted, and moved to the front of the palm, from the side [-].
_UP: Final = 0.4
_FRONT: Final = 0.25
#: Part of the room between small grasps that they fill, and their height for half of the picture's [-].
_FILLED: Final = 1.5
_TALL: Final = 0.6


def good_view(answer: QuickAnswer, object_pose: Pose, room: float = ROOM) -> tuple[FloatArray, FloatArray]:
    """Return the point that a camera looks at, and where the camera is [m], shape (3,) each.

    Args:
        answer: gives hand and object. object_pose: of the object. room: size of the view over their size [-].
    """
    palm = answer.state.command.hand_pose
    mass = mass_properties(answer.obj)
    center = object_pose.apply(mass.center)
    fingers = sorted({link for finger in answer.hand.fingers for link in finger.links})
    links = palm.apply(answer.hand.link_poses(answer.joint_angles)[fingers, :3, 3])
    seen = np.vstack([links, palm.position, center + mass.length * np.vstack([np.eye(3), -np.eye(3)])])
    target = 0.5 * (seen.min(axis=0) + seen.max(axis=0))
    radius = float(np.linalg.norm(seen - target, axis=1).max())
    normal = palm.rotation @ answer.hand.palm_normal
    side = np.cross(_across(answer, palm), normal)
    size = np.linalg.norm(side)
    side = np.array([0.7, -0.7, 0.0]) if size < 1e-6 else side / size
    side = -side if side[2] < -1e-9 else side
    way = side + _FRONT * normal + np.array([0.0, 0.0, _UP])
    return target, target + way / np.linalg.norm(way) * (room * radius / np.sin(0.5 * FIELD_OF_VIEW))


@dataclass(frozen=True, eq=False)
class StripPlace:
    """Where a row of small grasps is seen at the lower edge of the picture.

    Args:
        begin: where the object of the first one is, step: from one to the next [m], in the world, shape (3,).
        scale: size of small grasps [-].
    """

    begin: FloatArray
    step: FloatArray
    scale: float


def strip_place(camera: Any, hand: Hand, obj: GraspObject, count: int) -> StripPlace:
    """Return the place of a row in the present view of a viser camera; without a camera, below the object.

    Args:
        camera: of a tab; None: there is no tab. hand, obj: of the grasps. count: places of the row.
    """
    links = hand.link_poses(hand.open_angles())[list(hand.solid_links), :3, 3]
    extent = 2.0 * (float(np.linalg.norm(links, axis=1).max()) + mass_properties(obj).length)
    if camera is None:
        return StripPlace(np.array([0.0, 0.0, -extent]), np.array([0.3 * extent, 0.0, 0.0]), 0.25)
    R = Pose(np.zeros(3), camera.wxyz / np.linalg.norm(camera.wxyz)).rotation
    high = float(np.linalg.norm(camera.position - camera.look_at) * np.tan(0.5 * camera.fov))
    spacing = 1.9 * high * float(camera.aspect) / count
    scale = min(_FILLED * spacing, _TALL * high) / extent
    middle = camera.look_at + (high - 0.5 * scale * extent) * R[:, 1]
    return StripPlace(middle - 0.5 * (count - 1) * spacing * R[:, 0], spacing * R[:, 0], scale)


def _across(answer: QuickAnswer, palm: Pose) -> FloatArray:
    """Return the way from the other fingers' contacts to the thumb's; without both, an axis of the palm."""
    thumbs = {finger.name for finger in answer.hand.fingers if finger.is_thumb}
    is_thumb = np.array([name in thumbs for name in answer.fingers_at], dtype=np.bool_)
    if is_thumb.any() and not is_thumb.all():
        way: FloatArray = answer.positions[is_thumb].mean(axis=0) - answer.positions[~is_thumb].mean(axis=0)
        return way
    turned: FloatArray = palm.rotation[:, int(np.abs(answer.hand.palm_normal).argmin())]
    return turned
