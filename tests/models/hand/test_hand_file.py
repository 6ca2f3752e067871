"""The hand file overrides what was found, and is validated with the key in every message."""

from __future__ import annotations

import numpy as np
import pytest

from clench.core.exceptions import ClenchError, FileError, HandError, UnknownNameError
from clench.models.hand.hand import Hand
from clench.models.hand.hand_file import read_hand_file
from clench.models.shapes import CollisionSource
from models.hand.hand_models import three_fingers, written


def load(tmp_path, toml: str) -> Hand:
    return Hand.load(written(tmp_path, three_fingers()), hand_file=written(tmp_path, toml, "over.toml"))


def test_everything_can_be_overridden(tmp_path) -> None:
    loaded = load(
        tmp_path,
        """
        palm = "palm"
        collision_source = "raw"
        allowed_pairs = [["index_link1", "thumb_link1"]]
        [fingers.pointer]
        joints = ["index_j0", "index_j1"]
        tip = "index_link0"
        [fingers.middle]
        thumb = true
        [joints.middle_j0]
        role = "posture"
        [joints.index_j0]
        direction = -1
        open = 0.5
        effort = 0.7
        [joints.thumb_j1]
        follows = "thumb_j0"
        ratio = 0.5
        offset = 0.1
        breakaway = true
        [links.palm]
        pad_indentation = 0.001
        friction = 0.8
        """,
    )
    pointer, middle = loaded.finger("pointer"), loaded.finger("middle")
    assert loaded.links[pointer.tip_link].name == "index_link0"
    assert middle.is_thumb
    assert loaded.default_source is CollisionSource.RAW
    joints = {j.name: j for j in loaded.joints}
    assert (joints["middle_j0"].role, joints["middle_j0"].role_reason) == ("posture", "hand file")
    assert (joints["index_j0"].direction, joints["index_j0"].open_value) == (-1, 0.5)
    assert joints["index_j0"].open_reason == joints["index_j0"].direction_reason == "hand file"
    assert (joints["index_j0"].effort, joints["index_j1"].effort) == (0.7, None)
    mirrored = loaded.mirrored()
    assert mirrored.joints[mirrored.joint_index("index_j0")].effort == 0.7
    (coupling,) = loaded.couplings
    assert (coupling.ratio, coupling.offset, coupling.breakaway, coupling.reason) == (0.5, 0.1, True, "hand file")
    palm = loaded.links[loaded.palm]
    assert (palm.pad_indentation, palm.friction) == (0.001, 0.8)
    pair = tuple(sorted((loaded.link_index("index_link1"), loaded.link_index("thumb_link1"))))
    assert pair in loaded.allowed_pairs


def test_the_file_beside_the_model_is_found(tmp_path) -> None:
    written(tmp_path, "[joints.index_j0]\nopen = 0.25\n", "hand.hand.toml")
    loaded = Hand.load(written(tmp_path, three_fingers()))
    assert loaded.joints[loaded.joint_index("index_j0")].open_value == 0.25


def test_a_coupling_can_be_taken_off(tmp_path) -> None:
    tied = '<equality><joint joint1="index_j1" joint2="index_j0" polycoef="0 1 0 0 0"/></equality>'
    over = written(tmp_path, '[joints.index_j1]\nfollows = ""\n', "over.toml")
    assert Hand.load(written(tmp_path, three_fingers(tied)), hand_file=over).couplings == ()
    assert len(Hand.load(written(tmp_path, three_fingers(tied))).couplings) == 1


def test_the_open_value_of_a_leader_moves_its_follower(tmp_path) -> None:
    toml = '[joints.index_j0]\nopen = 0.4\n[joints.index_j1]\nfollows = "index_j0"\nratio = 0.5\n'
    loaded = load(tmp_path, toml)
    q = loaded.open_angles()
    assert q[loaded.joint_index("index_j1")] == pytest.approx(0.2)
    np.testing.assert_allclose(q, [j.open_value for j in loaded.joints])


@pytest.mark.parametrize(
    ("toml", "message"),
    [
        ("palm = ", r"over\.toml: not TOML"),
        ("plam = 'palm'", "plam: unknown key; expected one of palm, collision_source"),
        ("palm = 3", "palm: expected a text in quotes, got 3"),
        ("collision_source = 'hull'", "collision_source: expected one of engine, raw, visual, got 'hull'"),
        ("fingers = 3", r"fingers: expected a table \[fingers\], got 3"),
        ("[fingers]\nindex = 3", r"fingers\.index: expected a table"),
        ("[fingers.index]\njoint = []", r"fingers\.index\.joint: unknown key; expected one of joints, tip, thumb"),
        ("[fingers.index]\njoints = 'index_j0'", r"fingers\.index\.joints: expected a list of names"),
        ("[fingers.index]\njoints = []", r"fingers\.index\.joints: expected a list of names"),
        ("[fingers.index]\njoints = ['index_j0', 'thumb_j1']", r"fingers\.index\.joints: expected one chain"),
        ("[fingers.index]\njoints = ['index_j1', 'index_j0']", r"palm side first"),
        ("[fingers.index]\ntip = 'thumb_link1'", r"fingers\.index\.tip: link 'thumb_link1' is not in this finger"),
        ("[joints.index_j0]\nrole = 'wrist'", r"joints\.index_j0\.role: expected one of closing, posture"),
        ("[joints.index_j0]\ndirection = 2", r"joints\.index_j0\.direction: expected 1 or -1, got 2"),
        ("[joints.index_j0]\ndirection = true", r"joints\.index_j0\.direction: expected a finite number, got True"),
        ("[joints.index_j0]\nopen = nan", r"joints\.index_j0\.open: expected a finite number"),
        ("[joints.index_j0]\nopen = 2.0", r"joints\.index_j0\.open: expected an angle inside \[0, 1\.6\] rad, got 2"),
        ("[joints.index_j0]\neffort = 0.0", r"joints\.index_j0\.effort: expected a torque above 0 \[Nm\], got 0"),
        ("[joints.index_j0]\neffort = inf", r"joints\.index_j0\.effort: expected a finite number"),
        ("collision_sorce = 'raw'", r"unknown key; .* Did you mean 'collision_source'\?"),
        ("[joints.index_j0]\nopne = 0.1", r"joints\.index_j0\.opne: unknown key; .* Did you mean 'open'\?"),
        ("[joints.index_j1]\nratio = 2.0", r"joints\.index_j1\.ratio: has a meaning only together with 'follows'"),
        ("[joints.index_j1]\nfollows = 'index_j0'\nratio = 0", r"ratio: expected a number other than 0"),
        ("[joints.index_j1]\nfollows = 'index_j1'", r"joints\.index_j1\.follows: a joint cannot follow itself"),
        (
            "[joints.index_j1]\nfollows = 'index_j0'\nopen = 0.1",
            r"joints\.index_j1\.open: it follows 'index_j0'; give the open value of that",
        ),
        ("[links.palm]\nfriction = -1.0", r"links\.palm\.friction: expected a number of at least 0, got -1"),
        ("allowed_pairs = [['palm']]", "allowed_pairs: expected a list of pairs of link names"),
        ("[tendons]\njoints = ['index_j0']\nmoment_arms = [[1, 2], [3, 4]]", r"tendons\.moment_arms: expected 1 rows"),
    ],
)
def test_malformed_hand_files(tmp_path, toml: str, message: str) -> None:
    with pytest.raises(FileError, match=message) as error:
        load(tmp_path, toml)
    assert "over.toml" in str(error.value)


@pytest.mark.parametrize(
    ("toml", "message"),
    [
        ("[joints.indx_j0]\nopen = 0.1", r"Joint 'indx_j0' is not in .*Did you mean 'index_j0'"),
        ("[joints.index_j0]\nfollows = 'nobody'", r"Joint 'nobody' is not in"),
        ("[fingers.index]\njoints = ['nobody']", r"Joint 'nobody' is not in .*fingers\.index\.joints"),
        ("[fingers.ring]\ntip = 'index_link0'", r"Finger 'ring' is not in .*Fingers: index, middle, thumb"),
        ("[fingers.index]\ntip = 'nothing'", r"Link 'nothing' is not in"),
        ("[links.plam]\nfriction = 1.0", r"Link 'plam' is not in .*Did you mean 'palm'"),
        ("allowed_pairs = [['palm', 'sky']]", r"Link 'sky' is not in .*allowed_pairs"),
        ("palm = 'sky'", r"Link 'sky' is not in"),
    ],
)
def test_unknown_names(tmp_path, toml: str, message: str) -> None:
    with pytest.raises(UnknownNameError, match=message):
        load(tmp_path, toml)


def test_all_joints_as_posture_leaves_nothing_to_close(tmp_path) -> None:
    names = [f"{f}_j{k}" for f in ("index", "middle", "thumb") for k in (0, 1)]
    with pytest.raises(HandError, match="has no closing joint"):
        load(tmp_path, "".join(f'[joints.{n}]\nrole = "posture"\n' for n in names))


def test_missing_hand_file(tmp_path) -> None:
    with pytest.raises(FileError, match=r"gone\.toml: no hand file"):
        Hand.load(written(tmp_path, three_fingers()), hand_file=tmp_path / "gone.toml")


def test_tendons_are_kept(tmp_path) -> None:
    toml = '[tendons]\njoints = ["a", "b"]\nmoment_arms = [[0.01, 0.0], [0.0, -0.02]]\nt_min = 1.0\nt_max = 50.0\n'
    tendons = read_hand_file(written(tmp_path, toml, "over.toml")).tendons
    assert tendons is not None
    assert (tendons.moment_arms[1], tendons.t_min, tendons.t_max) == ((0.0, -0.02), (1.0, 1.0), (50.0, 50.0))


def test_a_contradicting_hand_file_is_refused(tmp_path) -> None:
    toml = '[joints.index_j0]\nfollows = "index_j1"\n[joints.index_j1]\nfollows = "index_j0"\nratio = 2.0\n'
    with pytest.raises(ClenchError, match="contradict"):
        load(tmp_path, toml)
