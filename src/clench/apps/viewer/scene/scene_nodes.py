"""The hand and the object in the browser: meshes are sent once, and poses with every move."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from clench.apps.figures.drawing import style
from clench.core.pose import FloatArray, Pose, quaternions_from_rotations
from clench.models import appearance
from clench.models.appearance import OBJECT_COLOR, OBSTACLE_COLOR, link_colors
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.models.objects.mass import mass_properties
from clench.models.shapes import CollisionSource

from .drawn_meshes import MOST_OF_BODY, MOST_OF_LINK, drawn, is_hulled

if TYPE_CHECKING:
    from collections.abc import Callable

    import viser

#: The object lets contacts behind it be seen [-].
_OBJECT_OPACITY: Final = 0.62
_PICKED: Final = 0.35
#: Size of the object's gizmo for its largest distance from the middle, so that the arrows stick out [-].
_GIZMO: Final = 1.2


def rgb(color: str) -> tuple[int, int, int]:
    """Return a colour ``"#rrggbb"`` as three numbers up to 255."""
    r, g, b = (round(255 * part) for part in appearance.rgb(color))
    return r, g, b


class SceneNodes:
    """Draw one hand and one object, each below a gizmo that moves it.

    Args:
        server: of viser. on_link, on_object: are called with drags of a link (by its number) and of the object.
        on_click: is called with the number of a link that is clicked.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        on_link: Callable[[int, Any], None],
        on_object: Callable[[Any], None],
        on_click: Callable[[int], None],
    ) -> None:
        self._server = server
        self._on_link, self._on_object, self._on_click = on_link, on_object, on_click
        scene = server.scene
        self.hand_gizmo = scene.add_transform_controls(
            "/hand", scale=0.1, line_width=2.0, opacity=0.8, depth_test=False
        )
        self._around = scene.add_frame("/around", show_axes=False)
        self.object_gizmo = scene.add_transform_controls("/object", line_width=2.0, opacity=0.8, depth_test=False)
        self._links: dict[int, viser.MeshHandle] = {}
        self._bodies: list[viser.MeshHandle] = []
        self._colors: list[str] = []
        self._poses: FloatArray = np.empty((0, 7))
        self._shown: tuple[int, int, CollisionSource] | None = None

    def show_gizmos(self, *, hand: bool, object: bool) -> None:
        """Show or hide the handles; hand and object stay visible."""
        for gizmo, shown in ((self.hand_gizmo, hand), (self.object_gizmo, object)):
            gizmo.disable_axes = gizmo.disable_sliders = gizmo.disable_rotations = not shown
            gizmo.active_axes = (shown, shown, shown)

    def show_models(self, hand: Hand, obj: GraspObject, source: CollisionSource) -> bool:
        """Send the meshes, unless they are there already; return whether they were sent."""
        shown = (id(hand), id(obj), source)
        if shown == self._shown:
            return False
        with self._server.atomic():
            if self._shown is None or self._shown[::2] != shown[::2]:
                self._send_hand(hand, source)
            if self._shown is None or self._shown[1] != shown[1]:
                self._send_object(obj)
        # Kept, so that no other model gets the same identity.
        self._models, self._shown = (hand, obj), shown
        return True

    def _send_hand(self, hand: Hand, source: CollisionSource) -> None:
        for node in self._links.values():
            node.remove()
        self._links, self._colors = {}, link_colors(hand)
        for i, link in enumerate(hand.links):
            shapes = link.shapes.get(source, ())
            if not shapes:
                continue
            mesh = drawn(shapes, MOST_OF_LINK)
            node = self._server.scene.add_mesh_simple(
                f"/hand/link{i}",
                mesh.vertices.astype(np.float32),
                mesh.triangles.astype(np.uint32),
                color=rgb(self._colors[i]),
                side="double",
            )
            node.on_drag("left")(lambda event, i=i: self._on_link(i, event))
            node.on_click(lambda _, i=i: self._on_click(i))
            self._links[i] = node
        self._poses = np.full((len(hand.links), 7), np.nan)

    def _send_object(self, obj: GraspObject) -> None:
        for node in self._bodies:
            node.remove()
        self._bodies = []
        for number, body in enumerate(obj.bodies):
            mesh = drawn(body.shapes, MOST_OF_BODY, is_hulled(obj.collision_source))
            stands = body.role is BodyRole.OBSTACLE
            node = self._server.scene.add_mesh_simple(
                f"/{'around' if stands else 'object'}/body{number}",
                mesh.vertices.astype(np.float32),
                mesh.triangles.astype(np.uint32),
                color=rgb(OBSTACLE_COLOR if stands else OBJECT_COLOR),
                opacity=None if stands else _OBJECT_OPACITY,
                side="double",
            )
            if not stands:
                node.on_drag("left")(self._on_object)
            self._bodies.append(node)
        self.object_gizmo.scale = _GIZMO * mass_properties(obj).length

    def put(self, hand_pose: Pose, object_pose: Pose, *, alone: bool = False) -> None:
        """Move the hand by its palm, and the object with what stands around it, or `alone`."""
        with self._server.atomic():
            for gizmo, pose in ((self.hand_gizmo, hand_pose), (self.object_gizmo, object_pose)):
                gizmo.position, gizmo.wxyz = pose.position, pose.wxyz
            if not alone:
                self.put_around(object_pose)

    def put_around(self, object_pose: Pose) -> None:
        """Move what stands around the object: it keeps its place beside the object."""
        self._around.position, self._around.wxyz = object_pose.position, object_pose.wxyz

    def bend(self, hand: Hand, q: FloatArray) -> None:
        """Place the links at a posture; the page sends only links that moved.

        Args:
            hand: that is shown. q: angles of all its joints [rad], shape (J,).
        """
        T = hand.link_poses(q)
        rows = np.concatenate([quaternions_from_rotations(T[:, :3, :3]), T[:, :3, 3]], axis=1)
        moved = ~(np.abs(rows - self._poses).max(axis=1) < 1e-7)
        with self._server.atomic():
            for i in np.flatnonzero(moved).tolist():
                if i in self._links:
                    self._links[i].position, self._links[i].wxyz = rows[i, 4:], rows[i, :4]
        self._poses = rows

    def pick(self, links: tuple[int, ...]) -> None:
        """Make the links of one finger stand out."""
        for i, node in self._links.items():
            color = self._colors[i]
            node.color = rgb(style.mixed(color, style.INK, _PICKED) if i in links else color)
