"""Joint maps: units, directions, offsets, and one sentence for what is wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from clench.core.exceptions import CommandError, FileError, UnknownNameError
from clench.execution.hardware.joint_map import JointMap, MappedJoint, joint_map_from_dict
from clench.models.hand.hand import Hand

TEXT = """
unit = "deg"

[joints.thumb]
name = "T1"
direction = -1
offset = 90
lower = 10.0
upper = 95
velocity = 120.0

[joints.index]
unit = "rad"

[joints.index_tip]
name = "motor 3"
scale = 651.8986469
offset = 2048
"""


def test_a_file(tmp_path: Path, pincer: Hand) -> None:
    (tmp_path / "j.toml").write_text(TEXT)
    joints = JointMap.load(tmp_path / "j.toml").of(pincer)
    assert list(joints) == ["thumb", "index", "index_tip"]
    thumb = joints["thumb"]
    assert (thumb.name, thumb.lower, thumb.upper, thumb.velocity, thumb.unit) == ("T1", 10.0, 95.0, 120.0, "deg")
    assert thumb.to_controller(np.pi / 6) == pytest.approx(60.0)
    assert joints["index"] == MappedJoint("index")
    assert joints["index_tip"].to_controller(np.pi) == pytest.approx(4096)  # 4096 ticks a turn, 0 rad in the middle
    assert joints["index_tip"].unit == "units"


def test_without_a_map_followers_are_left_to_the_mechanism(pincer: Hand) -> None:
    assert JointMap().of(pincer) == {"thumb": MappedJoint("thumb"), "index": MappedJoint("index")}
    assert list(joint_map_from_dict({"joints": {"index": {}, "thumb": {}}}).of(pincer)) == ["thumb", "index"]


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.floats(-4, 4), st.floats(0.1, 1000), st.sampled_from([1, -1]), st.floats(-500, 500))
def test_there_and_back(angle: float, scale: float, direction: int, offset: float) -> None:
    joint = joint_map_from_dict({"joints": {"a": {"scale": scale, "direction": direction, "offset": offset}}}).joints
    assert joint is not None
    assert joint["a"].to_angle(joint["a"].to_controller(angle)) == pytest.approx(angle, abs=1e-9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ('units = "deg"', "units: unknown key; expected 'unit' or 'joints'"),
        ('unit = "degrees"', "unit: expected one of rad, deg, turn, got 'degrees'"),
        ("", r"joints: expected a table \[joints.NAME\] for every joint"),
        ("joints = 3", "joints: expected a table"),
        ("[joints]\na = 3", "joints.a: expected a table, got 3"),
        ("[joints.a]\nofset = 3", "joints.a.ofset: unknown key; expected one of name, unit"),
        ("[joints.a]\noffset = nan", "joints.a.offset: expected a finite number, got nan"),
        ("[joints.a]\noffset = true", "joints.a.offset: expected a finite number, got True"),
        ("[joints.a]\nscale = 0", "joints.a.scale: expected units per radian other than 0"),
        ('[joints.a]\nscale = 2\nunit = "deg"', "joints.a: 'unit' and 'scale' say the same"),
        ("[joints.a]\ndirection = 2", "joints.a.direction: expected 1 or -1, got 2"),
        ("[joints.a]\nname = 3", "joints.a.name: expected the controller's name, got 3"),
        ("[joints.a]\nlower = 2\nupper = 1", r"joints.a.lower: expected less than upper \(1\), got 2"),
        ("[joints.a]\nvelocity = 0", "joints.a.velocity: expected more than 0, got 0"),
        ('[joints.a]\nname = "b"\n[joints.b]', "joints: two joints have the controller's name 'b'"),
        ("[joints.a", "not TOML"),
    ],
)
def test_malformed_files(tmp_path: Path, change: str, message: str) -> None:
    (tmp_path / "j.toml").write_text(change)
    with pytest.raises(FileError, match=r"j\.toml: " + message):
        JointMap.load(tmp_path / "j.toml")


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="no such file"):
        JointMap.load(tmp_path / "j.toml")


def test_maps_that_do_not_fit_the_hand(pincer: Hand) -> None:
    with pytest.raises(UnknownNameError, match=r"'thum' is not in hand 'pincer' \(j.toml\). Did you mean 'thumb'"):
        joint_map_from_dict({"joints": {"thum": {}, "index": {}}}, "j.toml").of(pincer)
    with pytest.raises(CommandError, match=r"j.toml: joints.thumb: missing; every joint of 'pincer' is needed"):
        joint_map_from_dict({"joints": {"index": {}}}, "j.toml").of(pincer)
