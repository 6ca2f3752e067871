"""Cut object and finger by its curl planes, and by planes through contacts between those, at the end of its closing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from typing import Final

import numpy as np

from clench.closing.curl_planes import LinkOutline
from clench.closing.finger_plan import FingerPlan
from clench.closing.outlines import cut_shape, extent
from clench.core.pose import FloatArray, invert
from clench.models.command import GraspCommand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.solver.planning import plan_hand
from clench.solver.problem import make_problem
from clench.solver.solution import Candidate, Contact, GraspSolution

from .loops import Loop, join_segments, outline_loops
from .plane_scene import JointMotion, LinkSection, PlaneContact, PlaneScene, SectionCurve, along_y, turned

#: Links that end sooner than this after their joint are drawn as if they reached so far [m].
_SHORT: Final = 1e-3
#: Contacts this close to a plane are drawn on it [m].
_ON_PLANE: Final = 2e-6
#: Contacts between the planes share a plane within this distance, which is invisible [m].
_NEARLY: Final = 1e-4
#: A smaller distance to drawn borders is invisible [m].
_UNSEEN: Final = 2e-5
#: A plane in which a flat side of link or object lies cuts nothing there; this far beside it, it does [m].
_ASIDE: Final = 1e-6


class FingerScenes:
    """Make the plane scenes of one candidate of a finger.

    Args:
        hand, obj, command, solution: as drawn. name: of the finger. candidate: one of its candidates.
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
        """Return the scenes of another candidate at the same posture, without planning the finger again."""
        other = copy(self)
        other._close(candidate)
        return other

    def _close(self, candidate: Candidate) -> None:
        self.candidate = candidate
        self.closed = _posture(self.hand, self.solution, {**self.solution.open_angles, **candidate.joint_angles})
        self.poses_closed = self.hand.link_poses(self.closed)
        self.frames = [self._frame_now(f) for f in range(len(self.plan.axis_groups))]
        # Per axis group: the curl planes of the finger, then planes through contacts that lie on no curl plane.
        self.offsets = [f.offsets for f in self.plan.axis_groups]
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

    def _frame_now(self, axis_group: int) -> FloatArray:
        """Return `T_palm_axis_group` at the end: a later axis group rides on the last joint of the one before."""
        T = self.plan.axis_groups[axis_group].T_palm_axis_group
        before = [i for i, p in enumerate(self.plan.joints) if p.axis_group == axis_group - 1]
        if not before:
            return T
        link = next(i for i, link in enumerate(self.hand.links) if link.joint == self.plan.joints[before[-1]].joint)
        return np.asarray(self.poses_closed[link] @ invert(self.poses_open[link]) @ T)

    def axis_group_of(self, contact: Contact) -> int:
        """Return the axis group on whose planes a contact lies: that of the joint that it stopped, or of its link."""
        for p in self.plan.joints:
            if self.hand.joints[p.joint].name == contact.stops_joint:
                return p.axis_group
        joint = self.moved_by.get(self.hand.link_index(contact.link))
        return 0 if joint is None else self.plan.joints[joint].axis_group

    def _placed(self, number: int, contact: Contact) -> PlaneContact:
        axis_group = self.axis_group_of(contact)
        T = invert(self.frames[axis_group]) @ self.T_palm_world
        place = T[:3, :3] @ contact.position + T[:3, 3]
        normal = (T[:3, :3] @ contact.normal)[[0, 2]]
        size = float(np.linalg.norm(normal))
        plane = contact.plane if contact.plane is not None else self._plane_through(contact, axis_group, place)
        return PlaneContact(
            contact,
            number,
            place[[0, 2]],
            normal / size if size > 0.0 else normal,
            plane,
            self.place(axis_group, plane),
        )

    def _plane_through(self, contact: Contact, axis_group: int, place: FloatArray) -> int:
        """Return the plane through a contact; where the axis group has none there, lay one."""
        offsets, y = self.offsets[axis_group], float(place[1])
        nearest = int(np.argmin(np.abs(offsets - y)))
        if abs(offsets[nearest] - y) <= _ON_PLANE:
            return nearest
        laid = nearest >= len(self.plan.axis_groups[axis_group].offsets)
        near = laid and abs(offsets[nearest] - y) <= _NEARLY
        if near and self._missed_by(contact, axis_group, place, float(offsets[nearest])) <= _UNSEEN:
            return nearest
        # A coarse score: the plane through the contact itself wins unless a neighbouring plane is clearly better.
        aside = min(
            (0.0, _ASIDE, -_ASIDE), key=lambda step: round(self._missed_by(contact, axis_group, place, y + step), 4)
        )
        self.offsets[axis_group] = np.append(offsets, y + aside)
        return len(offsets)

    def _missed_by(self, contact: Contact, axis_group: int, place: FloatArray, offset: float) -> float:
        """Return how far a contact is from the object's section and the link's in a plane, together [m]."""
        link = self.hand.link_index(contact.link)
        section = [curve.loop for curve in self._section(axis_group, offset)]
        loops = self._cut(link, invert(self.frames[axis_group]) @ self.poses_closed[link], offset)
        nearest = [min((c.distance(place[[0, 2]]) for c in curves), default=1.0) for curves in (section, loops)]
        return sum(nearest)

    def place(self, axis_group: int, plane: int) -> str:
        """Return in words which plane it is, and where."""
        planes = self.plan.axis_groups[axis_group].offsets
        offset = float(self.offsets[axis_group][plane])
        where = along_y(offset)
        if plane < len(planes):
            return f"plane {plane} of 0 to {len(planes) - 1}, {where}"
        if planes[0] < offset < planes[-1]:
            return f"between the planes, {where}"
        return f"beside the plane{'s' if len(planes) > 1 else ''}, {where}"

    def touched_planes(self, most: int) -> list[tuple[int, int]]:
        """Return (axis group, plane) pairs worth a picture, at most `most`: where the candidate touches, and every axis
        group.

        Planes with contacts that last until the end come first, then planes with the most contacts.
        """
        result: list[tuple[int, int]] = []
        for axis_group in range(len(self.plan.axis_groups)):
            mine = [c for c in self.contacts if self.axis_group_of(c.contact) == axis_group]
            planes = [c.plane for c in mine]
            lasting = [c.plane for c in mine if not c.contact.passed]
            middle = len(self.plan.axis_groups[axis_group].offsets) // 2
            default = middle if self.candidate.plane is None else self.candidate.plane
            counts = {k: (-lasting.count(k), -planes.count(k)) for k in planes or [default]}
            result += [(axis_group, k) for k in sorted(counts, key=counts.__getitem__)]
        firsts = [next(pair for pair in result if pair[0] == f) for f in range(len(self.plan.axis_groups))]
        kept = (firsts + [pair for pair in result if pair not in firsts])[:most]
        return sorted(kept)

    def scene(self, axis_group: int, plane: int, *, with_open: bool = True) -> PlaneScene:
        """Cut object and hand by one plane at the end of the closing."""
        offset = float(self.offsets[axis_group][plane])
        joints = self._joints(axis_group)
        mine = [c for c in self.contacts if self.axis_group_of(c.contact) == axis_group]
        turns = {j.position: j.turn for j in joints}
        return PlaneScene(
            axis_group=axis_group,
            plane=plane,
            place=self.place(axis_group, plane),
            offset=offset,
            section=self._section(axis_group, offset),
            palm=self._palm(axis_group, offset),
            open_links=self._links(axis_group, plane, dict.fromkeys(turns, 0.0)) if with_open else (),
            closed_links=(*self._links(axis_group, plane, turns), *self._later_links(axis_group, offset)),
            joints=tuple(joints),
            contacts=tuple(c for c in mine if c.plane == plane),
            others=tuple(c for c in mine if c.plane != plane),
        )

    def _section(self, axis_group: int, offset: float) -> tuple[SectionCurve, ...]:
        from clench.kernels.sections.section import cut_mesh

        tree = self.packed.full_tree
        segments, sources = cut_mesh(tree, invert(self.frames[axis_group]) @ self.T_palm_object, offset)
        bodies = np.empty(len(tree.body), dtype=np.int64)
        bodies[tree.original] = tree.body
        curves = []
        for body, role in enumerate(self.packed.body_roles):
            own = segments[bodies[sources] == body]
            curves += [SectionCurve(loop, role is BodyRole.OBSTACLE) for loop in join_segments(own)]
        return tuple(curves)

    def _palm(self, axis_group: int, offset: float) -> tuple[Loop, ...]:
        """Cut the fixed shapes beside the axis group's links: fixed links, and earlier links of this finger."""
        if axis_group == 0 and offset in self._palms:
            return self._palms[offset]
        still = set(self.hand.fixed_links) | {i for i in self.plan.finger.links if i not in self.moved_by}
        before = {i for i, j in self.moved_by.items() if self.plan.joints[j].axis_group < axis_group}
        T_axis_group_palm = invert(self.frames[axis_group])
        poses = self.poses_closed
        loops = [loop for i in sorted(still | before) for loop in self._cut(i, T_axis_group_palm @ poses[i], offset)]
        if axis_group == 0:  # the first axis group's planes stand still, so every candidate sees the same
            self._palms[offset] = tuple(loops)
        return tuple(loops)

    def _places(self, axis_group: int, turns: dict[int, float]) -> dict[int, tuple[FloatArray, float]]:
        """Return pivot and accumulated turn of every joint of an axis group."""
        places: dict[int, tuple[FloatArray, float]] = {}
        total, place, before = 0.0, np.zeros(2), np.zeros(2)
        for i, p in enumerate(self.plan.joints):
            if p.axis_group == axis_group:
                place = place + turned(p.pivot - before, total)
                total += turns[i]
                before = p.pivot
                places[i] = (place, total)
        return places

    def _outlines(self, axis_group: int, plane: int) -> Sequence[LinkOutline]:
        """Return the outlines of an axis group's links at the open posture: the plan's own, or cut in the same way."""
        chosen = self.plan.axis_groups[axis_group]
        if plane < len(chosen.outlines):
            return chosen.outlines[plane]
        T_axis_group_palm, offset = invert(chosen.T_palm_axis_group), float(self.offsets[axis_group][plane])
        row = []
        for i, joint in self.moved_by.items():
            if self.plan.joints[joint].axis_group == axis_group:
                for shape in self.hand.links[i].shapes.get(self.source, ()):
                    outline = cut_shape(shape, T_axis_group_palm @ self.poses_open[i], offset)
                    if outline is not None:
                        row.append(LinkOutline(i, joint, outline.about(self.plan.joints[joint].pivot)))
        return row

    def _links(self, axis_group: int, plane: int, turns: dict[int, float]) -> tuple[LinkSection, ...]:
        places = self._places(axis_group, turns)
        borders: dict[int, list[Loop]] = {}
        for item in self._outlines(axis_group, plane):
            if self.moved_by[item.link] != item.joint:
                continue  # it rides on a later axis group's joint, whose planes show it
            pivot, total = places[item.joint]
            loops = outline_loops(item.outline.turned(total))
            borders.setdefault(item.link, []).extend(Loop(loop.points + pivot, loop.closed) for loop in loops)
        return tuple(
            LinkSection(self.hand.links[i].name, self.moved_by[i], tuple(loops)) for i, loops in borders.items()
        )

    def _later_links(self, axis_group: int, offset: float) -> list[LinkSection]:
        """Cut the links that joints of later axis groups move, at the end posture."""
        T_axis_group_palm = invert(self.frames[axis_group])
        sections = []
        for i, joint in self.moved_by.items():
            if self.plan.joints[joint].axis_group > axis_group:
                loops = self._cut(i, T_axis_group_palm @ self.poses_closed[i], offset)
                sections += [LinkSection(self.hand.links[i].name, joint, tuple(loops))] if loops else []
        return sections

    def _cut(self, link: int, T_axis_group_link: FloatArray, offset: float) -> list[Loop]:
        """Return the borders of a link's section with a plane."""
        loops = []
        for shape in self.hand.links[link].shapes.get(self.source, ()):
            low, high = extent(shape, T_axis_group_link)
            outline = cut_shape(shape, T_axis_group_link, offset) if low <= offset <= high else None
            loops += outline_loops(outline) if outline is not None else []
        return loops

    def _joints(self, axis_group: int) -> list[JointMotion]:
        turns, full = {}, {}
        for i, p in enumerate(self.plan.joints):
            if p.axis_group == axis_group:
                turns[i] = p.turn * float(self.closed[p.joint] - self.plan.posture[p.joint])
                full[i] = p.rate * (p.stop - p.start)
        places = self._places(axis_group, turns)
        order = list(turns)
        joints = []
        for i in order:
            joint = self.hand.joints[self.plan.joints[i].joint]
            pivot = places[i][0]
            later = order.index(i) + 1
            ahead = places[order[later]][0] if later < len(order) else self._tip(axis_group, i, places)
            open_angle = float(self.plan.posture[self.plan.joints[i].joint])
            limit = open_angle + self.plan.joints[i].turn * full[i]
            angle = float(self.closed[self.plan.joints[i].joint])
            joints.append(JointMotion(joint.name, i, pivot, ahead - pivot, turns[i], full[i], angle, open_angle, limit))
        return joints

    def _tip(self, axis_group: int, joint: int, places: dict[int, tuple[FloatArray, float]]) -> FloatArray:
        """Return the point farthest from a joint on the links that it moves, over all planes, at the end."""
        pivot, total = places[joint]
        best = np.array([_SHORT, 0.0])
        for row in self.plan.axis_groups[axis_group].outlines:
            for item in row:
                if item.joint == joint == self.moved_by[item.link] and len(item.outline.vertices):
                    far = item.outline.vertices[np.argmax(np.linalg.norm(item.outline.vertices, axis=1))]
                    best = max(best, far, key=lambda v: float(np.linalg.norm(v)))
        return pivot + turned(best, total)


def _posture(hand: Hand, solution: GraspSolution, angles: Mapping[str, float]) -> FloatArray:
    known = {**solution.joint_angles, **angles}
    return np.array([known.get(j.name, j.open_value) for j in hand.joints], dtype=np.float64)
