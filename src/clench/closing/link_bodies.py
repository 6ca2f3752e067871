"""Pack the input of the full-width sweep: links and object as bodies, and the motion of the links (section 5)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from clench.closing.collision import packed_object
from clench.closing.collision.packed_object import ROUND_POLYHEDRA, SWEEP_DEVIATION, PackedObject, shape_elements
from clench.core.caching.kept_arrays import Arrays, arrays_of
from clench.core.pose import FloatArray
from clench.models.hand.hand import Hand
from clench.models.hand.shapes_key import shapes_key
from clench.models.shapes import CollisionSource, ShapeKind

from .finger_plan import FingerPlan, closing_joints, last_closing_joint

if TYPE_CHECKING:
    from clench.kernels.geometry.bodies import BodyArrays
    from clench.kernels.toi.full_width import FullWidthArrays


class HandBodies(NamedTuple):
    """The data of a hand for full-width sweeps at any posture; L links.

    Args:
        links: every link that can touch as a body, in its own frame.
        within: whether a moving link (row) may not overlap a resting one, of the same finger or fixed, (L, L).
        across: the same, with links of different fingers, (L, L).
    """

    links: BodyArrays
    within: np.ndarray
    across: np.ndarray


def hand_bodies(hand: Hand, source: CollisionSource, start: FloatArray | None = None) -> HandBodies:
    """Return a hand's links as bodies, and which of them may not overlap in a motion from a posture.

    Args:
        hand: the hand. source: geometry of its links. start: angles of all joints [rad], shape (J,);
            None is the open posture.
    """
    q = hand.open_angles() if start is None else start
    allowed = hand.allowed_pairs_from(source, q)
    return hand.kept(("bodies", source, allowed), lambda: _bodies(hand, source, allowed))


def _bodies(hand: Hand, source: CollisionSource, allowed: tuple[tuple[int, int], ...]) -> HandBodies:
    across = _across(hand, allowed)
    return HandBodies(link_bodies(hand, source), _within(hand, across), across)


def link_bodies(hand: Hand, source: CollisionSource) -> BodyArrays:
    """Return every link of a hand that can touch as a body, in its own frame; made once per hand and source."""
    return hand.kept(("link bodies", source), lambda: _link_bodies(hand, source))


def _link_bodies(hand: Hand, source: CollisionSource) -> BodyArrays:
    from clench.kernels.geometry.bodies import BodyArrays, join_elements, pack_bodies
    from clench.kernels.grid.distance_grid import no_grid
    from clench.kernels.hulls.enclosing_hulls import HullArrays

    own = len(BodyArrays._fields) - 2  # without the hulls and the grid

    def make() -> Arrays:
        solid = set(hand.solid_links)
        parts = [
            join_elements([shape_elements(s, source) for s in (link.shapes.get(source, ()) if i in solid else ())])
            for i, link in enumerate(hand.links)
        ]
        packed: Any = pack_bodies(parts)
        return [*packed[:own], *packed.hulls]

    key = shapes_key(hand, source, "link bodies", __file__, str(packed_object.__file__))
    found: Any = arrays_of(key, make)
    return BodyArrays._make([*found[:own], HullArrays(*found[own:]), no_grid()])


def _across(hand: Hand, allowed: tuple[tuple[int, int], ...]) -> np.ndarray:
    checked = np.ones((len(hand.links),) * 2, dtype=np.int64)
    np.fill_diagonal(checked, 0)
    for a, b in allowed:
        checked[a, b] = checked[b, a] = 0
    return checked


def _within(hand: Hand, across: np.ndarray) -> np.ndarray:
    checked = across.copy()
    for one in hand.fingers:
        for other in hand.fingers:
            if one is not other:
                checked[np.ix_(one.links, other.links)] = 0
    return checked


def pack_full_width(
    hand: Hand, plans: Sequence[FingerPlan], requested: Sequence[bool], bodies: HandBodies
) -> FullWidthArrays:
    """Pack the links of the plans' fingers and how their joints move them; the object is left out.

    Args:
        hand: the hand. plans: one per finger posture. requested: per candidate. bodies: see `hand_bodies`.
    """
    from clench.kernels.geometry.bodies import no_body
    from clench.kernels.toi.full_width import FullWidthArrays, no_first

    first = np.cumsum([0, *(len(plan.joints) for plan in plans)])
    movers = [_movers(hand, plan, int(k)) for plan, k in zip(plans, first, strict=False)]
    axes = [_axis(plan, k) for plan in plans for k in range(len(plan.joints))]
    poses = [hand.link_poses(plan.posture)[:, :3] for plan in plans]
    rows = [(link, joint, pose[link]) for found, pose in zip(movers, poses, strict=True) for link, joint in found]
    return FullWidthArrays(
        joint_first=first.astype(np.int64),
        requested=np.array(requested, dtype=np.int64),
        links=bodies.links,
        object=no_body(),
        mover_first=np.cumsum([0, *(len(found) for found in movers)]).astype(np.int64),
        mover_link=np.array([row[0] for row in rows], dtype=np.int64),
        mover_joint=np.array([row[1] for row in rows], dtype=np.int64),
        mover_pose=np.array([row[2] for row in rows], dtype=np.float64).reshape(-1, 3, 4),
        axis=np.array([axis for axis, _ in axes]).reshape(-1, 3),
        anchor=np.array([anchor for _, anchor in axes]).reshape(-1, 3),
        link_pose=np.ascontiguousarray(poses),
        checked=bodies.within,
        first=no_first(len(plans), len(axes)),
        alone=False,
    )


def _movers(hand: Hand, plan: FingerPlan, first: int) -> list[tuple[int, int]]:
    """Return the moving links and the last joint before each, numbered from `first`; palm side first."""
    position = {p.joint: first + k for k, p in enumerate(plan.joints)}
    moved = last_closing_joint(hand, plan.finger, closing_joints(hand, plan.finger))
    return sorted(((link, position[joint]) for link, joint in moved.items()), key=lambda row: (row[1], row[0]))


def _axis(plan: FingerPlan, k: int) -> tuple[FloatArray, FloatArray]:
    """Return axis and anchor of a joint in the palm frame at the open posture; a positive turn takes x towards z."""
    joint = plan.joints[k]
    axis_group = plan.axis_groups[joint.axis_group]
    return -axis_group.T_palm_axis_group[:3, 1], axis_group.pivot_in_palm(joint.pivot)


def swept_deviation(hand: Hand, source: CollisionSource, packed: PackedObject) -> float:
    """Return how far the surfaces that are swept may lie inside the true ones [m]: 0 but for cylinders, ellipsoids."""
    sizes = [(s.kind, s.size) for i in hand.solid_links for s in hand.links[i].shapes.get(source, ())]
    return _deviation(sizes) + _deviation(packed.round_sizes)


def _deviation(sizes: Iterable[tuple[ShapeKind, Sequence[float]]]) -> float:
    """Return how far the polyhedra for round shapes may lie inside them [m]."""
    return max((SWEEP_DEVIATION * max(size) for kind, size in sizes if kind in ROUND_POLYHEDRA), default=0.0)
