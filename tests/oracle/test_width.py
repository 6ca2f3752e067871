"""The full width against another engine: random fingers and objects, blades and needles between the planes."""

from collections import Counter

import numpy as np
import pytest

import clench
from clench.core.pose import Pose
from oracle.width import Oracle, judge_places, make_case

FINGERS, PLACES = 16, 3
ORDERS = ("proximal-first", "together", "speeds")


def test_a_corner_stops_a_finger_that_would_be_past_it_a_thousandth_of_a_radian_on():
    judged = judge_places(880000014, "proximal-first", 4)[3]
    assert judged.kind == "contact"
    assert not judged.wrong, "\n".join(judged.wrong)


@pytest.mark.parametrize("off", [-1e-3, -1e-6, 0.0, 1e-6, 1e-3])
def test_the_oracle_finds_a_joint_that_stops_early_or_late(off):
    case = make_case(1)
    command = clench.GraspCommand(hand_pose=Pose.identity(), object_pose=case.place, measure=False, preshape="open")
    solution = clench.solve(case.hand, case.obj, command)
    answer = np.array([solution.joint_angles[name] for name in case.hand.joint_names])
    answer[0] += off
    judged = Oracle(case).judge(case.hand.coupled(answer), case.hand.open_angles(), reach=0.2)
    assert any(sentence.startswith("joint 0") for sentence in judged.wrong) == (off != 0.0), judged.wrong


@pytest.mark.parametrize(
    ("order", "fingers"),
    [*((order, FINGERS) for order in ORDERS), *((f"tilted {order}", FINGERS // 2) for order in ORDERS)],
)
def test_a_sample(order, fingers):
    found = [judged for seed in range(fingers) for judged in judge_places(seed, order, PLACES)]
    wrong = [sentence for judged in found for sentence in judged.wrong]
    counted = Counter(judged.kind for judged in found)
    assert not wrong, "\n".join(wrong)
    assert counted["contact"] > len(found) / 3, counted
    stages = sum(judged.stages for judged in found)
    assert sum(judged.grazing for judged in found) < 0.02 * stages
    # With speeds of their own, more stages end at joints that still move, of which the oracle says nothing.
    assert sum(judged.unresolved for judged in found) < (0.06 if "speeds" in order else 0.01) * stages
