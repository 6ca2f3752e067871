"""Every finger that does not touch says why, in a code, with numbers that an independent computation gives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, along_x, mount, three_links, turned
from clench.core.pose import Pose
from clench.models.hand.hand import Hand, JointRole

RADIUS, LENGTHS = 0.007, (0.05, 0.035, 0.025)
Y, Z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])


def ball(position, radius: float = 0.01) -> clench.GraspObject:
    return clench.GraspObject.load(f"sphere:r={radius}", pose=Pose(position))


def solved(hand: Hand, obj: clench.GraspObject, **changes: Any) -> clench.GraspSolution:
    return clench.solve(
        hand, obj, clench.GraspCommand(hand_pose=Pose.identity(), planes=3, **{"preshape": "open", **changes})
    )


def cause(solution: clench.GraspSolution, finger: str = "index") -> dict[str, Any]:
    found = solution.fingers[finger].cause
    assert found is not None
    assert solution.reason["fingers"][finger] == found["code"]
    assert found["text"].endswith(".")
    return dict(found)


def gap_to_ball(hand: Hand, solution: clench.GraspSolution, center, radius: float) -> float:
    """Return the smallest gap between the capsules of a chain and a ball, from link poses alone."""
    q = np.array([solution.joint_angles[j.name] for j in hand.joints])
    gaps = []
    for link, T in zip(hand.links, hand.link_poses(q), strict=True):
        for shape in link.shapes.get(hand.default_source, ()):
            a, b = (T[:3, :3] @ shape.pose.apply(np.array([0, 0, s * shape.size[1]])) + T[:3, 3] for s in (-1, 1))
            t = np.clip((center - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
            gaps.append(np.linalg.norm(a + t * (b - a) - center) - shape.size[0] - radius)
    return float(min(gaps))


def test_a_finger_that_touches_has_no_cause():
    solution = solved(three_links(), ball([0.06, 0, 0.03]))
    assert solution.fingers["index"].status == "touch"
    assert solution.fingers["index"].cause is None


def test_out_of_reach_ahead():
    hand = three_links(upper=1.2)
    solution = solved(hand, ball([1.0, 0, 0]))
    found = cause(solution)
    assert (found["code"], found["direction"]) == ("reach", "ahead")
    assert found["reach"] == pytest.approx(sum(LENGTHS) + RADIUS, abs=5e-5)
    assert found["shortfall"] == pytest.approx(1.0 - 0.01 - sum(LENGTHS) - RADIUS, abs=5e-5)
    assert found["distance"] == pytest.approx(gap_to_ball(hand, solution, np.array([1.0, 0, 0]), 0.01), abs=1e-12)
    assert solution.reason["nearest"]["distance"] == found["distance"]
    assert solution.reason["nearest"]["link"] == found["nearest_link"]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_out_of_reach_to_either_side(side):
    found = cause(solved(three_links(upper=1.2), ball([0.05, side * 0.05, 0.02])))
    assert (found["code"], found["direction"]) == ("reach", "aside")
    assert found["shortfall"] == pytest.approx(0.05 - 0.01 - RADIUS, abs=5e-5)


@pytest.mark.parametrize("upper", [0.2, 0.5, 0.8])
def test_limit_names_the_joint_and_the_distance(upper):
    hand, center = three_links(upper=upper), np.array([-0.02, 0.0, 0.08])
    solution = solved(hand, ball(center))
    found = cause(solution)
    assert found["code"] == "limit"
    assert found["angle"] == upper
    assert found["distance"] == pytest.approx(gap_to_ball(hand, solution, center, 0.01), abs=1e-12)
    last = {f"index_link_{k}": f"index_{k}" for k in range(3)}
    assert found["joint"] == last[found["nearest_link"]]


@pytest.mark.parametrize(("range_left", "code"), [(2.0, "coupling"), (0.01, "limit")])
def test_coupling_is_named_where_it_could_have_helped(range_left, code):
    """The second joint turns half as far as the first, which is at its limit; what is left of its own range counts."""
    from dataclasses import replace

    builder = HandBuilder().finger("index", [along_x(RADIUS, 0.05)] * 2, [0.05, 0.05], upper=0.6)
    hand = builder.couple("index_0", "index_1", 0.5).hand()
    hand = replace(hand, joints=(hand.joints[0], replace(hand.joints[1], upper=0.3 + range_left)))
    found = cause(solved(hand, ball([0.03, 0, 0.07])))
    assert found["code"] == code
    assert (found["joint"], found["angle"]) == ("index_0", 0.6)
    if code == "coupling":
        assert found["follower"] == "index_1"
        assert found["range_left"] == pytest.approx(range_left, abs=1e-12)


def test_self_collision_names_both_links():
    found = cause(solved(three_links(), ball([0.03, 0.0, -0.06])))
    assert found["code"] == "self_collision"
    assert (found["other"], found["other_finger"]) == ("index_link_0", "index")
    assert found["link"] == "index_link_2"
    assert found["joint"] in ("index_1", "index_2")


def test_the_palm_in_the_way_is_a_self_collision():
    from clench.models.shapes import Shape, ShapeKind

    palm = Shape(ShapeKind.BOX, (0.01, 0.02, 0.01), Pose([0.02, 0, 0.05]))
    hand = HandBuilder(palm).finger("index", [None, along_x(RADIUS, 0.08)], [0.02, 0.08]).hand()
    found = cause(solved(hand, ball([-0.04, 0, 0.06])))
    assert (found["code"], found["other"], found["other_finger"]) == ("self_collision", "palm", None)


def test_another_finger_in_the_way_shadows():
    builder = HandBuilder().finger("index", [along_x(RADIUS, 0.1)], [0.1])
    across = mount((0.05, -0.03, 0.05), turned(Z, np.pi / 2))
    hand = builder.finger("other", [along_x(RADIUS, 0.06)], [0.06], base=across, upper=0.0).hand()
    solution = solved(hand, ball([0.0, 0, 0.09]))
    found = cause(solution)
    assert found["code"] == "shadowed"
    assert (found["link"], found["other"], found["other_finger"]) == ("index_link_0", "other_link_0", "other")
    # Two capsules across each other touch at two radii: sin(angle) of the line to the other's axis.
    assert found["angle"] == pytest.approx(np.pi / 4 - np.arcsin(2 * RADIUS / np.hypot(0.05, 0.05)), abs=1e-6)
    assert cause(solution, "other")["code"] == "no_motion"
    assert cause(solution, "other")["joints"] == {"other_0": 0.0}


def test_a_link_that_touches_before_the_tip_shadows_it():
    center = np.array([0.03, 0.0, 0.02])
    hand = three_links(upper=1.5)
    solution = solved(hand, ball(center), order=clench.ClosingOrder.FINGERTIP)
    found = cause(solution)
    assert solution.fingers["index"].status == "missed"
    assert (found["code"], found["link"], found["other"]) == ("shadowed", "index_link_0", "sphere:r=0.01")
    assert found["nearest_link"] == "index_link_2"
    q = np.array([solution.joint_angles[j.name] for j in hand.joints])
    T = hand.link_poses(q)[3]
    a, b = T[:3, 3], T[:3, 3] + 0.025 * T[:3, 0]
    t = np.clip((center - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    assert found["distance"] == pytest.approx(np.linalg.norm(a + t * (b - a) - center) - RADIUS - 0.01, abs=1e-12)


def test_what_is_out_of_reach_stays_so_whatever_the_finger_meets():
    found = cause(solved(three_links(), ball([1.0, 0, 0])))
    assert (found["code"], found["other"]) == ("reach", "index_link_0")


def test_blocked_at_the_start():
    found = solved(three_links(), ball([0.03, 0.0, 0.012])).fingers["index"].cause
    assert found is not None
    assert (found["code"], found["link"]) == ("blocked_at_start", "index_link_0")
    assert found["depth"] == pytest.approx(RADIUS + 0.01 - 0.012, abs=4e-5)
    assert np.linalg.norm(np.array(found["place"]) - [0.03, 0.0, 0.012]) == pytest.approx(0.012 - RADIUS, abs=1e-3)


def test_a_finger_without_closing_joints():
    builder = HandBuilder().finger("index", [along_x(RADIUS, 0.05)], [0.05])
    hand = builder.finger("stick", [along_x(RADIUS, 0.05)], [0.05], base=mount((0, 0.05, 0)), roles=[JointRole.POSTURE])
    found = cause(solved(hand.hand(), ball([0.03, 0, 0.03])), "stick")
    assert found == {"code": "no_closing_joint", "text": "stick has no closing joint."}


def test_an_obstacle_in_the_way_and_the_distance_to_the_object_behind_it():
    from dataclasses import replace

    obj, center = ball([0.0, 0.0, 0.09]), np.array([0.0, 0.0, 0.09])
    wall = clench.GraspObject.load("sphere:r=0.01").bodies[0].moved(obj.pose.inverse() @ Pose([0.05, 0, 0.05]))
    hand = three_links(upper=1.2)
    solution = solved(hand, obj.with_body(replace(wall, role=clench.BodyRole.OBSTACLE, name="table")))
    found = cause(solution)
    assert (found["code"], found["other"], found["other_finger"]) == ("obstacle", "table", None)
    assert found["distance"] == pytest.approx(gap_to_ball(hand, solution, center, 0.01), abs=1e-12)


def test_causes_survive_saving(tmp_path):
    solution = solved(three_links(upper=0.2), ball([-0.02, 0.0, 0.08]))
    solution.save(tmp_path / "s.json")
    loaded = clench.GraspSolution.load(tmp_path / "s.json")
    assert loaded.fingers["index"].cause == solution.fingers["index"].cause
    assert loaded.reason == solution.reason


def test_a_finger_that_closes_in_two_directions_has_nothing_to_its_side():
    """Its last joint turns sideways, towards what the planes of the first would not reach."""
    shapes = [along_x(RADIUS, 0.05), along_x(RADIUS, 0.05)]
    hand = HandBuilder().finger("index", shapes, [0.05, 0.05], axes=[-Y, Z], upper=0.3).hand()
    assert cause(solved(hand, ball([0.06, 0.05, 0.0])))["code"] == "limit"
