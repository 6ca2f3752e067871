"""Whole postures: what is kept, what is left to be solved, what is refused."""

import numpy as np
import pytest

from clench.core.exceptions import CommandError, UnknownNameError
from clench.core.pose import Pose
from clench.models.command import GraspCommand
from clench.models.command_file import check_command
from models.small_hand import small_hand

POSE = Pose([0.1, 0.2, 0.3], [0, 1, 0, 0])


def test_posture_and_upstream_joints_are_kept_and_closing_ones_are_not():
    hand = small_hand()
    command = GraspCommand.from_posture(hand, np.array([0.5, -0.2, 1.0, 0.8]), POSE)
    assert command.preshape == {"wrist": 0.5, "index_yaw": -0.2}
    assert command.hand_pose == POSE
    check_command(hand, command)


def test_by_name_is_the_same_and_followers_may_be_left_out():
    hand = small_hand()
    by_name = {"index_proximal": 1.0, "index_yaw": -0.2, "wrist": 0.5}
    expected = GraspCommand.from_posture(hand, np.array([0.5, -0.2, 1.0, 0.8]), POSE)
    assert GraspCommand.from_posture(hand, by_name, POSE) == expected
    assert GraspCommand.from_posture(hand, {**by_name, "index_distal": 3.0}, POSE) == expected


@pytest.mark.parametrize(
    ("q", "error", "words"),
    [
        (
            [0.0, 0.0, 0.0],
            CommandError,
            "posture: expected 4 angles in rad in the order of hand 'small', got shape (3,)",
        ),
        ([[0.0, 0.0, 0.0, 0.0]], CommandError, "posture: expected 4 angles"),
        (
            [0.0, 0.4, 0.0, 0.0],
            CommandError,
            "posture.index_yaw: 0.4 rad is outside the joint's limits [-0.3, 0.3] rad",
        ),
        ([0.0, 0.0, 45.0, 0.0], CommandError, "posture.index_proximal: 45 rad is outside"),
        ([0.0, np.nan, 0.0, 0.0], CommandError, "posture.index_yaw: expected a finite number in rad, got nan"),
        (["a", 0.0, 0.0, 0.0], CommandError, "posture.wrist: expected a number in rad, got 'a'"),
        ({"wrist": 0.0, "index_yaw": 0.0}, CommandError, "posture.index_proximal: missing"),
        ({"wrst": 0.0}, UnknownNameError, "Joint 'wrst' is not in hand 'small'. Did you mean 'wrist'?"),
    ],
)
def test_malformed_postures(q, error, words):
    with pytest.raises(error) as caught:
        GraspCommand.from_posture(small_hand(), q if isinstance(q, dict) else np.array(q), POSE)
    assert str(caught.value).startswith(words), str(caught.value)


def test_built_in_hand():
    from clench.models.hand.hand import Hand

    hand = Hand.load("robonaut2")
    command = GraspCommand.from_posture(hand, hand.open_angles(), POSE)
    assert set(command.preshape) == {"thumb_roll", "thumb_proximal", "index_yaw", "middle_yaw"}
