"""An oracle for the exact width: python-fcl's distances of cores, along the closing path (METHOD.md sections 5 and 8).

Nothing of the project's kernels: where the links are is forward kinematics of the hand, how far they are is the other
engine's. Advancing by distance over speed passes nothing that is thicker than the smallest step.
"""

from dataclasses import dataclass
from typing import Any

import fcl
import numpy as np
import numpy.typing as npt

import clench
from chain_hands import HandBuilder, along_x
from clench.base.pose import Pose
from clench.models.hand.hand import Hand
from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource, Shape, ShapeKind

Floats = npt.NDArray[np.float64]

#: Gaps up to this are touching, as METHOD.md section 4 states it [m].
TOUCHING = 1e-9
#: The oracle's smallest step [rad]: where it is nearer to a contact than that, it looks at the end alone.
_LEAST = 1e-5
_STEPS = 600


@dataclass(frozen=True)
class Case:
    """One finger and one object, in the palm frame, which is the world's."""

    hand: Hand
    obj: GraspObject


class Core:
    """A convex core with a radius, as the other engine's tree over its triangles."""

    def __init__(self, vertices: Floats, triangles: npt.NDArray[np.int64], radius: float) -> None:
        self.model = fcl.BVHModel()
        self.model.beginModel(len(vertices), len(triangles))
        self.model.addSubModel(vertices, triangles)
        self.model.endModel()
        self.radius = radius


def core_of(shape: Shape) -> Core:
    """Return a shape's core: itself for meshes and boxes, a segment or a point for capsules and spheres."""
    if shape.kind in (ShapeKind.CAPSULE, ShapeKind.SPHERE):
        half = shape.size[1] if shape.kind is ShapeKind.CAPSULE else 0.0
        ends = shape.pose.apply(np.array([[0.0, 0.0, -half], [0.0, 0.0, half]]))
        return Core(ends, np.array([[0, 1, 1]]), shape.size[0])
    mesh = shape.to_mesh(1e-5)
    return Core(mesh.vertices, mesh.triangles, 0.0)


def gap(a: Core, A: Floats, b: Core, B: Floats) -> float:
    """Return the gap between two cores in their poses, shape (4, 4) each [m]; negative where they cross."""
    one = fcl.CollisionObject(a.model, fcl.Transform(A[:3, :3], A[:3, 3]))
    other = fcl.CollisionObject(b.model, fcl.Transform(B[:3, :3], B[:3, 3]))
    found = float(fcl.distance(one, other, fcl.DistanceRequest(), fcl.DistanceResult()))
    # The engine says 0, not how deep, where triangles cross.
    return found - a.radius - b.radius if found > 0.0 else -1.0


class Oracle:
    """Measure gaps of a hand's moving links to an object and to the links that they must not overlap."""

    def __init__(self, case: Case) -> None:
        self.hand = case.hand
        self.objects = [(core_of(s), case.obj.pose.matrix) for body in case.obj.bodies for s in body.shapes]
        source = CollisionSource.ENGINE
        self.links = [[core_of(s) for s in link.shapes.get(source, ())] for link in case.hand.links]

    def gap(self, q: Floats, moving: set[int]) -> float:
        """Return the smallest gap of any moving link at a posture [m]."""
        poses = self.hand.link_poses(q)
        least = np.inf
        for m in moving:
            for core in self.links[m]:
                least = min([least, *(gap(core, poses[m], o, T) for o, T in self.objects)])
                for r in range(len(self.hand.links)):
                    if r != m and (min(m, r), max(m, r)) not in self.hand.allowed_pairs:
                        least = min([least, *(gap(core, poses[m], other, poses[r]) for other in self.links[r])])
        return least

    def judge(self, answer: Floats, start: Floats, reach: float) -> list[str]:
        """Return what is wrong with a closing: a gap below -1e-9 m on its path, or one left open where it stopped.

        Args:
            answer, start: postures at both ends [rad]. reach: no point is farther from a joint [m].
        """
        wrong, q = [], start.copy()
        finger = self.hand.fingers[0]
        followers = {c.follower: c.leader for c in self.hand.couplings}
        for leader in (j for j in finger.joints if j not in followers):
            group = [leader, *(f for f, of in followers.items() if of == leader)]
            moving = {i for i in finger.links if self._before(i) >= min(group)}
            travel = float(answer[leader] - q[leader])
            speed = reach * sum(abs(c.ratio) for c in self.hand.couplings if c.leader == leader) + reach
            least = self._march(q, leader, travel, speed, moving)
            if least < -TOUCHING:
                wrong.append(f"joint {leader}: a gap of {least:.3g} m before its end at {travel:.9g} rad")
            q[leader] = answer[leader]
            q = self.hand.coupled(q)
            end = self.gap(q, moving)
            if end < -TOUCHING:
                wrong.append(f"joint {leader}: overlaps by {-end:.3g} m at its end at {travel:.9g} rad")
            if answer[leader] < self.hand.joints[leader].upper - 1e-12 and end > TOUCHING:
                wrong.append(f"joint {leader}: stops at {travel:.9g} rad with a gap of {end:.3g} m")
        return wrong

    def judge_together(self, answer: Floats, start: Floats, reach: float) -> list[str]:
        """Return what is wrong with a closing of all joints at once, each at speed 1 until it is held.

        Where a joint is held before its limit, a link behind it touches; going on with what moved until then collides.
        """
        wrong = []
        finger = self.hand.fingers[0]
        moving = set(finger.links)
        followers = {c.follower for c in self.hand.couplings}
        free = [j for j in finger.joints if j not in followers]

        def at(s: float, held: Floats) -> Floats:
            return self.hand.coupled(np.where([j in free for j in range(len(held))], np.minimum(start + s, held), held))

        speed, end = 3.0 * reach * len(finger.joints), float(np.max(answer[free] - start[free]))
        stops = np.unique(answer[free] - start[free])
        s = 0.0
        for _ in range(_STEPS):
            found = self.gap(at(s, answer), moving)
            if found < -TOUCHING:
                wrong.append(f"a gap of {found:.3g} m at {s:.9g} of {end:.9g}")
            near = np.abs(stops - s).min() < 1e-4
            s += max(found / speed, 1e-4 if near else 1e-5, end / _STEPS / 2)
            if s >= end:
                break
        for j in free:
            if answer[j] < self.hand.joints[j].upper - 1e-12:
                s = float(answer[j] - start[j])
                behind = {i for i in finger.links if self._before(i) >= min(j, *self._group(j))}
                found = self.gap(at(s, answer), behind)
                if found > TOUCHING:
                    wrong.append(f"joint {j}: held at {s:.9g} rad with a gap of {found:.3g} m")
                on = np.where(answer >= answer[j] - 1e-12, np.inf, answer)
                on = np.minimum(on, [x.upper for x in self.hand.joints])
                deepest = min(self.gap(at(s + 2e-3 * k, on), moving) for k in range(1, 4))
                if deepest > 0.0:
                    wrong.append(f"joint {j}: held at {s:.9g} rad, but it could go on")
        return wrong

    def _group(self, leader: int) -> list[int]:
        return [leader, *(c.follower for c in self.hand.couplings if c.leader == leader)]

    def _before(self, link: int) -> int:
        return self.hand.links[link].joint

    def _march(self, q: Floats, leader: int, travel: float, speed: float, moving: set[int]) -> float:
        """Return the smallest gap found on the way, the last 1e-4 rad left out."""
        s, least = 0.0, np.inf
        for _ in range(_STEPS):
            if s >= travel - 1e-4:
                break
            at = q.copy()
            at[leader] += s
            found = self.gap(self.hand.coupled(at), moving)
            if s > 0.0:
                least = min(least, found)
            s += max(found / speed, _LEAST * (1.0 + 100.0 * (s > 0.0 and found > 1e-5)), travel / _STEPS / 2)
        return least


def make_case(seed: int) -> Case:
    """Return a random finger of 1 to 4 joints, some coupled, and a random object: thick, thin, pointed or round."""
    rng = np.random.default_rng([77, seed])
    joints = int(rng.integers(1, 5))
    lengths = rng.uniform(0.02, 0.05, joints)
    shapes = [link_shape(rng, float(length)) for length in lengths]
    hand = HandBuilder().finger("index", shapes, lengths, upper=2.2)
    if joints > 1 and rng.random() < 0.5:
        follower = int(rng.integers(1, joints))
        hand = hand.couple(f"index_{follower - 1}", f"index_{follower}", float(rng.uniform(0.3, 1.2)))
    body = object_shape(rng)
    away = rng.uniform(0.02, 0.6 * lengths.sum() + 0.02)
    place = Pose([away, rng.uniform(-0.01, 0.01), rng.uniform(0.03, 0.06)], wxyz=unit(rng.normal(size=4)))
    return Case(hand.hand(), GraspObject.from_shape(body, pose=place, name="thing"))


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


def judge_case(seed: int, order: str = "proximal-first") -> tuple[str, list[str]]:
    """Close one case and judge it; return what kind it was, and what is wrong."""
    case = make_case(seed)
    planes = (1, 2, 3)[seed % 3]
    command = clench.GraspCommand(hand_pose=Pose.identity(), planes=planes, order=clench.ClosingOrder(order))
    solution = clench.solve(case.hand, case.obj, command)
    if solution.fingers["index"].status == "blocked":
        q = case.hand.open_angles()
        start = Oracle(case).gap(q, set(case.hand.fingers[0].links))
        return "blocked", [] if start <= 1e-6 else [f"seed {seed}: called blocked with a gap of {start:.3g} m"]
    answer = np.array([solution.joint_angles[name] for name in case.hand.joint_names])
    reach = float(np.sum([0.05] * len(case.hand.joints))) + 0.02
    oracle = Oracle(case)
    judge = oracle.judge if order == "proximal-first" else oracle.judge_together
    wrong = judge(answer, case.hand.open_angles(), reach)
    kind = "contact" if solution.contacts else "free"
    return kind, [f"seed {seed}: {sentence}" for sentence in wrong]
