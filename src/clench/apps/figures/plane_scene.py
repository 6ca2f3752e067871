"""What a curl plane shows at the end of a finger's closing: a plain value, drawn elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Final

import numpy as np

from clench.base.pose import FloatArray, invert
from clench.grasp.outlines import cut_shape, extent
from clench.grasp.plan import FingerPlan
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.solve.controller import make_problem, plan_hand
from clench.solve.solution import Candidate, Contact, GraspSolution

from .loops import Loop, join_segments, outline_loops

#: Links that end sooner than this after their joint are drawn as if they reached so far [m].
_SHORT: Final = 1e-3


@dataclass(frozen=True, eq=False)
class SectionCurve:
    """Hold one curve of the object's section: the loop, and whether it is of an obstacle."""

    loop: Loop
    obstacle: bool


@dataclass(frozen=True, eq=False)
class LinkSection:
    """Hold the section of one link: its name, the joint (index in the plan) that moves it, and its borders."""

    name: str
    joint: int
    loops: tuple[Loop, ...]


@dataclass(frozen=True, eq=False)
class JointMotion:
    """Place a joint in its plane, with its motion.

    Args:
        name: of the joint. position: its place from the palm outwards in its plan.
        pivot: at the end [m], shape (2,). arm: from there to the next joint or the tip [m], shape (2,).
        turn, full_turn: turned by, and by at most, x towards z [rad].
        angle, open_angle, limit: model angles [rad].
    """

    name: str
    position: int
    pivot: FloatArray
    arm: FloatArray
    turn: float
    full_turn: float
    angle: float
    open_angle: float
    limit: float


@dataclass(frozen=True, eq=False)
class PlaneContact:
    """Place a contact in a plane: point [m] and in-plane unit normal, shape (2,) each; `number` counts from 0."""

    contact: Contact
    number: int
    point: FloatArray
    normal: FloatArray
    plane: int


@dataclass(frozen=True, eq=False)
class PlaneScene:
    """Hold everything that one curl plane shows.

    Args:
        family, plane, planes: which plane of how many. offset: its place along y [m].
        section: of the object. palm: loops of the links that do not move.
        open_links, closed_links: sections of the links that the family's joints move.
        joints: of this family, palm side first.
        contacts: those of the set that lie on this plane; others: those that lie on other planes of the family.
    """

    family: int
    plane: int
    planes: int
    offset: float
    section: tuple[SectionCurve, ...]
    palm: tuple[Loop, ...]
    open_links: tuple[LinkSection, ...]
    closed_links: tuple[LinkSection, ...]
    joints: tuple[JointMotion, ...]
    contacts: tuple[PlaneContact, ...]
    others: tuple[PlaneContact, ...]


class FingerScenes:
    """Make the plane scenes of one set of a finger.

    Args:
        hand, obj, command, solution: as drawn. name: of the finger. candidate: one of its sets.
    """

    def __init__(
        self,
        hand: Hand,
        obj: GraspObject,
        command: GraspCommand,
        solution: GraspSolution,
        name: str,
        candidate: Candidate,
    ) -> None:
        problem = make_problem(hand, obj, command)
        self.hand, self.solution = hand, solution
        self.source, self.packed = problem.source, problem.packed
        self.T_palm_world = invert(solution.hand_pose.matrix)
        self.T_palm_object = self.T_palm_world @ solution.object_pose.matrix
        # The planes that the solve used: planned once for a hand and a posture, and kept.
        plans = [plan for plan in plan_hand(problem).plans if plan.finger.name == name]
        self.plan: FingerPlan = plans[min(candidate.posture, len(plans) - 1)]
        self.poses_open = hand.link_poses(self.plan.posture)
        self.moved_by = self._moved_by()
        self._palms: dict[float, tuple[Loop, ...]] = {}
        self._close(candidate)

    def showing(self, candidate: Candidate) -> FingerScenes:
        """Return the scenes of another set at the same posture, without planning the finger again."""
        other = copy(self)
        other._close(candidate)
        return other

    def _close(self, candidate: Candidate) -> None:
        self.candidate = candidate
        self.closed = _posture(self.hand, self.solution, {**self.solution.open_angles, **candidate.joint_angles})
        self.poses_closed = self.hand.link_poses(self.closed)
        self.frames = [self._frame_now(f) for f in range(len(self.plan.families))]
        listed = self.solution.contacts
        numbers = [listed.index(c) if c in listed else i for i, c in enumerate(candidate.contacts)]
        self.contacts = tuple(self._placed(k, c) for k, c in zip(numbers, candidate.contacts, strict=True))

    def _moved_by(self) -> dict[int, int]:
        """Return, for every link, the last of the plan's joints before it (index in the plan)."""
        position = {p.joint: i for i, p in enumerate(self.plan.joints)}
        result: dict[int, int] = {}
        for i, link in enumerate(self.hand.links):
            if link.joint in position:
                result[i] = position[link.joint]
            elif link.parent in result:
                result[i] = result[link.parent]
        return result

    def _frame_now(self, family: int) -> FloatArray:
        """Return `T_palm_family` at the end: a family after the first rides on the last joint of the one before."""
        T = self.plan.families[family].T_palm_family
        before = [i for i, p in enumerate(self.plan.joints) if p.family == family - 1]
        if not before:
            return T
        link = next(i for i, link in enumerate(self.hand.links) if link.joint == self.plan.joints[before[-1]].joint)
        return np.asarray(self.poses_closed[link] @ invert(self.poses_open[link]) @ T)

    def family_of(self, contact: Contact) -> int:
        """Return the family on whose planes a contact lies: that of the joint that it stopped, or of its link."""
        for p in self.plan.joints:
            if self.hand.joints[p.joint].name == contact.stops_joint:
                return p.family
        joint = self.moved_by.get(self.hand.link_index(contact.link))
        return 0 if joint is None else self.plan.joints[joint].family

    def _placed(self, number: int, contact: Contact) -> PlaneContact:
        family = self.family_of(contact)
        T = invert(self.frames[family]) @ self.T_palm_world
        place = T[:3, :3] @ contact.position + T[:3, 3]
        normal = (T[:3, :3] @ contact.normal)[[0, 2]]
        size = float(np.linalg.norm(normal))
        offsets = self.plan.families[family].offsets
        plane = contact.plane if contact.plane is not None else int(np.argmin(np.abs(offsets - place[1])))
        return PlaneContact(
            contact, number, place[[0, 2]], normal / size if size > 0.0 else normal, min(plane, len(offsets) - 1)
        )

    def touched_planes(self, most: int) -> list[tuple[int, int]]:
        """Return (family, plane) pairs worth a picture, at most `most`: where the set touches, and every family."""
        result: list[tuple[int, int]] = []
        for family in range(len(self.plan.families)):
            planes = [c.plane for c in self.contacts if self.family_of(c.contact) == family]
            counts = {k: planes.count(k) for k in dict.fromkeys(planes)}
            middle = len(self.plan.families[family].offsets) // 2
            default = middle if self.candidate.plane is None else self.candidate.plane
            ranked = sorted(counts, key=lambda k: -counts[k]) or [default]
            result += [(family, k) for k in ranked]
        firsts = [next(pair for pair in result if pair[0] == f) for f in range(len(self.plan.families))]
        kept = (firsts + [pair for pair in result if pair not in firsts])[:most]
        return sorted(kept)

    def scene(self, family: int, plane: int, *, with_open: bool = True) -> PlaneScene:
        """Cut object and hand by one plane at the end of the closing."""
        chosen = self.plan.families[family]
        offset = float(chosen.offsets[plane])
        joints = self._joints(family)
        mine = [c for c in self.contacts if self.family_of(c.contact) == family]
        turns = {j.position: j.turn for j in joints}
        return PlaneScene(
            family=family,
            plane=plane,
            planes=len(chosen.offsets),
            offset=offset,
            section=self._section(family, offset),
            palm=self._palm(family, offset),
            open_links=self._links(family, plane, dict.fromkeys(turns, 0.0)) if with_open else (),
            closed_links=(*self._links(family, plane, turns), *self._later_links(family, offset)),
            joints=tuple(joints),
            contacts=tuple(c for c in mine if c.plane == plane),
            others=tuple(c for c in mine if c.plane != plane),
        )

    def _section(self, family: int, offset: float) -> tuple[SectionCurve, ...]:
        from clench.kernels.section import cut_mesh

        tree = self.packed.full_tree
        segments, sources = cut_mesh(tree, invert(self.frames[family]) @ self.T_palm_object, offset)
        bodies = np.empty(len(tree.body), dtype=np.int64)
        bodies[tree.original] = tree.body
        curves = []
        for body, role in enumerate(self.packed.body_roles):
            own = segments[bodies[sources] == body]
            curves += [SectionCurve(loop, role is BodyRole.OBSTACLE) for loop in join_segments(own)]
        return tuple(curves)

    def _palm(self, family: int, offset: float) -> tuple[Loop, ...]:
        """Cut what stands still beside the family's links: fixed links, and links of this finger before its joints."""
        if family == 0 and offset in self._palms:
            return self._palms[offset]
        still = set(self.hand.fixed_links) | {i for i in self.plan.finger.links if i not in self.moved_by}
        before = {i for i, j in self.moved_by.items() if self.plan.joints[j].family < family}
        T_family_palm = invert(self.frames[family])
        loops = [loop for i in sorted(still | before) for loop in self._cut(i, T_family_palm, offset)]
        if family == 0:  # the first family's planes stand still, so every set sees the same
            self._palms[offset] = tuple(loops)
        return tuple(loops)

    def _places(self, family: int, turns: dict[int, float]) -> dict[int, tuple[FloatArray, float]]:
        """Return pivot and accumulated turn of every joint of a family."""
        places: dict[int, tuple[FloatArray, float]] = {}
        total, place, before = 0.0, np.zeros(2), np.zeros(2)
        for i, p in enumerate(self.plan.joints):
            if p.family == family:
                place = place + _turned(p.pivot - before, total)
                total += turns[i]
                before = p.pivot
                places[i] = (place, total)
        return places

    def _links(self, family: int, plane: int, turns: dict[int, float]) -> tuple[LinkSection, ...]:
        places = self._places(family, turns)
        borders: dict[int, list[Loop]] = {}
        for item in self.plan.families[family].outlines[plane]:
            if self.moved_by[item.link] != item.joint:
                continue  # it rides on a later family's joint, whose planes show it
            pivot, total = places[item.joint]
            loops = outline_loops(item.outline.turned(total))
            borders.setdefault(item.link, []).extend(Loop(loop.points + pivot, loop.closed) for loop in loops)
        return tuple(
            LinkSection(self.hand.links[i].name, self.moved_by[i], tuple(loops)) for i, loops in borders.items()
        )

    def _later_links(self, family: int, offset: float) -> list[LinkSection]:
        """Cut the links that joints of later families move, where they are at the end."""
        T_family_palm = invert(self.frames[family])
        sections = []
        for i, joint in self.moved_by.items():
            if self.plan.joints[joint].family > family:
                loops = self._cut(i, T_family_palm, offset)
                sections += [LinkSection(self.hand.links[i].name, joint, tuple(loops))] if loops else []
        return sections

    def _cut(self, link: int, T_family_palm: FloatArray, offset: float) -> list[Loop]:
        """Return the borders of a link's section with a plane, at the end."""
        T = T_family_palm @ self.poses_closed[link]
        loops = []
        for shape in self.hand.links[link].shapes.get(self.source, ()):
            low, high = extent(shape, T)
            outline = cut_shape(shape, T, offset) if low <= offset <= high else None
            loops += outline_loops(outline) if outline is not None else []
        return loops

    def _joints(self, family: int) -> list[JointMotion]:
        turns, full = {}, {}
        for i, p in enumerate(self.plan.joints):
            if p.family == family:
                turns[i] = p.turn * float(self.closed[p.joint] - self.plan.posture[p.joint])
                full[i] = p.rate * (p.stop - p.start)
        places = self._places(family, turns)
        order = list(turns)
        joints = []
        for i in order:
            joint = self.hand.joints[self.plan.joints[i].joint]
            pivot = places[i][0]
            later = order.index(i) + 1
            ahead = places[order[later]][0] if later < len(order) else self._tip(family, i, places)
            open_angle = float(self.plan.posture[self.plan.joints[i].joint])
            limit = open_angle + self.plan.joints[i].turn * full[i]
            angle = float(self.closed[self.plan.joints[i].joint])
            joints.append(JointMotion(joint.name, i, pivot, ahead - pivot, turns[i], full[i], angle, open_angle, limit))
        return joints

    def _tip(self, family: int, joint: int, places: dict[int, tuple[FloatArray, float]]) -> FloatArray:
        """Return the point farthest from a joint on the links that it moves, over all planes, at the end."""
        pivot, total = places[joint]
        best = np.array([_SHORT, 0.0])
        for row in self.plan.families[family].outlines:
            for item in row:
                if item.joint == joint == self.moved_by[item.link] and len(item.outline.vertices):
                    far = item.outline.vertices[np.argmax(np.linalg.norm(item.outline.vertices, axis=1))]
                    best = max(best, far, key=lambda v: float(np.linalg.norm(v)))
        return pivot + _turned(best, total)


def _posture(hand: Hand, solution: GraspSolution, angles: Mapping[str, float]) -> FloatArray:
    known = {**solution.joint_angles, **angles}
    return np.array([known.get(j.name, j.open_value) for j in hand.joints], dtype=np.float64)


def _turned(v: FloatArray, angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1]])


def bounds(scenes: Sequence[PlaneScene]) -> tuple[FloatArray, FloatArray]:
    """Return the corners of a box around the finger, open and closed, and the part of the object within its reach."""
    loops = [loop for s in scenes for link in (*s.open_links, *s.closed_links) for loop in link.loops]
    points = [loop.points for loop in loops]
    points += [np.array([j.pivot, j.pivot + 0.7 * _turned(j.arm, -j.turn)]) for s in scenes for j in s.joints]
    points += [np.array([c.point]) for s in scenes for c in s.contacts]
    links = np.vstack(points)
    low, high = links.min(axis=0), links.max(axis=0)
    reach = 0.35 * float((high - low).max())
    near = [c.loop.points for s in scenes for c in s.section if not c.obstacle]
    if near:
        section = np.vstack(near)
        low = np.maximum(np.minimum(low, section.min(axis=0)), low - reach)
        high = np.minimum(np.maximum(high, section.max(axis=0)), high + reach)
    return low, high
