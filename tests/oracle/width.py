"""An oracle for the full width: python-fcl's distances along the closing path (docs/method.md sections 5 and 8).

Nothing of the project's kernels: where the links are is forward kinematics of the hand, how far they are is the other
engine's. Advancing by distance over speed passes nothing that is thicker than the smallest step.
"""

from dataclasses import dataclass, field, replace
from typing import Any

import fcl
import numpy as np
import numpy.typing as npt

import clench
from chain_hands import HandBuilder, along_x
from clench.core.pose import Pose, rotation_about
from clench.models.hand.hand import Hand
from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource, Shape, ShapeKind

Floats = npt.NDArray[np.float64]

#: Gaps up to this are touching, as docs/method.md section 4 states it [m].
TOUCHING = 1e-9
#: The oracle's smallest step [rad]: where it is nearer to a contact than that, it looks at the end alone.
_LEAST = 1e-5
_STEPS = 4000
#: How far the oracle goes on beyond a stop [rad]; a corner may be past another one again within the first thousandth.
_ON = (1e-5, 1e-4, 1e-3, 2e-3, 5e-3)


@dataclass(frozen=True)
class Case:
    """One finger and one object, in the palm frame, which is the world's."""

    hand: Hand
    obj: GraspObject
    place: Pose


@dataclass
class Judged:
    """What was found about one closing: `contact`, `free` or `blocked`; what is wrong; and what was not to be judged.

    Args:
        grazing: stops beyond which nothing overlaps by more than the tolerance, and nothing opens either.
        unresolved: stages with more steps than were taken.
    """

    kind: str = "free"
    wrong: list[str] = field(default_factory=list)
    grazing: int = 0
    unresolved: int = 0
    stages: int = 0


class Core:
    """A convex core with a radius, as the other engine's tree over its triangles, and the ball around it."""

    def __init__(self, vertices: Floats, triangles: npt.NDArray[np.int64], radius: float) -> None:
        model = fcl.BVHModel()
        model.beginModel(len(vertices), len(triangles))
        model.addSubModel(vertices, triangles)
        model.endModel()
        self.placed = fcl.CollisionObject(model)
        self.radius = radius
        self.middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
        self.reach = float(np.linalg.norm(vertices - self.middle, axis=1).max()) + radius


def core_of(shape: Shape) -> Core:
    """Return a shape's core: itself for meshes and boxes, a segment or a point for capsules and spheres."""
    if shape.kind in (ShapeKind.CAPSULE, ShapeKind.SPHERE):
        half = shape.size[1] if shape.kind is ShapeKind.CAPSULE else 0.0
        ends = shape.pose.apply(np.array([[0.0, 0.0, -half], [0.0, 0.0, half]]))
        return Core(ends, np.array([[0, 1, 1]]), shape.size[0])
    mesh = shape.to_mesh(1e-5)
    return Core(mesh.vertices, mesh.triangles, 0.0)


def gap(a: Core, A: Floats, b: Core, B: Floats) -> float:
    """Return the gap between two cores in their poses, shape (4, 4) each [m]; -1 where triangles cross."""
    a.placed.setTransform(fcl.Transform(A[:3, :3], A[:3, 3]))
    b.placed.setTransform(fcl.Transform(B[:3, :3], B[:3, 3]))
    found = float(fcl.distance(a.placed, b.placed, fcl.DistanceRequest(), fcl.DistanceResult()))
    # The engine says 0, not how deep, where triangles cross.
    return found - a.radius - b.radius if found > 0.0 else -1.0


def least_gap(pairs: list[tuple[Core, Floats, Core, Floats]]) -> float:
    """Return the smallest gap of pairs of cores in their poses [m]; those whose balls are farther are not looked at."""
    if not pairs:
        return np.inf
    one = np.array([A[:3, :3] @ a.middle + A[:3, 3] for a, A, _, _ in pairs])
    other = np.array([B[:3, :3] @ b.middle + B[:3, 3] for _, _, b, B in pairs])
    away = np.linalg.norm(one - other, axis=1) - [a.reach + b.reach for a, _, b, _ in pairs]
    least = np.inf
    for k in np.argsort(away):
        if away[k] >= least:
            break
        least = min(least, gap(*pairs[k]))
    return float(least)


class Oracle:
    """Measure gaps of a hand's moving links to an object and to the links that they must not overlap."""

    def __init__(self, case: Case) -> None:
        self.hand, self.place = case.hand, case.place.matrix
        self.objects = [core_of(s) for body in case.obj.bodies for s in body.shapes]
        self.links = [[core_of(s) for s in link.shapes.get(CollisionSource.ENGINE, ())] for link in case.hand.links]
        self.allowed = case.hand.allowed_pairs_for(CollisionSource.ENGINE)
        self.looks = 0

    def gap(self, q: Floats, moving: set[int]) -> float:
        """Return the smallest gap of any moving link at a posture [m]."""
        self.looks += 1
        poses = self.hand.link_poses(q)
        pairs = []
        for m in moving:
            for core in self.links[m]:
                pairs += [(core, poses[m], o, self.place) for o in self.objects]
                for r in range(len(self.hand.links)):
                    if r != m and (min(m, r), max(m, r)) not in self.allowed:
                        pairs += [(core, poses[m], other, poses[r]) for other in self.links[r]]
        return least_gap(pairs)

    def judge(self, answer: Floats, start: Floats, reach: float) -> Judged:
        """Judge a closing: no gap below -1e-9 m on its path, none left open where it stopped, no stop without need.

        Args:
            answer, start: postures at both ends [rad]. reach: no point is farther from a joint [m].
        """
        found, q = Judged(), start.copy()
        finger = self.hand.fingers[0]
        followers = {c.follower: c.leader for c in self.hand.couplings}
        for leader in (j for j in finger.joints if j not in followers):
            moving = {i for i in finger.links if self._before(i) >= min(self._group(leader))}
            travel = float(answer[leader] - q[leader])
            speed = reach * sum(abs(c.ratio) for c in self.hand.couplings if c.leader == leader) + reach
            rates = np.zeros(len(q))
            rates[leader] = 1.0
            self._march(q, rates, travel, speed, moving, found, f"joint {leader}")
            q[leader] = answer[leader]
            q = self.hand.coupled(q)
            upper = self.hand.joints[leader].upper
            if answer[leader] < upper - 1e-12:
                on = [self._moved(q, rates, min(s, upper - q[leader])) for s in _ON]
                self._judge_stop(f"joint {leader} at {travel:.9g} rad", q, on, moving, found)
        return found

    def judge_together(self, answer: Floats, start: Floats, reach: float, speeds: Floats) -> Judged:
        """Judge a closing of all joints at once, each at its speed until it is held; see `judge`.

        Where a joint is held before its limit, a link behind it touches; going on with what moved until then collides.
        """
        found = Judged()
        finger = self.hand.fingers[0]
        followers = {c.follower for c in self.hand.couplings}
        free = [j for j in finger.joints if j not in followers]
        rates = np.where([j in free for j in range(len(start))], speeds, 0.0)
        ends = {j: float((answer[j] - start[j]) / rates[j]) for j in free}
        before = 0.0
        speed = 3.0 * reach * len(finger.joints) * float(rates.max())
        for s in sorted(set(ends.values())):
            held = np.array([rates[j] if ends.get(j, 0.0) >= s else 0.0 for j in range(len(start))])
            q = self._held(answer, start, rates, before)
            first = min((k for j in free if held[j] > 0.0 for k in self._group(j)), default=len(held))
            moving = {i for i in finger.links if self._before(i) >= first}
            self._march(q, held, s - before, speed, moving, found, f"from {before:.9g}")
            before = s
        for j in free:
            if answer[j] < self.hand.joints[j].upper - 1e-12:
                behind = {i for i in finger.links if self._before(i) >= min(self._group(j))}
                q = self._held(answer, start, rates, ends[j])
                still = np.array([rates[k] if ends.get(k, 0.0) >= ends[j] - 1e-12 else 0.0 for k in range(len(start))])
                on = [self._moved(q, still, s / float(rates.max())) for s in _ON]
                self._judge_stop(f"joint {j} at {ends[j]:.9g}", q, on, behind, found, set(finger.links))
        return found

    def _judge_stop(
        self,
        name: str,
        q: Floats,
        on: list[Floats],
        moving: set[int],
        found: Judged,
        all_moving: set[int] | None = None,
    ) -> None:
        end = self.gap(q, moving)
        if abs(end) > TOUCHING:
            found.wrong.append(f"{name}: stops at a gap of {end:.3g} m")
            return
        beyond = [self.gap(p, moving if all_moving is None else all_moving) for p in on]
        if min(beyond) < -TOUCHING:
            return
        if max(beyond) > 10.0 * TOUCHING:
            found.wrong.append(f"{name}: could go on, with gaps of {', '.join(f'{g:.3g}' for g in beyond)} m")
        else:
            found.grazing += 1

    def _held(self, answer: Floats, start: Floats, rates: Floats, s: float) -> Floats:
        return self.hand.coupled(np.where(rates > 0.0, np.minimum(start + rates * s, answer), answer))

    def _moved(self, q: Floats, rates: Floats, s: float) -> Floats:
        upper = np.array([x.upper for x in self.hand.joints])
        return self.hand.coupled(np.where(rates > 0.0, np.minimum(q + rates * s, upper), q))

    def _group(self, leader: int) -> list[int]:
        return [leader, *(c.follower for c in self.hand.couplings if c.leader == leader)]

    def _before(self, link: int) -> int:
        return self.hand.links[link].joint

    def _march(
        self, q: Floats, rates: Floats, travel: float, speed: float, moving: set[int], found: Judged, name: str
    ) -> None:
        """Look for gaps below the tolerance on the way; its last 1e-4 rad are left out, and so is its start."""
        s = 0.0
        found.stages += 1
        for _ in range(_STEPS):
            if s >= travel - 1e-4:
                return
            seen = self.gap(self._moved(q, rates, s), moving)
            if s > 0.0 and seen < -TOUCHING:
                found.wrong.append(f"{name}: a gap of {seen:.3g} m at {s:.9g} before its end at {travel:.9g} rad")
                return
            s += max(seen / speed, _LEAST)
        found.unresolved += 1


def make_case(seed: int, tilted: bool = False) -> Case:
    """Return a random finger of 1 to 4 joints, some coupled, and a random object: thick, thin, pointed or round.

    Args:
        tilted: the joints' axes are not parallel, by anything from 3e-10 rad to a right angle.
    """
    rng = np.random.default_rng([77, seed])
    joints = int(rng.integers(1, 5))
    lengths = rng.uniform(0.02, 0.05, joints)
    shapes = [link_shape(rng, float(length)) for length in lengths]
    axes = tilted_axes(seed, joints) if tilted else None
    hand = HandBuilder().finger("index", shapes, lengths, axes=axes, upper=2.2)
    if joints > 1 and rng.random() < 0.5:
        follower = int(rng.integers(1, joints))
        hand = hand.couple(f"index_{follower - 1}", f"index_{follower}", float(rng.uniform(0.3, 1.2)))
    body = object_shape(rng)
    obj = GraspObject.from_shape(body, name="thing")
    return Case(hand.hand(), obj, random_place(rng, float(lengths.sum())))


def tilted_axes(seed: int, joints: int) -> list[Floats]:
    """Return the axes of a finger's joints, each tilted off -y by its own angle about a random direction."""
    rng = np.random.default_rng([80, seed])
    tilts = 10.0 ** rng.uniform(-9.5, 0.2, joints)
    return [rotation_about(unit(rng.normal(size=3)), float(tilt)) @ [0.0, -1.0, 0.0] for tilt in tilts]


def random_place(rng: np.random.Generator, length: float) -> Pose:
    """Return a place of the object within reach of a finger of some length."""
    away = rng.uniform(0.02, 0.6 * length + 0.02)
    return Pose([away, rng.uniform(-0.01, 0.01), rng.uniform(0.03, 0.06)], wxyz=unit(rng.normal(size=4)))


def unit(v: Floats) -> Floats:
    """Return a vector of length 1."""
    return v / np.linalg.norm(v)


def hull_shape(points: npt.ArrayLike) -> Shape:
    """Return the convex hull of points as a mesh."""
    import trimesh

    return mesh_shape(trimesh.convex.convex_hull(points))


def link_shape(rng: np.random.Generator, length: float) -> Shape:
    """Return a capsule, a box or the hull of random points along a link."""
    kind = rng.integers(3)
    if kind == 0:
        return along_x(float(rng.uniform(0.004, 0.008)), length)
    if kind == 1:
        size = (0.45 * length, float(rng.uniform(0.003, 0.01)), float(rng.uniform(0.002, 0.007)))
        return Shape(ShapeKind.BOX, size, Pose([0.5 * length, 0, 0]))
    points = rng.uniform([0.05 * length, -0.009, -0.006], [0.95 * length, 0.009, 0.006], (int(rng.integers(5, 24)), 3))
    return hull_shape(points)


def object_shape(rng: np.random.Generator) -> Shape:
    """Return a blade of 0.1 mm, a needle, a hull, a torus, a box, a ball or a capsule."""
    kind = rng.integers(7)
    if kind == 0:
        return Shape(ShapeKind.BOX, (5e-5, float(rng.uniform(0.005, 0.03)), float(rng.uniform(0.005, 0.03))))
    if kind == 1:
        base = 0.002 * np.array([[1, 0, 0], [-0.5, 0.9, 0], [-0.5, -0.9, 0]])
        return hull_shape([*base, [0, 0, float(rng.uniform(0.02, 0.05))]])
    if kind == 2:
        return hull_shape(rng.normal(scale=0.012, size=(int(rng.integers(6, 40)), 3)))
    if kind == 3:
        import trimesh

        return mesh_shape(trimesh.creation.torus(0.015, 0.005, major_sections=16, minor_sections=9))
    if kind == 4:
        return Shape(ShapeKind.BOX, tuple(rng.uniform(0.004, 0.02, 3)))
    if kind == 5:
        return Shape(ShapeKind.SPHERE, (float(rng.uniform(0.003, 0.02)), 0.0, 0.0))
    return Shape(ShapeKind.CAPSULE, (float(rng.uniform(0.002, 0.01)), float(rng.uniform(0.005, 0.03)), 0.0))


def mesh_shape(mesh: Any) -> Shape:
    """Return a mesh as a shape."""
    return Shape(
        ShapeKind.MESH, (0.0, 0.0, 0.0), Pose.identity(), TriangleMesh(np.array(mesh.vertices), np.array(mesh.faces))
    )


def judge_case(seed: int, order: str = "proximal-first") -> Judged:
    """Close one case and judge it."""
    return judge_places(seed, order, 1)[0]


def judge_places(seed: int, order: str, places: int) -> list[Judged]:
    """Close one finger on one object in so many places, and judge every answer; the first is that of the case.

    Args:
        order: of closing; `speeds` is `together` with a random speed per joint; `tilted` before it tilts the axes.
    """
    case = make_case(seed, tilted=order.startswith("tilted "))
    oracle = Oracle(case)
    rng = np.random.default_rng([78, seed])
    length = sum(float(link.T_parent_link[0, 3]) for link in case.hand.links[2:]) + 0.035
    found = []
    for number in range(places):
        place = case.place if number == 0 else random_place(rng, length)
        case = replace(case, place=place)
        oracle.place = place.matrix
        judged = _judge(case, oracle, seed, order.removeprefix("tilted "))
        judged.wrong = [f"{order}, seed {seed}, place {number}: {sentence}" for sentence in judged.wrong]
        found.append(judged)
    return found


def _judge(case: Case, oracle: Oracle, seed: int, order: str) -> Judged:
    followers = {c.follower for c in case.hand.couplings}
    free = [i for i in range(len(case.hand.joints)) if i not in followers]
    speeds = np.ones(len(case.hand.joints))
    if order == "speeds":
        speeds[free] = np.random.default_rng([79, seed]).uniform(0.3, 3.0, len(free))
    solution = clench.solve(
        case.hand,
        case.obj,
        clench.GraspCommand(
            hand_pose=Pose.identity(),
            object_pose=case.place,
            planes=(1, 2, 3)[seed % 3],
            order=clench.ClosingOrder("together" if order == "speeds" else order),
            speeds={case.hand.joint_names[i]: float(speeds[i]) for i in free} if order == "speeds" else {},
            measure=False,
            preshape="open",
        ),
    )
    start = case.hand.open_angles()
    if solution.fingers["index"].status == "blocked":
        found = oracle.gap(start, set(case.hand.fingers[0].links))
        return Judged("blocked", [] if found <= 1e-6 else [f"called blocked with a gap of {found:.3g} m"])
    answer = np.array([solution.joint_angles[name] for name in case.hand.joint_names])
    reach = float(np.sum([0.05] * len(case.hand.joints))) + 0.02
    if order == "proximal-first":
        judged = oracle.judge(answer, start, reach)
    else:
        judged = oracle.judge_together(answer, start, reach, speeds)
    judged.kind = "contact" if solution.contacts else "free"
    return judged
