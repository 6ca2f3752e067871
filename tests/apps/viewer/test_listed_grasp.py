"""Filters of the list of grasps."""

from __future__ import annotations

from typing import Any

from clench import GraspCommand, Pose
from clench.apps.viewer.grasps.listed_grasp import ANY, GraspFilter, ListedGrasp, words_of


def grasp(name: str, **known: Any) -> ListedGrasp:
    return ListedGrasp(name, "hand", "object", Pose.identity(), lambda: GraspCommand(Pose.identity()), **known)


GRASPS = [
    grasp("a", status="grasp", kind="power", score=0.1, held=True),
    grasp("b", status="grasp", kind="pinch", score=0.3, held=False),
    grasp("c", status="partial", kind="power", score=None),
    grasp("d", rejected="obstacle"),
    grasp("e", rejected="no opposition", status="grasp", score=0.0),
]


def names(wanted: GraspFilter) -> str:
    return "".join(GRASPS[k].name for k in wanted.chosen(GRASPS))


def test_grasps_come_by_score_and_those_without_one_last() -> None:
    assert names(GraspFilter()) == "bac"


def test_every_filter_leaves_out_the_others() -> None:
    assert names(GraspFilter(status="partial")) == "c"
    assert names(GraspFilter(kind="power")) == "ac"
    assert names(GraspFilter(held="held")) == "a"
    assert names(GraspFilter(held="dropped")) == "b"
    assert names(GraspFilter(held="not tested")) == "c"
    assert names(GraspFilter(score=(0.2, 1.0))) == "bc"
    assert names(GraspFilter(kind="power", held="held", score=(0.2, 1.0))) == ""


def test_rejected_proposals_are_shown_alone_or_besides() -> None:
    assert names(GraspFilter(shown="rejected")) == "ed"
    assert names(GraspFilter(shown="all")) == "baecd"
    assert names(GraspFilter(shown="rejected", reason="obstacle")) == "d"
    assert names(GraspFilter(shown="all", reason="obstacle")) == "bacd"


def test_a_line_says_what_is_known() -> None:
    assert GRASPS[0].text == "a · grasp · power · held · score 0.100"
    assert GRASPS[3].text == "d · rejected: obstacle"


def test_words_of_a_filter_are_those_that_exist() -> None:
    assert words_of(g.kind for g in GRASPS) == (ANY, "pinch", "power")
