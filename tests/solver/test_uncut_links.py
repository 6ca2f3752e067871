"""A solve cuts links by curl planes only where it sweeps planes, or where somebody reads them."""

import pytest

import clench
from clench.apps.cli.commands.demo import MUG_POSE
from clench.closing import curl_planes


@pytest.fixture
def cuts(monkeypatch):
    """The shapes that are cut, one entry per cut."""
    done = []

    def cut(shape, *where):
        done.append(shape)
        return original(shape, *where)

    original = curl_planes.cut_shape
    monkeypatch.setattr(curl_planes, "cut_shape", cut)
    return done


def test_a_full_width_solve_cuts_no_link(cuts):
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    solution = clench.solve(hand, mug, clench.GraspCommand(hand_pose=MUG_POSE))
    assert solution.status == "grasp"
    assert solution.contacts
    assert not cuts


@pytest.mark.parametrize("options", [{"full_width": False}, {"planes": 3, "check_candidates": True}])
def test_a_solve_on_planes_cuts_the_links(cuts, options):
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    clench.solve(hand, mug, clench.GraspCommand(hand_pose=MUG_POSE, preshape="open", **options))
    assert cuts


def test_the_reason_for_the_posture_is_known_before_those_for_the_candidates(cuts):
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    choice = clench.solve(hand, mug, clench.GraspCommand(hand_pose=MUG_POSE)).choice
    assert choice["preshapes"]["chosen"] in choice["preshapes"]["compared"]
    assert not cuts
    assert choice["fingers"]
    assert cuts
    assert list(choice)[-1] == "preshapes"
