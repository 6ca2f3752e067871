"""Whether posed fingers collide with an object, by python-fcl, along their closing path."""

from collections import Counter

import fcl
import numpy as np
import numpy.typing as npt

import clench
from clench.models.hand.hand import Finger, Hand, JointRole
from clench.models.shapes import Shape
from oracle.width import core_of, gap

from .surfaces import volume_tree

Floats = npt.NDArray[np.float64]

#: How far each joint is backed off along its path, and how far it is advanced beyond its contact [rad].
BACK, FURTHER = 1e-5, 1e-3
#: Links that a shift by this takes off each other only press on each other [m].
PRESSED = 1.01e-8
#: Parts of the latter at which it is looked whether a contact stops its joint, the longest first.
STEPS_BEYOND = (1.0, 0.3, 0.1, 0.01, 0.001)
_LOOKS = 12


def tree_of(shape: Shape) -> fcl.BVHModel:
    """Return a shape's triangles; round ones are inscribed and off by 1 um at most."""
    mesh = shape.to_mesh(1e-6)
    return volume_tree(mesh.vertices, mesh.triangles)


def trees_of_links(hand: Hand) -> list[list[fcl.BVHModel]]:
    """Return the triangles of every link of a hand."""
    return [[tree_of(s) for s in link.shapes.get(hand.default_source, ())] for link in hand.links]


def _collisions(one: list[fcl.CollisionObject], other: list[fcl.CollisionObject]) -> list[Floats]:
    """Return the normals of contacts of two links' triangles."""
    normals = []
    for a in one:
        for b in other:
            found = fcl.CollisionResult()
            fcl.collide(a, b, fcl.CollisionRequest(num_max_contacts=20, enable_contact=True), found)
            normals += [np.array(contact.normal) for contact in found.contacts]
    return normals


def _parts(one: list[fcl.CollisionObject], other: list[fcl.CollisionObject], normals: list[Floats]) -> bool:
    """Say whether a shift by `PRESSED` along a contact's normal takes two links off each other."""
    places = [a.getTranslation() for a in one]
    for normal in normals:
        for shift in (PRESSED * normal, -PRESSED * normal):
            for a, place in zip(one, places, strict=True):
                a.setTranslation(place + shift)
            free = not any(fcl.collide(a, b) for a in one for b in other)
            for a, place in zip(one, places, strict=True):
                a.setTranslation(place)
            if free:
                return True
    return False


class Collisions:
    """Look for colliding triangles of one hand's fingers and one object.

    Args:
        links: of the hand, where they are at hand: they take a second to make.
    """

    def __init__(self, hand: Hand, obj: clench.GraspObject, links: list[list[fcl.BVHModel]] | None = None) -> None:
        self.hand = hand
        self.cores = [core_of(s) for body in obj.bodies for s in body.shapes]
        self.objects = [fcl.CollisionObject(tree_of(s)) for body in obj.bodies for s in body.shapes]
        self.links = trees_of_links(hand) if links is None else links
        self.followers = {c.follower for c in hand.couplings}
        free = set(map(frozenset, hand.allowed_pairs_for(hand.default_source)))
        solid = [i for i in hand.solid_links if self.links[i]]
        self.pairs = [(a, b) for a in solid for b in solid if a < b and frozenset((a, b)) not in free]

    def collide(self, q: Floats, T_object_palm: Floats, finger: Finger) -> list[str]:
        """Return the names of the finger's links that collide at a posture."""
        poses = T_object_palm @ self.hand.link_poses(self.hand.coupled(q))
        names = []
        for link in finger.links:
            placed = fcl.Transform(poses[link][:3, :3], poses[link][:3, 3])
            trees = [fcl.CollisionObject(tree, placed) for tree in self.links[link]]
            if any(fcl.collide(tree, obj) for tree in trees for obj in self.objects):
                names.append(self.hand.links[link].name)
        return names

    def core_gap(self, q: Floats, T_object_palm: Floats, link: int) -> float:
        """Return a link's gap by the engine's distance to its core [m]: the triangles of a round one lie inside it."""
        T = T_object_palm @ self.hand.link_poses(self.hand.coupled(q))[link]
        cores = [core_of(s) for s in self.hand.links[link].shapes[self.hand.default_source]]
        return min(gap(core, T, other, np.eye(4)) for core in cores for other in self.cores)

    def collide_among(self, q: Floats) -> list[tuple[str, str]]:
        """Return the names of links of the hand that collide with each other and may not."""
        poses = self.hand.link_poses(self.hand.coupled(q))
        placed = [
            [fcl.CollisionObject(tree, fcl.Transform(T[:3, :3], T[:3, 3])) for tree in trees]
            for trees, T in zip(self.links, poses, strict=True)
        ]
        return [
            (self.hand.links[a].name, self.hand.links[b].name)
            for a, b in self.pairs
            if (met := _collisions(placed[a], placed[b])) and not _parts(placed[a], placed[b], met)
        ]

    def path(self, finger: Finger, start: Floats, end: Floats) -> list[Floats]:
        """Return postures along the proximal-first path; where a joint stops it is backed off."""
        q, postures = start.copy(), []
        for j in finger.joints:
            if self.hand.joints[j].role is JointRole.CLOSING and j not in self.followers:
                run = end[j] - start[j]
                for part in np.linspace(0.0, 1.0, _LOOKS)[1:]:
                    at = q.copy()
                    at[j] = start[j] + part * run
                    if part == 1.0 and abs(run) > 2.0 * BACK:
                        at[j] -= BACK * np.sign(run)
                    postures.append(at)
                q[j] = end[j]
        return postures

    def path_at_once(self, start: Floats, end: Floats) -> list[Floats]:
        """Return postures on the way of joints that all move at speed 1, and 1e-5 rad before each of them stops."""
        rates = np.zeros(len(start))
        for finger in self.hand.fingers:
            for j in finger.joints:
                if self.hand.joints[j].role is JointRole.CLOSING and j not in self.followers:
                    rates[j] = 1.0
        for c in self.hand.couplings:
            rates[c.follower] = abs(c.ratio) * rates[c.leader]
        run = end - start
        stops = sorted({float(abs(run[j])) for j in np.flatnonzero(rates == 1.0)})
        travels = [*np.linspace(0.0, stops[-1], 4 * _LOOKS), *(max(s - BACK, 0.0) for s in stops)]
        return [start + np.sign(run) * np.minimum(rates * s, np.abs(run)) for s in sorted(travels)]

    def closing(self, solution: clench.GraspSolution) -> tuple[Floats, Floats, Floats]:
        """Return where the palm is for the object, shape (4, 4), and a solution's open and final postures, (J,)."""
        T_object_palm = np.linalg.inv(solution.object_pose.matrix) @ solution.hand_pose.matrix
        start = np.array([solution.open_angles[name] for name in self.hand.joint_names])
        end = np.array([solution.joint_angles[name] for name in self.hand.joint_names])
        return T_object_palm, start, end

    def wrong_at_once(self, solution: clench.GraspSolution) -> tuple[Counter[str], list[str]]:
        """Return what was looked at, and what collides on the path of a hand whose fingers all close at once."""
        T_object_palm, start, end = self.closing(solution)
        counted: Counter[str] = Counter(contacts=len(solution.contacts))
        for q in [*self.path_at_once(start, end), end]:
            counted["postures"] += 1
            hit = [name for f in self.hand.fingers for name in self.collide(q, T_object_palm, f)]
            if hit or (hit := [str(pair) for pair in self.collide_among(q)]):
                return counted, [f"{hit} collide at {np.round(q, 6).tolist()}"]
        return counted, []

    def wrong(self, solution: clench.GraspSolution) -> tuple[Counter[str], list[str]]:
        """Return what was looked at, and what is wrong with a certified solution, as sentences.

        On the path and at its end nothing may collide; with a joint advanced alone beyond the contact that stops it,
        its finger must collide with the object.
        """
        T_object_palm, start, end = self.closing(solution)
        counted: Counter[str] = Counter()
        wrong = [f"links {pair} collide at the end" for pair in self.collide_among(end)]
        for name in solution.fingers:
            finger = self.hand.finger(name)
            for q in [*self.path(finger, start, end), end]:
                counted["postures"] += 1
                if hit := self.collide(q, T_object_palm, finger):
                    wrong.append(f"{name}: {hit} collide at {np.round(q, 6).tolist()}")
                    break
        for contact in solution.contacts:
            if contact.passed or contact.stops_joint is None:
                continue
            counted["contacts"] += 1
            joint = self.hand.joint_index(contact.stops_joint)
            # A corner that is clipped in passing is free again before the longest step.
            beyond = [end.copy() for _ in STEPS_BEYOND]
            for q, step in zip(beyond, STEPS_BEYOND, strict=True):
                q[joint] += step * FURTHER * self.hand.joints[joint].direction
            if self.collide(beyond[0], T_object_palm, self.hand.finger(contact.finger)):
                continue
            counted["shallow"] += 1
            link = self.hand.link_index(contact.link)
            if all(self.core_gap(q, T_object_palm, link) >= 0.0 for q in beyond):
                wrong.append(f"{contact.stops_joint} advanced: {contact.link} does not collide ({contact.kind})")
        return counted, wrong

    def check(self, solution: clench.GraspSolution) -> int:
        """Assert that nothing collides on the way and that every contact stops its joint; return how many do."""
        counted, wrong = self.wrong(solution)
        assert not wrong, wrong
        return counted["contacts"]
