"""Contacts in the browser: dots, normals, friction cones and forces, each kind as one node."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from clench.apps.figures.drawing import style
from clench.core.pose import FloatArray
from clench.mechanics.grasp.contacts import contact_frames

from .scene_nodes import rgb

if TYPE_CHECKING:
    import viser

#: Lengths of normals and of cones [m], and the length of the largest force.
_NORMAL: Final = 0.022
_CONE: Final = 0.02
_LARGEST_FORCE: Final = 0.05
#: Forces below this part of the largest are not drawn [-].
_FAINT: Final = 0.02
#: Sides of a drawn cone.
_SIDES: Final = 16
#: Colour of forces: dark blue, which colour-blind readers tell from the contacts' orange.
FORCE: Final = "#003a6b"
CONE: Final = "#b8860b"


class ContactMarks:
    """Draw the contacts of one answer, in the frame of the object: they stay on it while it is dragged.

    Args:
        server: of viser.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        nothing: Any = np.zeros((1, 2, 3))
        scene = server.scene
        hidden: dict[str, Any] = {"visible": False}
        sizes: dict[str, Any] = {"shaft_radius": 0.0009, "head_radius": 0.0024, "head_length": 0.006}
        larger: dict[str, Any] = {"shaft_radius": 0.0016, "head_radius": 0.004, "head_length": 0.009}
        dots: dict[str, Any] = {"point_size": 0.008, "point_shape": "circle"}
        self._dots = scene.add_point_cloud(
            "/object/contacts/points", np.zeros((1, 3)), rgb(style.CONTACT), **dots, **hidden
        )
        self._normals = scene.add_arrows("/object/contacts/normals", nothing, rgb(style.CONTACT), **sizes, **hidden)
        self._cones = scene.add_line_segments(
            "/object/contacts/cones", nothing, rgb(CONE), thickness=1.5, thickness_units="screen", **hidden
        )
        self._forces = scene.add_arrows("/object/contacts/forces", nothing, rgb(FORCE), **larger, **hidden)
        self.wanted = {"normals": True, "cones": True, "forces": True}

    def show(self, positions: FloatArray, normals: FloatArray, friction: FloatArray) -> None:
        """Draw contacts; forces, which are not known yet, go.

        Args:
            positions: [m], normals: out of the object, shape (C, 3), both in its frame. friction: [-], (C,).
        """
        self._forces.visible = False
        shown = len(positions) > 0
        if shown:
            self._dots.points = positions.astype(np.float32)
            self._normals.points = np.stack([positions, positions + _NORMAL * normals], axis=1).astype(np.float32)
            if self.wanted["cones"]:
                self._cones.points = cone_lines(positions, normals, friction).astype(np.float32)
        self._dots.visible = shown
        self._normals.visible = shown and self.wanted["normals"]
        self._cones.visible = shown and self.wanted["cones"]

    def show_forces(self, positions: FloatArray, forces: FloatArray) -> None:
        """Draw forces on the object [N], shape (C, 3), in its frame; the largest has the same length always."""
        sizes = np.linalg.norm(forces, axis=1)
        largest = float(sizes.max(initial=0.0))
        strong = sizes > _FAINT * largest
        self._forces.visible = bool(strong.any()) and self.wanted["forces"]
        if strong.any():
            begins, arrows = positions[strong], forces[strong] * (_LARGEST_FORCE / largest)
            self._forces.points = np.stack([begins, begins + arrows], axis=1).astype(np.float32)

    def hide(self) -> None:
        """Show nothing."""
        for node in (self._dots, self._normals, self._cones, self._forces):
            node.visible = False


def cone_lines(positions: FloatArray, normals: FloatArray, friction: FloatArray) -> FloatArray:
    """Return the edges and rims of friction cones that open into the object, shape (N, 2, 3).

    Args:
        positions: [m], normals: out of the object, shape (C, 3). friction: [-], shape (C,).
    """
    frames = contact_frames(-normals)
    turn = np.linspace(0.0, 2.0 * np.pi, _SIDES + 1)[:-1]
    around = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    height = _CONE / np.sqrt(1.0 + friction**2)
    local = np.empty((len(positions), _SIDES, 3))
    local[:, :, :2] = (friction * height)[:, None, None] * around
    local[:, :, 2] = height[:, None]
    rims = positions[:, None] + np.einsum("cij,csj->csi", frames, local)
    apexes = np.repeat(positions[:, None], _SIDES // 2, axis=1)
    edges = np.stack([apexes, rims[:, ::2]], axis=2)
    rings = np.stack([rims, np.roll(rims, -1, axis=1)], axis=2)
    return np.concatenate([edges, rings], axis=1).reshape(-1, 2, 3)
