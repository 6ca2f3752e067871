"""Users add criteria without touching ours, by a call or by an installed package; bad ones are refused."""

import sys
from typing import ClassVar

import numpy as np
import pytest
from candidate_cases import HAND, candidate

from clench.core.exceptions import CommandError, UnknownNameError
from clench.scoring import criterion_registry
from clench.scoring.criterion_registry import (
    check_numbers,
    criterion_names,
    find_criterion,
    register_criterion,
    score_candidates,
)
from clench.scoring.criterion_types import ScoringContext

CONTEXT = ScoringContext(HAND, np.array([0.1, 0.0]))


class Gentle:
    name: ClassVar[str] = "gentle"
    unit: ClassVar[str] = "rad"
    source: ClassVar[str] = "a user"
    scale: ClassVar[float] = 2.0
    larger_is_better: ClassVar[bool] = False

    def score(self, candidate, context):
        return float(candidate.travel.max())


@pytest.fixture(autouse=True)
def own_registry(monkeypatch):
    monkeypatch.setattr(criterion_registry, "_registry", dict(criterion_registry._registry))
    criterion_registry._load_installed.cache_clear()


def test_a_users_criterion_is_scored_where_it_is_asked_for():
    register_criterion(Gentle())
    assert "gentle" in criterion_names()
    c = candidate((0.3, 0.4))
    score_candidates([c], [], CONTEXT)
    assert "gentle" not in c.scores
    score_candidates([c], ["gentle"], CONTEXT)
    assert c.scores["gentle"] == 0.4
    assert c.scores["range_of_motion"] == pytest.approx(0.6)


def test_a_criterion_of_an_installed_package_needs_no_call(tmp_path, monkeypatch):
    (tmp_path / "their_criteria.py").write_text(
        "class Nimble:\n    name, unit, source, scale, larger_is_better = 'nimble', 'rad', 'they', 1.0, True\n"
        "    def score(self, candidate, setting):\n        return 1.0\n"
    )
    info = tmp_path / "theirs-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: theirs\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[clench.criteria]\nnimble = their_criteria:Nimble\n")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    assert find_criterion("nimble", "test").unit == "rad"


def test_a_package_whose_criterion_cannot_be_loaded_is_named(tmp_path, monkeypatch):
    info = tmp_path / "theirs-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: theirs\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[clench.criteria]\nnimble = no_such_module:Nimble\n")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    with pytest.raises(CommandError, match=r"'nimble'.*no_such_module"):
        find_criterion("nimble", "test")


@pytest.mark.parametrize("lacking", ["unit", "source", "scale", "score"])
def test_a_criterion_that_lacks_a_member_is_refused(lacking):
    members = {**vars(Gentle)}
    del members[lacking]
    with pytest.raises(CommandError, match=rf"criterion Odd: has no .*{lacking}"):
        register_criterion(type("Odd", (), members)())


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan"), float("inf")])
def test_a_scale_must_be_above_zero(scale):
    with pytest.raises(CommandError, match="above 0"):
        register_criterion(type("Odd", (Gentle,), {"scale": scale})())


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_value_that_is_no_number_is_refused_with_the_criterions_name(value):
    register_criterion(type("Odd", (Gentle,), {"score": lambda self, candidate, context: value})())
    with pytest.raises(CommandError, match=r"'gentle'.*finite number"):
        score_candidates([candidate()], ["gentle"], CONTEXT)


@pytest.mark.parametrize("weight", [-1.0, float("nan"), float("inf")])
def test_bad_weights_are_refused_with_their_place(weight):
    with pytest.raises(CommandError, match=r"criteria\.touching_links.*at least 0"):
        check_numbers({"touching_links": weight}, "criteria", 0.0, above=False)


def test_unknown_criteria_are_refused_with_those_that_exist():
    with pytest.raises(UnknownNameError, match=r"Did you mean 'touching_links'\? Criteria: range_of_motion"):
        check_numbers({"touching_link": 1.0}, "criteria", 0.0, above=False)


def test_a_class_is_not_a_criterion():
    with pytest.raises(CommandError, match="criterion Gentle: expected an object, got its class"):
        register_criterion(Gentle)
    assert "gentle" not in criterion_names()


@pytest.mark.parametrize(
    ("member", "value", "expected"),
    [
        ("name", 3, "name: expected text, got 3"),
        ("unit", None, "unit: expected text, got None"),
        ("scale", "2", "scale: expected a number above 0, got '2'"),
        ("scale", True, "scale: expected a number above 0, got True"),
        ("larger_is_better", "less", "larger_is_better: expected True or False, got 'less'"),
    ],
)
def test_members_of_another_kind_are_refused(member, value, expected):
    criterion = Gentle()
    setattr(criterion, member, value)
    with pytest.raises(CommandError, match=f"criterion Gentle: {expected}"):
        register_criterion(criterion)


@pytest.mark.parametrize("value", ["abc", [1, 2], np.array([3.0, 4.0]), np.inf, 1e300])
def test_values_that_are_no_numbers_to_sum_are_refused(value, monkeypatch):
    monkeypatch.setattr(Gentle, "score", lambda *_: value)
    register_criterion(Gentle())
    with pytest.raises(CommandError, match=r"criterion 'gentle': gave .*; expected "):
        score_candidates([candidate((0.3, 0.4))], ["gentle"], CONTEXT)
