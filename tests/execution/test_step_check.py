"""Next steps that drive links into each other are refused; MuJoCo judges the same postures."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from clench.closing.collision.packed_object import hash_bodies, hash_hand
from clench.core.pose import Pose
from clench.execution.executing import execute
from clench.execution.execution_report import ExecutionReport
from clench.execution.next_steps import Phase, plan_next_steps
from clench.execution.simulation.mujoco_scene import PREFIX, build_scene
from clench.execution.simulation.simulated_hand import SimulatedHand
from clench.execution.step_check import squeeze_overlap, step_overlap
from clench.models.hand.hand import Hand
from clench.models.shapes import CollisionSource
from clench.solver.solution import GraspSolution
from execution.simulation.test_simulated_actuators import FAR
from handmade import make_contact, make_solution

#: A thumb that is driven in is deeper than this at some way-point [m].
DEEP = 1e-3
#: A thumb that closes into the curled index finger, and a fist that it stays out of.
ACROSS = {
    "index_proximal": 1.5,
    "index_medial": 1.2,
    "middle_proximal": 1.5,
    "thumb_roll": 0.0,
    "thumb_proximal": 1.1,
    "thumb_medial": 0.8,
}
FIST = {"index_proximal": 1.2, "index_medial": 1.0, "middle_proximal": 1.2, "middle_medial": 1.0, "ring_proximal": 0.8}


@pytest.fixture(scope="module")
def hand() -> Hand:
    return Hand.load("robonaut2")


def stepping(hand: Hand, *steps: dict[str, float]) -> GraspSolution:
    angles = dict(zip(hand.joint_names, hand.open_angles().tolist(), strict=True))
    return make_solution(
        hand=hand.name,
        object="far",
        geometry_hash=f"{hash_hand(hand, CollisionSource.ENGINE)}+{hash_bodies(FAR.bodies, CollisionSource.RAW)}",
        joint_angles=angles,
        open_angles=angles,
        object_pose=FAR.pose,
        joint_limits={j.name: (j.lower, j.upper) for j in hand.joints},
        max_penetration=0.0,
        fingers={},
        contacts=(),
        next_steps=steps,
    )


def planned(hand: Hand, *steps: dict[str, float]) -> tuple[Phase, ...]:
    count = len(hand.joints)
    return plan_next_steps(
        stepping(hand, *steps), hand, hand.open_angles(), (np.full(count, 2.0), np.full(count, 10.0))
    )


def collisions(hand: Hand, phases: tuple[Phase, ...]) -> dict[frozenset[str], float]:
    """Return the pairs of links that MuJoCo finds in each other on the way, and how deep at most [m]."""
    import mujoco

    scene = build_scene(hand, FAR, Pose.identity(), hand.open_angles())
    data, found = mujoco.MjData(scene.model), dict[frozenset[str], float]()
    for q in (q for phase in phases for q in phase.positions):
        data.qpos[scene.qpos] = q
        mujoco.mj_forward(scene.model, data)
        for contact in data.contact:
            bodies = (scene.model.body(scene.model.geom_bodyid[geom]).name for geom in contact.geom)
            pair = frozenset(name.removeprefix(PREFIX) for name in bodies)
            found[pair] = max(found.get(pair, 0.0), -float(contact.dist))
    return found


def test_a_thumb_that_closes_into_a_finger_is_found(hand: Hand) -> None:
    phases = planned(hand, {}, ACROSS)
    said = step_overlap(stepping(hand), hand, phases)
    names = re.fullmatch(r"In next step 2, '(.*)' would overlap '(.*)' by at least .* mm\.", said or "")
    assert names is not None, said
    assert collisions(hand, phases)[frozenset(names.groups())] > DEEP


def test_a_fist_is_none(hand: Hand) -> None:
    phases = planned(hand, FIST)
    assert step_overlap(stepping(hand), hand, phases) is None
    assert max(collisions(hand, phases).values(), default=0.0) <= 1e-5
    assert step_overlap(stepping(hand), hand, ()) is None


def test_a_squeeze_is_checked_but_for_fingers_that_the_object_holds(hand: Hand) -> None:
    solution = stepping(hand)
    offsets = np.array([ACROSS.get(name, 0.0) for name in hand.joint_names]) - hand.open_angles()
    offsets[[name not in ACROSS for name in hand.joint_names]] = 0.0
    assert squeeze_overlap(solution, hand, np.zeros(len(offsets))) is None
    said = squeeze_overlap(solution, hand, offsets)
    assert said is not None
    assert re.match("In the squeeze, '(thumb|index)_.*' would overlap '(thumb|index)_", said)
    fingers = ("index", "middle", "thumb")
    holding = tuple(make_contact(finger=name, link=f"{name}_distal") for name in fingers)
    assert squeeze_overlap(replace(solution, contacts=holding), hand, offsets) is None


def test_it_is_refused_unless_forced(hand: Hand, monkeypatch: pytest.MonkeyPatch) -> None:
    moved: list[bool] = []

    def pretend(*_: object) -> ExecutionReport:
        moved.append(True)
        return ExecutionReport("simulated", success=True, reason="done")

    monkeypatch.setattr(SimulatedHand, "execute", pretend)
    simulated = SimulatedHand(hand, FAR)
    report = execute(stepping(hand, ACROSS), simulated)
    assert not report.success
    assert re.match(r"Not carried out: In next step 1, '(thumb|index)_distal' would overlap", report.reason)
    assert not moved
    execute(stepping(hand, ACROSS), simulated, force=True)
    execute(stepping(hand, ACROSS), simulated, next_steps=False)
    assert moved == [True, True]
