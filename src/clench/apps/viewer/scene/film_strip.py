"""A strip of small grasps in front of the scene, and a mark for every grasp at its palm; a click picks one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.apps.figures.drawing import style
from clench.core.pose import FloatArray, Pose, quaternions_from_rotations
from clench.models.appearance import OBJECT_COLOR, link_colors
from clench.models.hand.hand import Hand
from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.models.shapes import Shape

from .camera_place import StripPlace
from .drawn_meshes import drawn
from .scene_nodes import rgb

if TYPE_CHECKING:
    import viser

#: Triangles of a link, and of the object, in the strip.
_MOST: Final = 1500
#: Radius of marks [m].
_MARK: Final = 0.0035
#: From the lowest to the highest score; told apart by lightness, too (after cividis).
_LOW, _HIGH = np.array([0.0, 32.0, 77.0]), np.array([254.0, 232.0, 92.0])
_FALLEN: Final = "#8a8a8a"
_CHOSEN: Final = style.CONTACT


class FilmStrip:
    """Draw a page of grasps of one hand and one object as small copies, each link as one node with many places.

    Args:
        server: of viser. pick: is called with the place in the strip that is clicked.
    """

    def __init__(self, server: viser.ViserServer, pick: Callable[[int], None]) -> None:
        self._server, self._pick = server, pick
        self._nodes: list[Any] = []
        self._version = 0

    def show(
        self, hand: Hand, obj: GraspObject, grasps: Sequence[tuple[FloatArray, Pose]], chosen: int, place: StripPlace
    ) -> None:
        """Draw small grasps in a row.

        Args:
            hand, obj: of all of them. grasps: posture (J,) and `T_object_palm` of each. chosen: which one stands out.
            place: of the row.
        """
        self.hide()
        if not grasps:
            return
        count = len(grasps)
        origins = place.begin + np.arange(count)[:, None] * place.step
        T = np.array([T_object_palm.matrix @ hand.link_poses(q) for q, T_object_palm in grasps])
        with self._server.atomic():
            for i, (link, color) in enumerate(zip(hand.links, link_colors(hand), strict=True)):
                shapes = link.shapes.get(hand.default_source, ())
                if shapes:
                    places = origins + place.scale * T[:, i, :3, 3]
                    turns = quaternions_from_rotations(T[:, i, :3, :3])
                    self._add(
                        f"link{i}", drawn(shapes, _MOST), turns, places, np.tile(_darker(color), (count, 1)), place
                    )
            bodies = tuple(s for body in obj.bodies if body.role is BodyRole.GRASPABLE for s in body.shapes)
            turns = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
            colors = np.tile(_darker(OBJECT_COLOR), (count, 1))
            colors[chosen] = _darker(_CHOSEN)
            self._add("object", coarse(bodies), turns, origins, colors, place)

    def _add(self, name: str, mesh: Any, turns: FloatArray, places: FloatArray, colors: Any, place: StripPlace) -> None:
        node = self._server.scene.add_batched_meshes_simple(
            f"/strip{self._version}/{name}",
            mesh.vertices.astype(np.float32),
            mesh.triangles.astype(np.uint32),
            turns.astype(np.float32),
            places.astype(np.float32),
            batched_scales=np.full(len(places), place.scale, dtype=np.float32),
            batched_colors=colors.astype(np.uint8),
            lod="off",
            side="double",
        )
        node.on_click(lambda event: self._pick(int(event.instance_index or 0)))
        self._nodes.append(node)

    def hide(self) -> None:
        """Take the strip away."""
        for node in self._nodes:
            node.remove()
        # A new name: a node that is removed and added at once under one name may keep its old look.
        self._nodes, self._version = [], self._version + 1


class GraspMarks:
    """Mark the palms of grasps around the object: bright balls for high scores, grey cubes for rejected proposals.

    Args:
        server: of viser. pick: is called with the number of the grasp that is clicked.
    """

    def __init__(self, server: viser.ViserServer, pick: Callable[[int], None]) -> None:
        self._server, self._pick = server, pick
        self._nodes: list[Any] = []
        self._version = 0

    def show(self, numbers: Sequence[int], places: FloatArray, scores: FloatArray, fallen: NDArray[np.bool_]) -> None:
        """Draw marks.

        Args:
            numbers: the number that a click on each mark returns. places: in the object's frame [m], shape (N, 3).
            scores: NaN where there is none, fallen: whether it was rejected, shape (N,) each.
        """
        self.hide()
        whole = np.asarray(numbers, dtype=np.int64)
        colors = score_colors(scores)
        colors[fallen] = rgb(_FALLEN)
        for name, rows, shape in (("grasps", ~fallen, _ball()), ("rejected", fallen, _cube())):
            if rows.any():
                self._add(name, shape, places[rows], colors[rows].astype(np.uint8), whole[rows])

    def _add(self, name: str, shape: tuple[FloatArray, Any], places: FloatArray, colors: Any, numbers: Any) -> None:
        node = self._server.scene.add_batched_meshes_simple(
            f"/object/marks{self._version}/{name}",
            (_MARK * shape[0]).astype(np.float32),
            np.asarray(shape[1], dtype=np.uint32),
            np.tile([1.0, 0.0, 0.0, 0.0], (len(places), 1)).astype(np.float32),
            places.astype(np.float32),
            batched_colors=colors,
            lod="off",
        )
        node.on_click(lambda event: self._pick(int(numbers[int(event.instance_index or 0)])))
        self._nodes.append(node)

    def hide(self) -> None:
        """Take the marks away."""
        for node in self._nodes:
            node.remove()
        # A new name: a node that is removed and added at once under one name may keep its old look.
        self._nodes, self._version = [], self._version + 1


@lru_cache(maxsize=256)
def coarse(shapes: tuple[Shape, ...]) -> TriangleMesh:
    """Return the triangles of shapes as small copies need them."""
    return drawn(shapes, _MOST)


def _darker(color: str) -> tuple[int, int, int]:
    """Return a colour as small copies need it, which are lit more brightly."""
    return rgb(style.mixed(color, style.INK, 0.3))


def score_colors(scores: FloatArray) -> FloatArray:
    """Return a colour for every score, dark blue for the lowest to yellow for the highest, shape (N, 3), up to 255."""
    known = np.isfinite(scores)
    low = scores[known].min() if known.any() else 0.0
    span = (scores[known].max() - low) if known.any() else 0.0
    share = np.where(known, (scores - low) / span if span > 0.0 else 1.0, 0.5)
    colors: FloatArray = _LOW + share[:, None] * (_HIGH - _LOW)
    return colors


def _ball() -> tuple[FloatArray, Any]:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=1)
    return np.asarray(ball.vertices), ball.faces


def _cube() -> tuple[FloatArray, Any]:
    import trimesh

    cube = trimesh.creation.box((1.2, 1.2, 1.2))
    return np.asarray(cube.vertices), cube.faces
