"""Stable poses: how an object rests on a horizontal table, and how likely each rest is.

The object rests on a facet of its convex hull. A facet is stable when the centre of mass projects into it. The model of
a random drop is quasi-static. It is the first model of Goldberg et al., "Part pose statistics: estimators and
experiments" (IEEE Transactions on Robotics and Automation 15(5), 1999). The object lands on the facet below its centre
of mass in a random orientation. The probability of a facet is therefore its solid angle, seen from the centre of mass,
over 4 pi. From an unstable facet the object rolls over the edge that the centre of mass overhangs most. Every roll
lowers the centre of mass.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clench.core.argument_types import check_type
from clench.core.exceptions import ObjectError
from clench.core.numbers import is_finite_number
from clench.core.pose import FloatArray, Pose, checked_vector
from clench.models.shapes import Shape, ShapeKind

from .grasp_object import BodyRole, GraspObject
from .hull_facets import HullFacets, hull_facets
from .mass import mass_properties
from .obstacles import table

Indices = NDArray[np.intp]

#: Rests whose down directions are this near count as one [rad]: a little more than the step of a cylinder of 32 sides.
MERGE_ANGLE: Final = math.radians(12.0)
#: Facets stand in for a round shape; they are off by at most this fraction of its largest size [-].
ROUND_FRACTION: Final = 1e-3
#: The centre of mass is inside of the hull by more than this fraction of the object's size [-].
_INSIDE: Final = 1e-9
#: Overhangs that differ by less than this fraction of the object's size are equal [-].
_TIE: Final = 1e-6
#: This many directions have too many near pairs.
_MANY: Final = 1000
#: Digits up to which probabilities count when poses are sorted: the rest is rounding.
_DIGITS: Final = 9


@dataclass(frozen=True)
class StablePose:
    """Describe one way in which an object rests on a table.

    Args:
        pose: `T_world_object`. The object touches the table from above, its centre of mass is over x = y = 0, and the
            object is turned no more than needed. Every pose turned about z rests as well.
        probability: share of random drops that end so [-].
        margin: distance of the projected centre of mass from the nearest edge of the supporting facet [m].
        center_height: of the centre of mass above the table [m].
        facets: how many facets of the hull were merged; more than 1 on round objects.
        spread: largest angle between the down directions of this pose and of a merged facet [rad]: 0 for a flat base,
            pi for a cylinder on its side.
        table_height: z of the table [m].
    """

    pose: Pose
    probability: float
    margin: float
    center_height: float
    facets: int
    spread: float
    table_height: float

    @property
    def tip_angle(self) -> float:
        """Angle by which the table must tilt before the object tips over an edge of its facet [rad]."""
        return math.atan2(self.margin, self.center_height)

    def on_table(
        self, obj: GraspObject, *, size: tuple[float, float] = (1.0, 1.0), thickness: float = 0.04
    ) -> GraspObject:
        """Return the object in this pose, with a table under it as an obstacle.

        Without a table, use `obj.posed(stable.pose)`.

        Args:
            obj: the object that the pose is of. size: of the table along x and y [m]. thickness: of its top [m].

        Raises:
            ObjectError: a length that is not positive.
        """
        top = table(self.table_height, size=size, thickness=thickness)
        return obj.posed(self.pose).with_body(top.moved(self.pose.inverse()))


def stable_poses(
    obj: GraspObject,
    *,
    center_of_mass: ArrayLike | None = None,
    table_height: float = 0.0,
    merge_angle: float = MERGE_ANGLE,
) -> tuple[StablePose, ...]:
    """Return the poses in which an object rests on a horizontal table, the most probable first.

    Only the shape of graspable bodies counts: the present pose of the object does not matter. Round shapes are
    polyhedra here, and rest on many facets. Facets whose down directions differ by no more than `merge_angle`, from one
    to the next, count as one rest. The most probable facet gives the pose. Thus a cylinder has two ends and one side,
    and a ball has a single pose of probability 1, which stands for all.

    Args:
        obj: the object.
        center_of_mass: in the object's frame [m], shape (3,); by default that of uniform density.
        table_height: z of the table in the world [m].
        merge_angle: [rad], from 0 (every facet by itself) to pi.

    Returns:
        At least one pose; the probabilities sum to 1. The same object gives the same bits.

    Raises:
        ObjectError: a flat object; a centre of mass that is not inside of the convex hull; a number out of range.
        CommandError: `center_of_mass` is not three finite numbers, or `obj` is no `GraspObject`.
    """
    check_type(obj, GraspObject, "obj")
    if not is_finite_number(table_height):
        raise ObjectError(f"table_height: expected a finite number [m], got {table_height!r}.")
    if not (is_finite_number(merge_angle) and 0.0 <= merge_angle <= math.pi):
        raise ObjectError(f"merge_angle: expected a number from 0 to pi [rad], got {merge_angle!r}.")
    hull = hull_facets(graspable_points(obj), obj.name)
    center = _center(obj, hull, center_of_mass)
    hull = _without_upward_rolls(hull, center)
    probability, margin = _rests(hull, center)
    groups = _groups(hull.normals, np.flatnonzero(probability), merge_angle)
    made = [_pose(hull, center, group, probability, margin, float(table_height)) for group in groups]
    made.sort(key=lambda found: (-round(found[0].probability, _DIGITS), found[1]))
    return tuple(stable for stable, _ in made)


def graspable_points(obj: GraspObject) -> FloatArray:
    """Return points whose convex hull is that of the graspable bodies, in the object's frame [m], shape (P, 3)."""
    shapes = (shape for body in obj.bodies if body.role is BodyRole.GRASPABLE for shape in body.shapes)
    return np.vstack([_points(shape) for shape in shapes])


def _points(shape: Shape) -> FloatArray:
    if shape.kind is ShapeKind.MESH:
        assert shape.mesh is not None
        return shape.pose.apply(shape.mesh.vertices[np.unique(shape.mesh.triangles)])
    return shape.to_mesh(ROUND_FRACTION * max(shape.size)).vertices


def _center(obj: GraspObject, hull: HullFacets, given: ArrayLike | None) -> FloatArray:
    """Return the centre of mass in the object's frame, checked to be inside of the hull."""
    if given is None:
        center, cause = mass_properties(obj).center, "; does its surface cross itself? Give the centre of mass"
    else:
        center, cause = checked_vector(given, 3, "center_of_mass", "[x, y, z] in metres, in the object's frame"), ""
    if hull.heights(center).min() <= _INSIDE * hull.size:
        low, high = (", ".join(f"{v:.4g}" for v in f(hull.points, axis=0)) for f in (np.min, np.max))
        raise ObjectError(
            f"center_of_mass: {center.tolist()} is not inside of the convex hull of {obj.name}, "
            f"which reaches from [{low}] to [{high}] m{cause}."
        )
    return center


def _without_upward_rolls(hull: HullFacets, center: FloatArray) -> HullFacets:
    """Join facets from one of which the object would roll to the other without getting lower.

    Such facets lie in one plane up to rounding. Afterwards every roll goes down, so there are no loops.
    """
    while True:
        height = hull.heights(center)
        upward = (hull.overhangs(center) >= 0.0) & (height[hull.edge_other] >= height[hull.edge_facet])
        if not upward.any():
            return hull
        hull = hull.joined(hull.edge_facet[upward], hull.edge_other[upward])


def _rests(hull: HullFacets, center: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return probability [-] and margin [m] of every facet; probability 0 marks unstable facets.

    Facets roll in the order of their height. If the object may roll over several edges equally well, the facets beyond
    get equal shares.
    """
    probability, height = hull.shares(center), hull.heights(center)
    probability /= probability.sum()
    overhang = hull.overhangs(center)
    margin = np.full(len(height), np.inf)
    np.minimum.at(margin, hull.edge_facet, -overhang)
    own = margin[hull.edge_facet]
    rolls = (own <= 0.0) & (overhang >= -own - _TIE * hull.size)
    rolls &= height[hull.edge_other] < height[hull.edge_facet]
    below: dict[int, set[int]] = {}
    for facet, other in zip(hull.edge_facet[rolls].tolist(), hull.edge_other[rolls].tolist(), strict=True):
        below.setdefault(facet, set()).add(other)
    for facet in sorted(below, key=lambda f: (-height[f], f)):
        for other in sorted(below[facet]):
            probability[other] += probability[facet] / len(below[facet])
        probability[facet] = 0.0
    return probability, margin


def _groups(normals: FloatArray, stable: Indices, angle: float) -> list[Indices]:
    """Return the stable facets in groups that hang together by steps of at most an angle [rad]."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = len(stable)
    directions = normals[stable]
    pairs = _near_pairs(directions, 2.0 * math.sin(angle / 2.0))
    graph = coo_array((np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    label = connected_components(graph, directed=False)[1]
    order = np.argsort(label, kind="stable")
    return np.split(stable[order], np.flatnonzero(np.diff(label[order])) + 1)


def _near_pairs(directions: FloatArray, chord: float) -> Indices:
    """Return pairs of points of the unit sphere by which those hang together that are a chord apart or less [-].

    Many points have too many near pairs. The shortest tree over points of a sphere lies in their convex hull, so its
    edges join the same points.
    """
    from scipy.spatial import ConvexHull, QhullError, cKDTree

    tree = cKDTree(directions)
    if len(directions) > _MANY:
        try:
            triangles = ConvexHull(directions).simplices
        except QhullError:  # on one circle: there are not too many pairs
            return tree.query_pairs(chord, output_type="ndarray")
        edges = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        # Points that rounding leaves inside of the hull hang on their neighbours.
        edges = np.vstack([edges, np.asarray(tree.query(directions, k=2)[1])])
        length = np.linalg.norm(directions[edges[:, 0]] - directions[edges[:, 1]], axis=1)
        return np.asarray(edges[length <= chord])
    return tree.query_pairs(chord, output_type="ndarray")


def _pose(
    hull: HullFacets,
    center: FloatArray,
    group: Indices,
    probability: FloatArray,
    margin: FloatArray,
    table_height: float,
) -> tuple[StablePose, tuple[float, ...]]:
    """Return the pose of a group of facets, and its sort key among equally probable ones."""
    down = np.round(hull.normals[group], _DIGITS) + 0.0
    order = np.lexsort((*down.T[::-1], -np.round(probability[group], _DIGITS)))
    best = int(group[order[0]])
    normal = hull.normals[best]
    turned = Pose(wxyz=_turn_down(normal))
    x, y, _ = turned.apply(center)
    lift = float(turned.apply(hull.points)[:, 2].min())
    stable = StablePose(
        pose=Pose([-x, -y, table_height - lift], turned.wxyz),
        probability=float(probability[group].sum()),
        margin=float(margin[best]),
        center_height=float(turned.apply(center)[2] - lift),
        facets=len(group),
        spread=float(np.arccos(np.clip(hull.normals[group] @ normal, -1.0, 1.0)).max()) if len(group) > 1 else 0.0,
        table_height=table_height,
    )
    return stable, tuple(down[order[0]].tolist())


def _turn_down(normal: FloatArray) -> FloatArray:
    """Return the quaternion `wxyz` of the smallest turn that makes a unit normal point down."""
    x, y, z = normal.tolist()
    if math.hypot(x, y) < _TIE**1.5:
        return np.array([1.0, 0.0, 0.0, 0.0]) if z < 0.0 else np.array([0.0, 1.0, 0.0, 0.0])
    # The axis is `normal x down`; half of the angle has the cosine w.
    quaternion = np.array([1.0 - z, -y, x, 0.0])
    return np.asarray(quaternion / np.linalg.norm(quaternion))
