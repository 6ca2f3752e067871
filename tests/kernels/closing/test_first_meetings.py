"""What fingers meet of the hand as they begin to close is found once, and is what every sweep would find."""

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, Y, along_x
from clench.closing import kernel_run
from clench.core.pose import Pose
from clench.kernels.closing.layout import CONTACT_WHICH
from clench.kernels.runtime.by_reference import kept
from clench.kernels.toi import toi_links
from clench.kernels.toi.toi_links import Stage
from clench.models.shapes import Shape, ShapeKind
from kernels.closing.test_in_turn import facing
from kernels.kernel_entries import entry

is_known = entry(toi_links.is_known)


def fist():
    """Return a hand whose finger closes on a box of its own palm, where no object stops it."""
    box = Shape(ShapeKind.BOX, (0.01, 0.01, 0.01), Pose([0.07, 0.0, 0.06]))
    links = [along_x(0.008, 0.05), along_x(0.007, 0.04)]
    return HandBuilder(palm=box).finger("index", links, [0.05, 0.04], axes=[-Y, -Y], upper=1.5).hand()


def closed(monkeypatch, hand, obj, poses, known, order="proximal-first"):
    """Return what a batch's closings found: of every candidate turns, contacts and how many links were left alone.

    Args:
        known: use what was found once.
    """
    seen = []

    def forgetful(problem, T_palm_object, answers, stages):
        assert problem.kept is not None
        first = problem.arrays.full_width.first
        kept = first.known.copy()
        assert (kept[:, 1] > 0.0).all()
        if not known:
            first.known[:, 1] = -1.0
        run(problem, T_palm_object, answers, stages)
        first.known[:] = kept
        seen.append((answers.closed.final, kept))

    run = kernel_run.run_stages
    monkeypatch.setattr(kernel_run, "run_stages", forgetful)
    command = clench.GraspCommand(hand_pose=poses[0], preshape="open", measure=False, order=clench.ClosingOrder(order))
    clench.solve_batch(hand, obj, poses, command, threads=1)
    monkeypatch.setattr(kernel_run, "run_stages", run)
    ((final, kept),) = seen
    return final, kept


@pytest.mark.parametrize("order", ["proximal-first", "together"])
@pytest.mark.parametrize("name", ["fist", "robonaut2"])
def test_what_is_known_is_what_sweeps_find(name, order, monkeypatch):
    hand = fist() if name == "fist" else clench.Hand.load(name)
    obj = clench.GraspObject.load("sphere:r=0.012")
    far = [Pose([0.0, 0.0, -0.2])] if name == "fist" else []
    poses = [*clench.approach_poses(hand, obj, 24, 1), *far]
    one, kept = closed(monkeypatch, hand, obj, poses, True, order)
    other, _ = closed(monkeypatch, hand, obj, poses, False, order)
    assert np.abs(one.turn - other.turn).max() <= 1e-9
    assert np.array_equal(one.contacts, other.contacts)
    assert np.array_equal(one.skipped, other.skipped)
    for n, f in zip(*np.nonzero(one.contacts), strict=True):
        count = one.contacts[n, f]
        assert np.array_equal(one.contact[n, f, :count, CONTACT_WHICH], other.contact[n, f, :count, CONTACT_WHICH])
    if name == "fist":
        palm = [n for n in range(len(poses)) if one.contacts[n, 0] and one.contact[n, 0, 0, CONTACT_WHICH] == 0]
        assert len(palm) >= 1
        assert one.turn[palm[0], 0, 0] == pytest.approx(kept[0, 2], abs=1e-12)
        assert kept[0, 2] < kept[0, 1]


def test_a_finger_meets_its_own_palm_where_geometry_says(monkeypatch):
    """The ball at the tip, 0.09 m from the joint, comes up to the box's lower face: 0.09 sin(turn) + 0.007 = 0.05."""
    hand, obj = fist(), clench.GraspObject.load("sphere:r=0.012")
    final, kept = closed(monkeypatch, hand, obj, [Pose([0.0, 0.0, -0.3])], True)
    assert kept[0, 2] == pytest.approx(np.arcsin(0.043 / 0.09), abs=1e-8)
    assert final.turn[0, 0, 0] == kept[0, 2]


def test_what_is_known_does_not_hold_where_another_finger_is_in_the_way():
    """The second finger's first joint meets the first finger, which the second one would meet nothing of if alone."""
    obj = clench.GraspObject.load("sphere:r=0.004")
    command = clench.GraspCommand(hand_pose=Pose([0.0, 0.0, -0.3]), preshape="open")
    solution = clench.solve(facing(), obj, command)
    assert solution.certified
    assert 0.0 < solution.joint_angles["b_0"] < 0.3


def test_what_is_known_holds_for_its_own_segment_alone(monkeypatch):
    """Another posture, rate, gap or a longer way, or links that rest elsewhere, are swept."""
    seen = []
    run = kernel_run.run_stages
    monkeypatch.setattr(kernel_run, "run_stages", lambda problem, *rest: (seen.append(problem), run(problem, *rest)))
    command = clench.GraspCommand(hand_pose=Pose([0.0, 0.0, -0.3]), preshape="open")
    clench.solve_batch(fist(), clench.GraspObject.load("sphere:r=0.012"), [command.hand_pose], command)
    full_width, chain = seen[0].arrays.full_width, seen[0].arrays.hand.chain
    rates, touch, reach = full_width.first.rates[0].copy(), *full_width.first.known[0, :2]
    T, still = np.eye(3, 4), np.zeros_like(rates)

    def known(turns=still, rates=rates, touch=touch, best=reach, alone=True):
        links = kept(full_width._replace(alone=alone))
        return is_known(Stage(links, kept(chain), 0, T[None], T, turns, rates, float(touch)), float(best))

    assert known()
    assert known(best=0.1)
    assert not known(turns=np.array([0.0, 1e-9]))
    assert not known(rates=rates[::-1].copy())
    assert not known(touch=2.0 * touch)
    assert not known(best=1.01 * reach)
    assert not known(alone=False)
