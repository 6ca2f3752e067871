"""Find where a hand on a path first overlaps itself, the object or an obstacle (docs/method.md section 7)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.closing.link_bodies import link_bodies
from clench.closing.linkage import hand_frames
from clench.core.pose import FloatArray
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.models.shapes import CollisionSource

from .depths import hand_depths, link_mesh_arrays, object_mesh
from .packed_object import PackedObject, pack_object

if TYPE_CHECKING:
    from clench.kernels.geometry.bodies import BodyArrays
    from clench.kernels.toi.pair_motion import PathProblem


@dataclass(frozen=True, eq=False)
class PlacedObject:
    """An object, with its obstacles, at its place beside the hand.

    Args:
        bodies: the object's bodies, packed one by one. T_palm_object: shape (4, 4).
    """

    bodies: tuple[PackedObject, ...]
    T_palm_object: FloatArray


def place_object(obj: GraspObject, T_palm_object: FloatArray) -> PlacedObject:
    """Return an object at its place beside the hand.

    Args:
        obj: the object; its own pose plays no part. T_palm_object: shape (4, 4).
    """
    if len(obj.bodies) == 1:
        return PlacedObject((pack_object(obj),), T_palm_object)
    each = (replace(obj, bodies=(replace(body, role=BodyRole.GRASPABLE),)) for body in obj.bodies)
    return PlacedObject(tuple(pack_object(one) for one in each), T_palm_object)


@dataclass(frozen=True)
class PathOverlap:
    """Describe the first overlap on a path.

    Args:
        place: number of the way-point before it, plus the share of the way to the next one.
        link: name of a link. other: name of the other link, or of the body of the object.
        with_object: whether `other` is a body of the object.
        depth: how deep the two overlap there [m]; between two looks at a path an overlap may have grown by 10 µm. Not a
            number if the two rub against each other for so long that the check gave up.
        position: place in the palm's frame [m]; None where the overlap is too shallow to locate.
        from_start: whether the two overlap where the path begins, and go deeper.
    """

    place: float
    link: str
    other: str
    with_object: bool
    depth: float
    position: tuple[float, float, float] | None = None
    from_start: bool = False

    @property
    def sentence(self) -> str:
        """The overlap as a sentence without a full stop, e.g. "'thumb_tip' would overlap 'index_tip' by 3.2 mm"."""
        what = f"the object's '{self.other}'" if self.with_object else f"'{self.other}'"
        if np.isnan(self.depth):
            return f"'{self.link}' moves along {what} for so long that it cannot be proven that they stay apart"
        depth = f"by at least {self.depth * 1e3:.2g} mm"
        if self.from_start:
            return f"'{self.link}' overlaps {what} where the path begins, and would go deeper, {depth}"
        return f"'{self.link}' would overlap {what} {depth}"


def find_path_overlap(
    hand: Hand,
    path: FloatArray,
    source: CollisionSource,
    around: PlacedObject | None = None,
) -> PathOverlap | None:
    """Return the first overlap on a path of the whole hand; None proves that the path is free.

    Every link is checked against every other link and against the object with its obstacles, over the whole path. The
    sweep continues until two bodies touch. From there, steps are so short that the bodies cannot overlap by more than
    10 µm between two of them. Pairs that may overlap (see `Hand.allowed_pairs_for`) are left out. A pair that overlaps
    at the start of the path may keep that depth until it separates. A soft pad may be indented by the object as far as
    the hand file says.

    Args:
        hand: the hand. path: way-points [rad], shape (W, J); joints move at constant speed between two of them.
        source: geometry of the links. around: the object; None checks the hand alone.
    """
    return check_path(hand, path, source, around)[0]


def check_path(
    hand: Hand,
    path: FloatArray,
    source: CollisionSource,
    around: PlacedObject | None = None,
    suspects: Sequence[PathOverlap] = (),
) -> tuple[PathOverlap | None, bool]:
    """Return what `find_path_overlap` returns, and whether any pair overlaps where the path begins.

    A path that is free, and on which no pair overlaps where it begins, is free in the other direction, too.

    Args:
        hand, path, source, around: see there.
        suspects: overlaps on similar paths. Their pairs are checked first: what comes later is of no interest.
    """
    found, begun = list[PathOverlap](), False
    # Body by body: a link that is in one of them where the path begins must still stay out of the others.
    for number in range(len(around.bodies)) if around is not None else (None,):
        problem = _problem(hand, path, source, number, around)
        if suspects:
            order = np.argsort(~_are_suspect(hand, problem, number, around, suspects), kind="stable")
            problem = problem._replace(pairs=problem.pairs[order], allowed=problem.allowed[order])
        overlap, overlaps = _first(hand, problem, source, number, around)
        begun = begun or overlaps
        if overlap is not None:
            found.append(overlap)
    return min(found, key=lambda o: o.place, default=None), begun


def is_path_free(
    hand: Hand, path: FloatArray, source: CollisionSource, around: PlacedObject | None, suspects: list[PathOverlap]
) -> bool:
    """Say whether `find_path_overlap` finds nothing on a path.

    Args:
        hand, path, source, around: see there. suspects: overlaps on similar paths. Their pairs are checked first,
            because one that overlaps is enough. An overlap of another pair that is found is added.
    """
    from clench.kernels.toi.path_overlap import first_overlap

    for number in range(len(around.bodies)) if around is not None else (None,):
        problem = _problem(hand, path, source, number, around)
        asked = _are_suspect(hand, problem, number, around, suspects)
        some = problem._replace(pairs=problem.pairs[asked], allowed=problem.allowed[asked])
        if asked.any() and first_overlap(some, np.empty(3)) >= 0:
            return False
    found = find_path_overlap(hand, path, source, around)
    if found is not None:
        suspects.append(found)
    return found is None


def _are_suspect(
    hand: Hand,
    problem: PathProblem,
    number: int | None,
    around: PlacedObject | None,
    suspects: Sequence[PathOverlap],
) -> NDArray[np.bool_]:
    """Say which pairs overlapped on similar paths, shape (P,)."""
    name = None if around is None or number is None else _body_name(around.bodies[number])
    asked = np.zeros(len(problem.pairs), dtype=np.bool_)
    for met in suspects:
        if not met.with_object or met.other == name:
            other = -1 if met.with_object else hand.link_index(met.other)
            asked |= (problem.pairs == [hand.link_index(met.link), other]).all(axis=1)
    return asked


def _body_name(packed: PackedObject) -> str:
    return packed.body_names[0] if packed.body_names else "object"


def _first(
    hand: Hand, problem: PathProblem, source: CollisionSource, number: int | None, around: PlacedObject | None
) -> tuple[PathOverlap | None, bool]:
    """Return the first overlap with one body of the object, or of the links; and whether any overlap at the start."""
    from clench.kernels.toi.path_overlap import OVERLAP, first_overlap

    out, path = np.zeros(3), problem.path
    found = first_overlap(problem, out)
    place, depth, begun = out.tolist()
    if found < 0:
        return None, begun > 0.0
    m, r = problem.pairs[found].tolist()
    name = hand.links[m].name
    # A pair that is apart is found before it is much deeper than the tolerance.
    from_start = bool(depth > problem.allowed[found] + 3.0 * OVERLAP)
    if r >= 0:
        return PathOverlap(place, name, hand.links[r].name, False, depth, from_start=from_start), begun > 0.0
    assert around is not None
    assert number is not None
    before = min(int(place), len(path) - 1)
    q = path[before] + (place - before) * (path[min(before + 1, len(path) - 1)] - path[before])
    body, position = _where(hand, q, m, source, around.bodies[number], around.T_palm_object)
    return PathOverlap(place, name, body, True, depth, position, from_start), begun > 0.0


def _where(
    hand: Hand, q: FloatArray, link: int, source: CollisionSource, packed: PackedObject, T_palm_object: FloatArray
) -> tuple[str, tuple[float, float, float] | None]:
    """Return the name of a body and the place in the palm's frame at which a link is deepest in it [m]."""
    deepest = hand_depths(hand, q, packed, T_palm_object, source, links=[link])
    spot = next((d.place for d in deepest if d.place is not None), None)
    name = _body_name(packed)
    if spot is None:
        return name, None
    x, y, z = (T_palm_object @ np.append(spot, 1.0))[:3].tolist()
    return name, (x, y, z)


def _problem(
    hand: Hand, path: FloatArray, source: CollisionSource, number: int | None, around: PlacedObject | None
) -> PathProblem:
    tables, points = _tables(hand, source), np.ascontiguousarray(path, dtype=np.float64)
    if around is None or number is None:
        return tables.alone._replace(path=points)
    packed, (pairs, allowed) = around.bodies[number], tables.with_object if number else tables.all
    return tables.alone._replace(
        pairs=pairs,
        allowed=allowed,
        object=packed.bodies,
        solid=object_mesh(packed),
        T_palm_object=np.ascontiguousarray(around.T_palm_object[:3], dtype=np.float64),
        path=points,
    )


class _Tables(NamedTuple):
    """The data of a hand that all its paths share.

    Args:
        alone: without an object, for no path. all: pairs of links and links with the object, (P, 2), and how far each
            may overlap [m], (P,). with_object: the links with the object alone.
    """

    alone: PathProblem
    all: tuple[NDArray[np.int64], FloatArray]
    with_object: tuple[NDArray[np.int64], FloatArray]


def _tables(hand: Hand, source: CollisionSource) -> _Tables:
    return hand.kept(("path tables", source), lambda: _make_tables(hand, source))


def _make_tables(hand: Hand, source: CollisionSource) -> _Tables:
    from clench.kernels.geometry.bodies import no_body
    from clench.kernels.geometry.link_meshes import ObjectMesh
    from clench.kernels.toi.pair_motion import PathProblem
    from clench.kernels.trees.bvh import build_tree

    links, meshes = link_bodies(hand, source), link_mesh_arrays(hand, source)
    allowed = set(hand.allowed_pairs_for(source))
    count = len(hand.links)
    mesh = np.full(count, -1, dtype=np.int64)
    mesh[meshes.link] = np.arange(len(meshes.link))
    lineage = np.eye(count, dtype=np.int64)
    for i, link in enumerate(hand.links):
        if link.parent >= 0:
            lineage[i] |= lineage[link.parent]
    solid = [i for i in hand.solid_links if links.root[i] >= 0]
    between = [(m, r) for m in solid for r in solid if r < m and (r, m) not in allowed]
    with_object = np.array([(m, -1) for m in solid], dtype=np.int64).reshape(-1, 2)
    pairs = np.array(between, dtype=np.int64).reshape(-1, 2)
    pads, none = np.array([hand.links[m].pad_indentation for m in solid], dtype=np.float64), np.zeros(len(pairs))
    alone = PathProblem(
        frames=hand_frames(hand),
        links=links,
        meshes=meshes,
        mesh=mesh,
        lineage=lineage,
        reach=_reach(hand, links, lineage),
        pairs=pairs,
        allowed=none,
        object=no_body(),
        solid=ObjectMesh(
            build_tree(np.empty((0, 3)), np.empty((0, 3))), np.empty(0, dtype=np.uint8), True, np.empty((0, 3))
        ),
        T_palm_object=np.eye(4)[:3],
        path=np.zeros((1, len(hand.joints))),
    )
    return _Tables(alone, (np.vstack([pairs, with_object]), np.concatenate([none, pads])), (with_object, pads))


def _reach(hand: Hand, bodies: BodyArrays, lineage: NDArray[np.int64]) -> FloatArray:
    """Return bounds on the distance of every link's points from every joint's axis, shape (L, J).

    A point of a link is never farther from a joint's anchor than along the links between them. The way from a link's
    origin to the next one goes through the anchor of the joint between, because both parts keep their length.
    """
    links, joints = hand.links, hand.joints
    up = np.zeros((len(links), 2))  # from a link's origin to its own anchor, and from there to its parent's origin
    for i, link in enumerate(links):
        anchor = joints[link.joint].anchor if link.joint >= 0 else np.zeros(3)
        up[i] = np.linalg.norm(anchor), np.linalg.norm((link.T_parent_link @ np.append(anchor, 1.0))[:3])
    reach = np.zeros((len(links), len(joints)))
    for m in range(len(links)):
        if bodies.root[m] < 0:
            continue
        ball = bodies.node[bodies.root[m]]
        own = float(np.linalg.norm(ball[:3]) + ball[3])
        for i, link in enumerate(links):
            if link.joint < 0:
                continue
            # All origins on the way from link m to link i, and from there to the anchor of its joint.
            above_m = np.flatnonzero(lineage[m] & ~lineage[i] & 1)
            above_i = np.flatnonzero(lineage[i] & ~lineage[m] & 1)
            way = float(up[above_m].sum() + up[above_i].sum())
            reach[m, link.joint] = own + (way + up[i, 0] if lineage[m, i] else way - up[i, 0])
    return reach
