"""Watch which fingers touch the object in a simulation: the engine's own contacts (to 10 µm), at every step."""

from __future__ import annotations

from typing import Any

import numpy as np

from clench.models.hand.hand import Hand

from .filming import Film
from .mujoco_scene import Scene


class TouchWatch:
    """Note when each finger first touches the object, and how hard the fingers press.

    Args:
        scene: the scene. hand: the hand in it. film: takes pictures, too.
    """

    def __init__(self, scene: Scene, hand: Hand, film: Film | None = None) -> None:
        self._scene = scene
        self.film = film
        self._names = tuple(finger.name for finger in hand.fingers)
        #: Finger of every geom, -1 without one, shape (G,).
        self._finger = np.full(scene.model.ngeom, -1)
        self._of_object = np.zeros(scene.model.ngeom, dtype=bool)
        self._of_object[list(scene.object_geoms)] = True
        for number, finger in enumerate(hand.fingers):
            for link in finger.links:
                self._finger[list(scene.link_geoms[link])] = number
        #: When each finger first touched [s], None when it has not.
        self.first: dict[str, float | None] = dict.fromkeys(self._names)

    def look(self, data: Any) -> None:
        """Note the fingers that touch now for the first time."""
        if self.film is not None:
            self.film.look(data)
        if None not in self.first.values():
            return
        for number in set(self._touching(data)[1].tolist()):
            name = self._names[number]
            if self.first[name] is None:
                self.first[name] = float(data.time)

    def still(self, name: str, data: Any) -> None:
        """Keep a picture, if there is a film."""
        if self.film is not None:
            self.film.still(name, data)

    def touching(self, data: Any) -> tuple[str, ...]:
        """Return the names of the fingers that touch the object now."""
        return tuple(self._names[number] for number in sorted(set(self._touching(data)[1].tolist())))

    def normal_forces(self, data: Any) -> dict[str, float]:
        """Return the sum of the normal forces of every finger on the object [N]."""
        import mujoco

        sums, force = dict.fromkeys(self._names, 0.0), np.zeros(6)
        for contact, number in zip(*self._touching(data), strict=True):
            mujoco.mj_contactForce(self._scene.model, data, int(contact), force)
            sums[self._names[number]] += float(force[0])
        return sums

    def _touching(self, data: Any) -> tuple[Any, Any]:
        """Return the contacts between a finger and the object, and their fingers, each shape (C,)."""
        geoms = data.contact.geom
        if not len(geoms):
            return np.zeros(0, dtype=int), np.zeros(0, dtype=int)
        with_object = self._of_object[geoms].any(axis=1)
        fingers = self._finger[geoms].max(axis=1)
        found = np.flatnonzero(with_object & (fingers >= 0))
        return found, fingers[found]
