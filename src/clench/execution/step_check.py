"""Look for links of the hand that a next step would drive into each other."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Final

import numpy as np

from clench.base.pose import FloatArray
from clench.models.hand.allowed import adjacent_pairs
from clench.models.hand.hand import Hand
from clench.models.hand.link_mesh import link_meshes, overlap_depth
from clench.models.shapes import CollisionSource

from .landing import looks
from .next_steps import NEXT_STEP, Phase

#: Links that overlap by so much more than when the steps begin are driven into each other [m]: fingers may touch.
DRIVEN_IN: Final = 1e-3


def step_overlap(hand: Hand, phases: Sequence[Phase], source: CollisionSource) -> str | None:
    """Return a sentence about the first two links that next steps drive into each other; None when there are none.

    Pairs that may overlap, and links next to each other, are not looked at.

    Args:
        hand: the hand. phases: what comes after the touch. source: geometry of the links.
    """
    steps = [phase for phase in phases if phase.name == NEXT_STEP]
    if not steps:
        return None
    pairs = _Pairs(hand, source)
    before = pairs.depths(steps[0].positions[0])
    for phase in steps:
        for q in looks(hand, list(phase.positions)):
            for (a, b), depth in pairs.depths(q).items():
                if depth > before.get((a, b), 0.0) + DRIVEN_IN:
                    names = hand.links[a].name, hand.links[b].name
                    return f"Next step {1 + (phase.step or 0)} would drive '{names[0]}' into '{names[1]}'."
    return None


class _Pairs:
    """Measure how deep links overlap each other that must not."""

    def __init__(self, hand: Hand, source: CollisionSource) -> None:
        self._hand = hand
        self._meshes = link_meshes(hand, source)
        left_out = set(hand.allowed_pairs_for(source)) | adjacent_pairs(hand.links)
        numbers = itertools.combinations(range(len(self._meshes)), 2)
        found = [(a, b) for a, b in numbers if (self._meshes[a].link, self._meshes[b].link) not in left_out]
        self._pairs = np.array(found, dtype=np.int64).reshape(-1, 2)
        radii = np.array([mesh.radius for mesh in self._meshes])
        self._reach = radii[self._pairs].sum(axis=1)

    def depths(self, q: FloatArray) -> dict[tuple[int, int], float]:
        """Return the depth [m] of every pair of links that may be near each other in a posture, shape (J,) [rad]."""
        poses = self._hand.link_poses(q)
        centers = np.array([poses[m.link][:3, :3] @ m.center + poses[m.link][:3, 3] for m in self._meshes])
        apart = np.linalg.norm(np.subtract(*centers.reshape(-1, 3)[self._pairs].transpose(1, 0, 2)), axis=1)
        near = [(self._meshes[a], self._meshes[b]) for a, b in self._pairs[apart <= self._reach]]
        return {(a.link, b.link): overlap_depth(a, b, poses) for a, b in near}
