"""Judge whole solves by an independent engine, and print a table: ``python tests/engine/statistics.py --poses 200``.

For every contact of every set that no later motion opened: how far its point is from the object's surface and from the
link's, by python-fcl. For every solve: how deep the chosen posture overlaps the object, which is what the planes miss
between them.
"""

import argparse
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import clench
from clench.models.hand.hand import Hand

sys.path.insert(0, str(Path(__file__).parents[1]))

from engine.surfaces import Floats, HandSurface, distance_to_tree, volume_tree

SHARED = Path(__file__).parents[3] / "shared" / "data"
HANDS = {
    "Shadow": "hands/shadow_hand_mjcf/right_hand.xml",
    "Allegro": "hands/wonik_allegro_mjcf/right_hand.xml",
    "Allegro (URDF)": "hands/allegro_urdf/allegro_hand_right.urdf",
    "LEAP": "hands/leap_hand_urdf/leap_hand_right.urdf",
    "Barrett": "hands/barrett_hand_urdf/bhand_model.urdf",
    "D'Claw": "hands/dclaw_urdf/dclaw_gripper.urdf",
    "ORCA": "hands/orca_v1_mjcf/orcahand_right.mjcf",
}
OBJECTS = {
    "mug": "objects/ycb_mug/textured.obj",
    "drill": "objects/ycb_power_drill/textured.obj",
    "banana": "objects/ycb_banana/textured.obj",
    "scissors": "objects/ycb_scissors/textured.obj",
    "marker": "objects/ycb_large_marker/textured.obj",
    "cracker box": "objects/ycb_cracker_box/textured.obj",
    "tennis ball": "objects/ycb_tennis_ball/textured.obj",
    "wineglass": "objects/cdb_wineglass/wineglass.stl",
    "torus": "objects/cdb_torusmedium/torusmedium.stl",
    "teapot": "objects/cdb_teapot/teapot.stl",
}


@dataclass(frozen=True)
class ContactCheck:
    """How far one contact point is from the two surfaces [m], and where it belongs."""

    finger: str
    link: str
    plane: int | None
    kind: str
    to_object: float
    to_link: float


class Judge:
    """Judge solutions of one hand and one object."""

    def __init__(self, hand: Hand, obj: clench.GraspObject) -> None:
        self.hand, self.obj = hand, obj
        self.surface = HandSurface(hand, hand.default_source)
        meshes = [shape.mesh.transformed(shape.pose) for body in obj.bodies for shape in body.shapes]  # type: ignore[union-attr]
        self.trees = [volume_tree(mesh.vertices, mesh.triangles) for mesh in meshes]

    def contacts(self, solution: clench.GraspSolution) -> Iterator[ContactCheck]:
        """Yield a check of every contact of every set, those that passed left out."""
        T_object_world = solution.object_pose.inverse()
        T_palm_world = solution.hand_pose.inverse()
        for finger in solution.fingers.values():
            for candidate in finger.candidates:
                poses = self.hand.link_poses(self._posture(solution, candidate))
                for contact in candidate.contacts:
                    if contact.passed:
                        continue
                    in_object = T_object_world.apply(contact.position)
                    link = self.hand.link_index(contact.link)
                    in_palm = T_palm_world.apply(contact.position)
                    in_link = poses[link][:3, :3].T @ (in_palm - poses[link][:3, 3])
                    yield ContactCheck(
                        contact.finger,
                        contact.link,
                        contact.plane if candidate.plane is not None else None,
                        str(contact.kind),
                        min(distance_to_tree(tree, in_object) for tree in self.trees),
                        self.surface.distance(link, in_link),
                    )

    def _posture(self, solution: clench.GraspSolution, candidate: clench.Candidate) -> Floats:
        angles = {**solution.open_angles, **candidate.joint_angles}
        return np.array([angles[name] for name in self.hand.joint_names])


@dataclass
class Row:
    """What was found about one hand."""

    solves: int = 0
    statuses: dict[str, int] = field(default_factory=dict)
    to_object: list[float] = field(default_factory=list)
    to_link: list[float] = field(default_factory=list)
    depth: list[float] = field(default_factory=list)
    depth_fine: list[float] = field(default_factory=list)
    seconds: float = 0.0

    def add(self, solution: clench.GraspSolution, checks: list[ContactCheck], fine: float | None) -> None:
        """Take in one solve."""
        self.solves += 1
        self.statuses[solution.status] = self.statuses.get(solution.status, 0) + 1
        self.to_object += [c.to_object for c in checks]
        self.to_link += [c.to_link for c in checks]
        if any(not c.passed for c in solution.contacts):
            self.depth.append(solution.max_penetration or 0.0)
            if fine is not None:
                self.depth_fine.append(fine)

    def cells(self) -> list[str]:
        """Return the row's numbers as text: contacts and solves, worst distances [um], depths [mm]."""
        depth = _millimetres(self.depth)
        statuses = " ".join(f"{name} {count}" for name, count in sorted(self.statuses.items()))
        return [
            str(self.solves),
            statuses,
            str(len(self.to_object)),
            f"{1e6 * max(self.to_object, default=0.0):.2g}",
            f"{1e6 * max(self.to_link, default=0.0):.2g}",
            depth,
            _millimetres(self.depth_fine) if self.depth_fine else "-",
        ]


def _millimetres(depths: list[float]) -> str:
    if not depths:
        return "-"
    return " / ".join(f"{1e3 * v:.2f}" for v in (np.median(depths), np.quantile(depths, 0.9), max(depths)))


def solve_all(
    hand: Hand, obj: clench.GraspObject, poses: int, seed: int, planes: int, fine: int | None
) -> Iterator[tuple[clench.GraspSolution, list[ContactCheck], float | None]]:
    """Yield solutions from approach poses with the checks of their contacts, and the depth left by `fine` planes."""
    judge = Judge(hand, obj)
    for pose in clench.approach_poses(hand, obj, poses, seed):
        solution = clench.solve(hand, obj, clench.GraspCommand(hand_pose=pose, planes=planes, preshape="open"))
        depth = None
        if fine is not None:
            depth = clench.solve(
                hand, obj, clench.GraspCommand(hand_pose=pose, planes=fine, preshape="open")
            ).max_penetration
        yield solution, list(judge.contacts(solution)), depth


def main() -> None:
    """Print one row per hand, and every contact that is off by more than 1 um."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--planes", type=int, default=5)
    parser.add_argument("--fine", type=int, default=None, help="also solve with this many planes, for the depths")
    parser.add_argument("--hands", nargs="*", default=list(HANDS))
    parser.add_argument("--objects", nargs="*", default=list(OBJECTS))
    asked = parser.parse_args()
    objects = {name: clench.GraspObject.load(SHARED / OBJECTS[name]) for name in asked.objects}
    print(
        "| hand | solves | status | contacts | worst to object, um | worst to link, um | depth | depth, finer planes |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for name in asked.hands:
        hand = clench.Hand.load(SHARED / HANDS[name])
        row = Row()
        begun = time.perf_counter()
        for label, obj in objects.items():
            solved = solve_all(hand, obj, asked.poses, asked.seed, asked.planes, asked.fine)
            for number, (solution, checks, fine) in enumerate(solved):
                row.add(solution, checks, fine)
                for check in checks:
                    if max(check.to_object, check.to_link) > 1e-6:
                        print(f"{name}, {label}, pose {number}: {check}", file=sys.stderr)
        print(f"| {name} | " + " | ".join(row.cells()) + " |", flush=True)
        print(f"{name}: {time.perf_counter() - begun:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    main()
