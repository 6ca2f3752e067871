"""Where and how a finger touches on a plane, judged by distances alone: the oracle's, which know no closed form."""

import numpy as np
import pytest

from clench.kernels.closing.layout import (
    CONTACT_CURVE_X,
    CONTACT_DOF,
    CONTACT_GAP,
    CONTACT_NX,
    CONTACT_OUTLINE,
    CONTACT_SOURCE,
    CONTACT_X,
    CandidateArrays,
    no_rounds,
)
from clench.kernels.closing.solve_layout import ObjectArrays
from clench.kernels.geometry.bodies import no_body
from clench.kernels.sections.plane_sections import make_sections
from clench.kernels.toi.full_width import planes_only
from clench.kernels.trees.bvh import build_tree
from kernels.plain_closing import close_candidates
from oracle.adapter import empty_answer, pack_curve, pack_finger, solve_planar
from oracle.cases import cases
from oracle.distances import place, signed_gap
from oracle.planar import overlaps_at_start
from oracle.scene import PlanarCurve

CASES = 400


def contacts():
    """Yield the contacts of random cases that are not degenerate on purpose: case, answer, integers and numbers."""
    for case in cases(11, CASES):
        if case.name == "anywhere" and not overlaps_at_start(case.finger, case.curve):
            _, answer = solve_planar(case.finger, case.curve)
            np.testing.assert_allclose(answer.turn[0], case.finger.angles(answer.travel[0]), atol=1e-14)
            for k in range(answer.contacts[0]):
                yield case, answer, answer.contact[0, k], answer.point[0, k]


def gap(case, curve, outline, angles):
    body = case.finger.packed
    return signed_gap(body, outline, place(body, outline, angles)[1], curve.packed)


def test_a_contact_lies_on_both_and_looks_out_of_the_object():
    """The normal is the direction in which the gap grows as fast as the object is moved away.

    What is told as touching holds the joints that it stopped. A link that has left what stopped them may touch
    elsewhere since, where going on would lead away: that is no contact of theirs.
    """
    seen, corners, opened, elsewhere = 0, 0, 0, 0
    for case, answer, contact, point in contacts():
        size, o, angles = case.finger.length, contact[CONTACT_OUTLINE], answer.turn[0]
        left = gap(case, case.curve, o, angles)
        on = answer.travel[0].copy()
        on[contact[CONTACT_DOF]] += 1e-5
        beyond = gap(case, case.curve, o, case.finger.angles(on))
        if abs(left) <= case.finger.tolerance < point[CONTACT_GAP]:
            elsewhere += 1
            assert beyond >= left - 1e-9 * size
            assert contact[CONTACT_DOF] < case.finger.dofs - 1
            continue
        assert point[CONTACT_GAP] == pytest.approx(left, abs=2e-8 * size)
        assert beyond <= left + 1e-9 * size or left > case.finger.tolerance
        n, curve_normal = point[CONTACT_NX : CONTACT_NX + 2], point[CONTACT_CURVE_X : CONTACT_CURVE_X + 2]
        assert np.hypot(*n) == pytest.approx(1.0)
        assert case.finger.outlines[o].joint >= case.finger.leader(contact[CONTACT_DOF])
        if abs(left) > case.finger.tolerance:
            # A later stage took the link away; in the last one it stays.
            opened += 1
            assert contact[CONTACT_DOF] < case.finger.dofs - 1
            continue
        at = PlanarCurve(disks=np.array([[*point[CONTACT_X : CONTACT_X + 2], 0.0]]))
        assert gap(case, at, o, angles) == pytest.approx(0.0, abs=2e-8 * size)
        if contact[CONTACT_SOURCE] >= 0:
            row = pack_curve(case.curve).segments[0, contact[CONTACT_SOURCE]]
            a, b = row[:4].reshape(2, 2)
            t = np.clip((point[:2] - a) @ (b - a) / max((b - a) @ (b - a), 1e-300), 0.0, 1.0)
            assert np.hypot(*(a + t * (b - a) - point[:2])) <= 1e-12 * size
            assert abs(row[4:] @ curve_normal) == pytest.approx(1.0)
        assert n @ curve_normal >= 0.0
        away = 1e-5 * size
        grown = gap(case, case.curve.moved(-away * n), o, angles) - left
        # Where a corner is in a dent of the other body, it touches at two places at once: the gap grows along neither.
        corners += abs(grown - away) > 1e-2 * away
        seen += 1
    assert seen > 200
    assert opened > 10
    assert elsewhere > 0
    assert corners < 0.01 * seen


def behind_a_joint(hand, turn, pose):
    """Return a hand whose axis group comes after one with a single joint, which turns first and moves no outline."""
    chain, outlines = hand.chain, hand.outlines
    behind = chain._replace(
        joint_axis_group=np.concatenate([[0], chain.joint_axis_group + 1]),
        joint_dof=np.concatenate([[0], chain.joint_dof + 1]),
        pivot=np.vstack([np.zeros((1, 2)), chain.pivot]),
        rate=np.concatenate([[1.0], chain.rate]),
        start=np.concatenate([[0.0], chain.start]),
        stop=np.concatenate([[turn], chain.stop]),
        dof_length=np.concatenate([[turn], chain.dof_length]),
        speed=np.concatenate([[1.0], chain.speed]),
        breaks=np.concatenate([[0], chain.breaks]),
    )
    return hand._replace(
        first_dof=np.array([0, len(chain.dof_length) + 1]),
        first_axis_group=np.array([0, 2]),
        chain=behind,
        outlines=outlines._replace(joint=outlines.joint + 1),
        axis_group_pose=np.stack([hand.axis_group_pose[0], pose]),
        axis_group_plane=np.array([0, 1, 2]),
        plane_offset=np.zeros(2),
        axis_group_reach=np.repeat(hand.axis_group_reach, 2),
        axis_group_length=np.repeat(hand.axis_group_length, 2),
        plane_outline=np.concatenate([[0], hand.plane_outline]),
    )


def walls(curve, height):
    """Return a curve's segments as walls that look where they do, along y: vertices and triangles."""
    vertices = np.array([[x, y, z] for y in (-height, 1.3 * height) for x, z in curve.segments.reshape(-1, 2)])
    first = np.arange(0, len(vertices) // 2, 2)
    up = len(vertices) // 2
    triangles = [
        np.column_stack([first, first + 1 + up, first + 1]),
        np.column_stack([first, first + up, first + 1 + up]),
    ]
    return vertices, np.vstack(triangles).astype(np.int32)


def test_a_later_axis_group_touches_as_the_same_joints_do_in_the_first():
    """Its planes lie askew to those of the axis group before, and cut the object only once that one has turned."""
    turn, tilt = 0.7, 0.4
    pose = np.array([[1.0, 0, 0, 0.01], [0, np.cos(tilt), -np.sin(tilt), 0.02], [0, np.sin(tilt), np.cos(tilt), -0.01]])
    c, s = np.cos(turn), np.sin(turn)
    T_palm_object = np.ascontiguousarray(np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]) @ pose)
    opened = touching = 0
    for case in cases(11, 250):
        finger, curve = case.finger, case.curve
        other = not curve.loops or len(curve.disks) or curve.two_sided
        if case.name != "anywhere" or other or overlaps_at_start(finger, curve):
            continue
        hand = behind_a_joint(pack_finger(finger), turn, pose)
        shared, own = make_sections(2, 1, 0), make_sections(2, 4 * len(curve.segments), 0)
        joints = len(hand.chain.rate)
        whole = np.array([0], dtype=np.int64)
        candidates = CandidateArrays(whole, whole, whole + 1, np.full((1, joints), np.inf))
        answer, full_width = empty_answer(hand, 1, finger.dofs + 1), planes_only(1, 1)
        obj = ObjectArrays(build_tree(*walls(curve, finger.length)), no_rounds(), True, no_body())
        close_candidates(hand, full_width, obj, T_palm_object, (shared, own), candidates, answer)
        plain = solve_planar(finger, curve)[1]
        assert answer.overflow[0] == 0
        assert answer.turn[0, 0] == turn
        np.testing.assert_allclose(answer.turn[0, 1:], plain.turn[0], atol=1e-7)
        assert answer.contacts[0] == plain.contacts[0]
        for k in range(plain.contacts[0]):
            assert answer.contact[0, k, CONTACT_DOF] == plain.contact[0, k, CONTACT_DOF] + 1
            gap_there = answer.point[0, k, CONTACT_GAP]
            assert gap_there == pytest.approx(plain.point[0, k, CONTACT_GAP], abs=2e-8 * finger.length)
            opened += gap_there > finger.tolerance
            touching += gap_there <= finger.tolerance
    assert opened > 10
    assert touching > 50
