"""Tendons as read: built-in, from the hand file, from MJCF; malformed ones."""

from __future__ import annotations

import numpy as np
import pytest

import clench
from clench.core.exceptions import FileError, HandError, UnknownNameError
from clench.models.hand.reading.tendons import TendonMap

PULLEY = """
<mujoco><worldbody><body name="palm"><geom size="0.01"/>
  <body name="a"><joint name="a" axis="0 -1 0" range="0 90"/><geom type="capsule" fromto="0 0 0 .04 0 0" size=".008"/>
  <body name="b" pos=".04 0 0"><joint name="b" axis="0 -1 0" range="0 90"/>
    <geom type="capsule" fromto="0 0 0 .03 0 0" size=".008"/></body></body></body></worldbody>
  <tendon><fixed name="flexor"><joint joint="a" coef="0.01"/><joint joint="b" coef="0.008"/></fixed>
    <fixed name="loop"><joint joint="b" coef="0.005"/></fixed></tendon>
  <actuator><motor name="pull" tendon="flexor" ctrlrange="0 50" ctrllimited="true"/>
    <motor name="turn" tendon="loop" forcerange="-20 30" forcelimited="true"/>
    <motor name="direct" joint="a"/><motor name="direct2" joint="b"/></actuator>
</mujoco>
"""


def test_robonaut_has_n_plus_1_tendons_that_stay_taut_without_torque() -> None:
    hand = clench.Hand.load("robonaut2")
    assert hand.tendons is not None
    assert hand.tendons.count == 5 + 4 + 4 + 2 + 2
    arms = hand.tendons.arms_of(hand.joint_names)
    assert np.abs(arms.sum(axis=1)).max() < 1e-15
    fingers = {"thumb": 5, "index": 4, "middle": 4, "ring": 2, "little": 2}
    for finger, count in fingers.items():
        own = [k for k, name in enumerate(hand.joint_names) if name.startswith(finger)]
        columns = np.flatnonzero(np.abs(arms[own]).max(axis=0))
        assert len(columns) == count
        others = [k for k in range(len(hand.joints)) if k not in own]
        assert not arms[np.ix_(others, columns)].any()


def test_tendons_of_a_model(tmp_path) -> None:
    path = tmp_path / "pulley.xml"
    path.write_text(PULLEY)
    tendons = clench.Hand.load(path).tendons
    assert tendons is not None
    assert tendons.joints == ("a", "b")
    # A motor that only pulls is one tendon; one that turns both ways is two.
    assert np.allclose(tendons.moment_arms, [[0.01, 0.0, 0.0], [0.008, -0.005, 0.005]])
    assert tendons.t_max == (50.0, 20.0, 30.0)


@pytest.mark.shared
def test_shadow_hand_has_two_tendons_for_each_coupled_pair(shared_data) -> None:
    tendons = clench.Hand.load(shared_data / "hands" / "shadow_hand_mjcf" / "right_hand.xml").tendons
    assert tendons is not None
    assert tendons.joints == tuple(f"rh_{f}J{k}" for f in ("FF", "MF", "RF", "LF") for k in (2, 1))
    assert tendons.count == 8


def tendon_file(tmp_path, text: str):
    path = tmp_path / "tendons.toml"
    path.write_text("[tendons]\n" + text)
    return path


def test_malformed_tendons_are_refused_in_one_sentence(tmp_path) -> None:
    cases = [
        ('joints = ["index_distal"]\nmoment_arms = [[0.01], [0.02]]', r"tendons.moment_arms: expected 1 rows"),
        ('joints = ["index_distal"]\nmoment_arms = [[]]', r"tendons.moment_arms: expected 1 rows"),
        ('joints = ["index_distal", "index_medial"]\nmoment_arms = [[0.01, 0.0], [0.02]]', r"equally many numbers"),
        ('joints = ["index_distal"]\nmoment_arms = [[nan]]', r"equally many numbers"),
        ('joints = ["index_distal"]\nmoment_arms = [[0.01]]\nt_min = -1.0', r"expected 0 <= t_min < t_max, got -1 N"),
        ('joints = ["index_distal"]\nmoment_arms = [[0.01]]\nt_min = 5\nt_max = 5', r"expected 0 <= t_min < t_max"),
        (
            'joints = ["index_distal"]\nmoment_arms = [[0.01, 0.0]]\nt_max = [5.0]',
            r"t_max: expected a finite number",
        ),
    ]
    for text, sentence in cases:
        with pytest.raises(FileError, match=sentence):
            clench.Hand.load("patent15", hand_file=tendon_file(tmp_path, text))
    with pytest.raises(UnknownNameError, match=r"Joint 'indx' is not in the model \(tendons.joints in"):
        clench.Hand.load("patent15", hand_file=tendon_file(tmp_path, 'joints = ["indx"]\nmoment_arms = [[0.01]]'))
    with pytest.raises(HandError, match=r"tendons.t_min: expected 2 numbers, one a tendon, got 1"):
        TendonMap(("a",), ((0.01, -0.01),), (0.0,), (1.0, 1.0))


def test_tensions_per_tendon(tmp_path) -> None:
    text = 'joints = ["index_distal"]\nmoment_arms = [[0.01, -0.01]]\nt_min = [1.0, 2.0]\nt_max = [10, 20]'
    tendons = clench.Hand.load("patent15", hand_file=tendon_file(tmp_path, text)).tendons
    assert tendons is not None
    assert (tendons.t_min, tendons.t_max) == ((1.0, 2.0), (10.0, 20.0))


def test_friction_0_in_a_hand_file_is_refused(tmp_path) -> None:
    path = tmp_path / "f.toml"
    for value in ("0.0", "-0.5", "nan"):
        path.write_text(f"[links.index_distal]\nfriction = {value}\n")
        with pytest.raises(FileError, match=r"links.index_distal.friction: expected"):
            clench.Hand.load("patent15", hand_file=path)
