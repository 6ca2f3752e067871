"""Compare `together` with GraspIt!'s autoGrasp: 750 cases as that program computed them (see the README beside them).

Run from `tests`: ``python -m graspit.compare --file compared.jsonl``; a run that was ended goes on. Both close the same
raw meshes with the same speeds; what differs is that GraspIt! steps by 0.0075 rad, bisects a collision to a gap of
0.1 mm, and sees what it steps into, not what it passes. Every finger whose joints end elsewhere is explained by a
measurement of its own:

- *as its step and gap allow*: the joints differ by no more than one step.
- *it stops at a gap*: at its posture the link that it stopped is within 0.2 mm of what stops it, so it is done where we
  go on sliding past, or the last 0.2 mm of a flat approach take a larger turn.
- *it stepped over a contact*: at our stop, going on collides, as python-fcl says, and the collision is over again
  within two of its steps.
- *follows another finger*: a finger that it meets ended elsewhere.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import fcl
import numpy as np
import numpy.typing as npt

import clench
from clench.models.hand.hand import Finger, Hand
from engine.surfaces import volume_tree
from resumable import each

Floats = npt.NDArray[np.float64]
SHARED = Path(__file__).parents[2].parent / "shared" / "data" / "graspit"
OBJECTS = ("cylinder", "flask", "mug")
#: Largest difference between its own runs with other steps, by the README of the cases [rad].
STEP = 0.012
#: Gap within which it calls two triangles a contact [m].
NEAR = 2e-4
AGREES, AT_GAP, PASSED, FOLLOWS, UNEXPLAINED = (
    "as its step and gap allow",
    "it stops at a gap",
    "it stepped over a contact",
    "follows another finger",
    "unexplained",
)


@dataclass(frozen=True)
class Compared:
    """One finger of one case: the largest difference of its joints [rad], and what explains it."""

    obj: str
    case: int
    finger: str
    difference: float
    kind: str


def load_hand(folder: Path) -> Hand:
    """Load the hand with the pairs of links that GraspIt! ignores as the pairs that may overlap."""
    data = json.loads((folder / "hand.json").read_text())
    pairs = ", ".join(json.dumps(pair) for pair in data["ignored_collision_pairs"])
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch) / "hand.toml"
        file.write_text(f'collision_source = "raw"\nallowed_pairs = [{pairs}]\n')
        return clench.Hand.load(folder / f"{folder.name}.urdf", hand_file=file)


def read_cases(name: str, limit: int | None = None) -> Iterator[dict[str, Any]]:
    """Yield the cases of an object, those left out that the program aborted."""
    with (SHARED / f"DLR_{name}.jsonl").open() as lines:
        for line in list(lines)[:limit]:
            case = json.loads(line)
            if not case.get("interpolation_failed"):
                yield case


class Comparison:
    """Compare the cases of one hand and one object."""

    def __init__(self, hand: Hand, name: str) -> None:
        self.hand, self.name = hand, name
        self.obj = clench.GraspObject.load(SHARED / "objects" / f"{name}.obj")
        self.object = [fcl.CollisionObject(_tree(s)) for body in self.obj.bodies for s in body.shapes]
        self.links = [[_tree(s) for s in link.shapes.get(hand.default_source, ())] for link in hand.links]
        self.free = set(map(frozenset, hand.allowed_pairs_for(hand.default_source)))

    def compare(self, case: dict[str, Any]) -> list[Compared]:
        """Close the hand as in a case and explain every finger."""
        placed = case["hand_pose_in_object"]
        pose = clench.Pose(placed["t"], wxyz=np.array(placed["q_wxyz"]) / np.linalg.norm(placed["q_wxyz"]))
        command = clench.GraspCommand(
            hand_pose=pose, order=clench.ClosingOrder.TOGETHER, planes=1, measure=False, preshape="open"
        )
        solution = clench.solve(self.hand, self.obj, command)
        ours = np.array([solution.joint_angles[n] for n in self.hand.joint_names])
        theirs = np.array(case["joints_final"])
        T = np.linalg.inv(pose.matrix)
        kinds = {f.name: self._kind(f, ours, theirs, T) for f in self.hand.fingers}
        if any(kind not in (AGREES, UNEXPLAINED) for kind in kinds.values()):
            kinds = {n: FOLLOWS if k == UNEXPLAINED and self._meets(n, ours, theirs) else k for n, k in kinds.items()}
        return [
            Compared(self.name, case["case"], f.name, float(np.abs(ours - theirs)[list(f.joints)].max()), kinds[f.name])
            for f in self.hand.fingers
        ]

    def _kind(self, finger: Finger, ours: Floats, theirs: Floats, T_palm_object: Floats) -> str:
        joints = [j for j in finger.joints if abs(ours[j] - theirs[j]) > STEP]
        if not joints:
            return AGREES
        first = min(joints, key=lambda j: min(ours[j], theirs[j]))
        behind = finger.links[finger.joints.index(first) :]
        if theirs[first] < ours[first]:
            least = min(self._gap(link, theirs, T_palm_object) for link in behind)
            return AT_GAP if least <= NEAR else UNEXPLAINED
        return PASSED if self._is_thin(first, finger, ours, theirs, T_palm_object) else UNEXPLAINED

    def _is_thin(self, joint: int, finger: Finger, ours: Floats, theirs: Floats, T: Floats) -> bool:
        """Say whether what stops us is over within one of its steps, by the other engine."""
        seen = []
        for ahead in np.linspace(0.0, 2.0 * STEP, 60):
            q = self.hand.coupled(np.minimum(ours[joint] + ahead, theirs))
            seen.append(min(self._gap(link, q, T) for link in finger.links) <= 0.0)
        return any(seen) and not seen[-1]

    def _meets(self, name: str, ours: Floats, theirs: Floats) -> bool:
        """Say whether a finger is close to another one, at either end."""
        for q in (ours, theirs):
            poses = self.hand.link_poses(q)
            finger = self.hand.finger(name)
            others = [i for f in self.hand.fingers if f.name != name for i in f.links]
            if min(self._between(a, b, poses) for a in finger.links for b in others) <= NEAR:
                return True
        return False

    def _gap(self, link: int, q: Floats, T_palm_object: Floats) -> float:
        """Return a link's gap to the object, the palm and other fingers; 0 or less where they cross."""
        poses = self.hand.link_poses(q)
        inverse = np.linalg.inv(T_palm_object) @ poses[link]
        gaps = [_distance(t, inverse, o) for t in self.links[link] for o in self.object]
        own = next(f.links for f in self.hand.fingers if link in f.links)
        others = [i for i in range(len(self.hand.links)) if i not in own and frozenset((i, link)) not in self.free]
        return min([*gaps, *(self._between(link, i, poses) for i in others)], default=np.inf)

    def _between(self, a: int, b: int, poses: Floats) -> float:
        relative = np.linalg.inv(poses[b]) @ poses[a]
        placed = [_distance(one, relative, fcl.CollisionObject(two)) for one in self.links[a] for two in self.links[b]]
        return min(placed, default=np.inf)


def _tree(shape: Any) -> fcl.BVHModel:
    mesh = shape.to_mesh(1e-6)
    return volume_tree(mesh.vertices, mesh.triangles)


def _distance(tree: fcl.BVHModel, T: Floats, other: fcl.CollisionObject) -> float:
    placed = fcl.CollisionObject(tree, fcl.Transform(T[:3, :3], T[:3, 3]))
    return float(fcl.distance(placed, other, fcl.DistanceRequest(), fcl.DistanceResult()))


def table(rows: list[Compared]) -> str:
    """Return how many fingers of each object are explained by what, as a table."""
    counted = Counter((r.obj, r.kind) for r in rows)
    lines = ["| explained | " + " | ".join(OBJECTS) + " |", "|---|" + "---|" * len(OBJECTS)]
    for kind in (AGREES, AT_GAP, PASSED, FOLLOWS, UNEXPLAINED):
        lines.append(f"| {kind} | " + " | ".join(str(counted[name, kind]) for name in OBJECTS) + " |")
    return "\n".join(lines)


@lru_cache(maxsize=len(OBJECTS))
def _comparison(name: str) -> tuple[Comparison, dict[int, dict[str, Any]]]:
    return Comparison(load_hand(SHARED / "hands" / "DLR"), name), {case["case"]: case for case in read_cases(name)}


def compare_case(name: str, number: int) -> list[dict[str, Any]]:
    """Compare one case of an object."""
    comparison, cases = _comparison(name)
    return [asdict(row) for row in comparison.compare(cases[number])]


def spread(count: int | None) -> list[tuple[str, int]]:
    """Return the cases to compare, so many of each object, evenly spread; objects take turns."""
    numbers = {name: [case["case"] for case in read_cases(name)] for name in OBJECTS}
    wanted = max(len(n) for n in numbers.values()) if count is None else count
    chosen = [
        (k / wanted, name, n[k * len(n) // min(wanted, len(n))])
        for name, n in numbers.items()
        for k in range(min(wanted, len(n)))
    ]
    return [(name, number) for _, name, number in sorted(chosen, key=lambda row: row[0])]


def main() -> None:
    """Print the table, and what is not explained."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--cases", type=int, default=None, help="of each object; all if not given")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--file", type=Path, help="keeps what was found; a run goes on with it")
    parser.add_argument("--seconds", type=float, help="nothing new is begun after so long")
    asked = parser.parse_args()
    done = each(compare_case, spread(asked.cases), asked.processes, asked.file, asked.seconds)
    rows = [Compared(**row) for _, found in done for row in found]
    print(table(rows))
    agreed = [r.difference for r in rows if r.kind == AGREES]
    print(f"{len(rows)} fingers; where they agree: median {np.median(agreed):.2g}, largest {max(agreed):.2g} rad")
    for r in rows:
        if r.kind == UNEXPLAINED:
            print(r)


if __name__ == "__main__":
    main()
