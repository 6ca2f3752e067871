"""Couplings that a maker publishes and a file leaves out are told, with lines of a hand file that add just these."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from clench.apps.cli.main import main
from clench.models.hand.findings import Finding
from clench.models.hand.hand import Hand
from models.hand.hand_models import finger, hand, written


def renamed(text: str, names: list[str]) -> str:
    """Return a finger `f` whose joints have other names."""
    for k, name in enumerate(names):
        text = text.replace(f'"f_j{k}"', f'"{name}"')
    return text


def missing(read: Hand) -> list[Finding]:
    return [found for found in read.findings if found.code == "coupling_missing"]


def added(model: Path, found: Finding) -> Hand:
    """Return the hand with the lines that a finding advises, and nothing else, in its hand file."""
    lines = found.advice.split("\n", 1)[1]
    assert tomllib.loads(lines)["joints"].keys() == set(found.joints)
    file = model.with_suffix(".toml")
    file.write_text(lines)
    return Hand.load(model, hand_file=file)


CASES = {
    "barrett": (["finger_1_med_joint", "finger_1_dist_joint"], 1 / 3, 0.0, True),
    "ability": (["index_q1", "index_q2"], 1.05851325, 0.72349796, False),
    "shadow": (["rh_FFJ2", "rh_FFJ1"], 1.0, 0.0, True),
    "svh": (["right_hand_Index_Finger_Distal", "right_hand_j14"], 1.045, 0.0, False),
}


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("names", "ratio", "offset", "breakaway"), CASES.values(), ids=CASES)
def test_the_advised_lines_add_the_coupling(
    tmp_path: Path, names: list[str], ratio: float, offset: float, breakaway: bool, turned: bool
) -> None:
    """An axis turned round in the file turns the ratio's and the offset's sign: both joints close together."""
    axes, limits = (["1 0 0", "-1 0 0"], ["0 1.6", "-2.6 0"]) if turned else (["1 0 0"] * 2, ["0 1.6", "0 2.6"])
    one = renamed(finger("f", axes=axes, limits=limits), names)
    model = written(tmp_path, hand(one, finger("b", (0.03, 0, 0.05))))
    read = Hand.load(model)
    assert read.couplings == ()
    (found,) = missing(read)
    assert found.joints == (names[1],)
    assert found.text in read.warnings
    tied = added(model, found)
    assert missing(tied) == []
    (coupling,) = tied.couplings
    sign = -1.0 if turned else 1.0
    assert (tied.joint_names[coupling.leader], tied.joint_names[coupling.follower]) == tuple(names)
    np.testing.assert_allclose([coupling.ratio, coupling.offset], [sign * ratio, sign * offset], rtol=1e-11)
    assert coupling.breakaway == breakaway


def test_the_printed_lines_are_lines_of_a_hand_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = renamed(finger("f", limits=["0 1.6", "0 2.6"]), CASES["barrett"][0])
    model = written(tmp_path, hand(one, finger("b", (0.03, 0, 0.05))))
    assert main(["hand", str(model)]) == 0
    printed = capsys.readouterr().out
    assert "\\n" not in printed
    begin = printed.index("    -> If it is this hand, write in the hand file:\n")
    lines = printed[begin:].splitlines()[1:5]
    (found,) = missing(Hand.load(model))
    assert tomllib.loads("\n".join(lines)) == tomllib.loads(found.advice.split("\n", 1)[1])
    model.with_suffix(".toml").write_text("\n".join(lines))
    assert missing(Hand.load(model, hand_file=model.with_suffix(".toml"))) == []


def test_a_line_break_in_a_name_begins_no_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = renamed(finger("f"), ["a&#10;[links]&#10;", "b"]).replace(' range="0 1.6"', "", 1)
    assert main(["hand", str(written(tmp_path, hand(one, finger("g", (0.03, 0, 0.05)))))]) == 0
    printed = capsys.readouterr().out
    assert '[joints."a\\n[links]\\n"]' in printed
    assert not [line for line in printed.splitlines() if line.strip().startswith("[links]")]


@pytest.mark.parametrize(
    "names",
    [["FFJ2", "FFJ1", "FFJ0"], ["a_j0", "a_j1"], ["OFFJ2", "OFFJ1"], ["finger_1_med_joint", "finger_2_dist_joint"]],
)
def test_other_joints_are_left_alone(tmp_path: Path, names: list[str]) -> None:
    one = renamed(finger("f", lengths=[0.03] * len(names)), names)
    assert missing(Hand.load(written(tmp_path, hand(one, finger("b", (0.03, 0, 0.05)))))) == []


def test_what_the_file_couples_is_not_missing(tmp_path: Path) -> None:
    coupled = '<equality><joint joint1="rh_FFJ1" joint2="rh_FFJ2" polycoef="0 0.8 0 0 0"/></equality>'
    one = renamed(finger("f"), ["rh_FFJ2", "rh_FFJ1"])
    assert missing(Hand.load(written(tmp_path, hand(one, finger("b", (0.03, 0, 0.05)), extra=coupled)))) == []


@pytest.mark.shared
def test_the_barrett_hand_of_a_file_that_leaves_them_out(shared_data: Path) -> None:
    read = Hand.load(shared_data / "hands/barrett_hand_urdf/bhand_model.urdf")
    (found,) = missing(read)
    assert found.joints == tuple(f"finger_{k}_dist_joint" for k in (1, 2, 3))
    assert "support.barrett.com" in found.text
    assert read.couplings == ()
