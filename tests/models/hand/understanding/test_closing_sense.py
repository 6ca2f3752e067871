"""A finger closes one way, whatever the limits of one joint say; tips, palm normals and thumbs follow the hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clench.models.hand.hand import Hand, Joint
from models.hand.hand_models import finger, hand, written

CURLED = ["-0.2 1.6"] * 3
PAD = '<body name="pad" pos="0 0 0.02"><geom type="box" size="0.006 0.009 0.006" pos="0 -0.01 0"/></body>'


def loaded(folder: Path, *fingers: str, extra: str = "") -> Hand:
    return Hand.load(written(folder, hand(*fingers, extra=extra)))


def joint(read: Hand, name: str) -> Joint:
    return read.joints[read.joint_index(name)]


def three(name: str, x: float, limits: list[str], axes: list[str] | None = None) -> str:
    return finger(name, (x, 0.0, 0.05), (0.04, 0.03, 0.02), axes or ["1 0 0"] * 3, limits)


def jaws(limits: tuple[str, str], tilt: float = 0.0) -> list[str]:
    """Return two jaws that stand on the palm and turn about y: `left` towards +x for positive angles, `right` away."""
    found = []
    for name, x, limit in (("left", -0.012, limits[0]), ("right", 0.012, limits[1])):
        lean = tilt if x < 0 else -tilt
        found.append(
            finger(name, (x, 0.0, 0.05), (0.08,), ["0 1 0"], [limit]).replace("<joint", f'<joint ref="{lean}"')
        )
    return found


def gap(read: Hand, share: float) -> float:
    """Return the distance between the links of two jaws that have closed by a share of their ranges [m]."""
    q = read.open_angles()
    for i, j in enumerate(read.joints):
        q[i] += share * ((j.upper if j.direction > 0 else j.lower) - q[i])
    poses = read.link_poses(read.coupled(q))
    ends = [poses[f.tip_link] @ np.array([0.0, 0.0, 0.07, 1.0]) for f in read.fingers]
    return float(np.linalg.norm(ends[0] - ends[1]))


def test_a_pad_on_a_proximal_link_is_no_tip(tmp_path) -> None:
    padded = finger("index").replace("</body></body>", f"</body>{PAD}</body>")
    read = loaded(tmp_path, padded, finger("middle", (0.03, 0.0, 0.05)))
    assert read.finger("index").links[-1] == read.link_index("pad")
    assert read.links[read.finger("index").tip_link].name == "index_link1"
    np.testing.assert_allclose(read.palm_normal, [0.0, -1.0, 0.0], atol=1e-9)


def test_a_pad_on_the_last_link_is_no_tip_unless_it_reaches_farther(tmp_path) -> None:
    for at, tip in (("0 0 0.01", "index_link1"), ("0 0 0.04", "pad")):
        padded = finger("index").replace("</body></body>", PAD.replace("0 0 0.02", at) + "</body></body>")
        read = loaded(tmp_path, padded, finger("middle", (0.03, 0.0, 0.05)))
        assert read.links[read.finger("index").tip_link].name == tip


@pytest.mark.parametrize("odd", [0, 1, 2])
def test_limits_of_one_joint_do_not_outvote_the_rest(tmp_path, odd: int) -> None:
    """Two joints lean to their upper limits a little, the third leans to its lower one by far more than both."""
    limits = ["-0.6 0.8"] * 3
    limits[odd] = "-3.0 0.2"
    read = loaded(tmp_path, three("a", 0.0, limits), three("b", 0.03, CURLED))
    assert [joint(read, f"a_j{k}").direction for k in range(3)] == [1, 1, 1]
    assert "though the lower limit is farther" in joint(read, f"a_j{odd}").direction_reason
    warning = next(f for f in read.findings if f.code == "directions_opposed")
    assert warning.joints == (f"a_j{odd}",)
    assert f"[joints.a_j{odd}]: direction = -1" in warning.advice


def test_axis_signs_count_when_joints_vote(tmp_path) -> None:
    read = loaded(
        tmp_path,
        three("a", 0.0, ["-1.6 0.2", "-0.2 1.6", "-1.6 0.2"], ["-1 0 0", "1 0 0", "1 0 0"]),
        three("b", 0.03, CURLED),
    )
    assert [joint(read, f"a_j{k}").direction for k in range(3)] == [-1, 1, 1]


def test_even_votes_go_to_the_side_of_the_other_fingers(tmp_path) -> None:
    tied = finger("a", limits=["-0.3 0.4", "-1.6 0.1"])
    others = [finger(n, (x, 0.0, 0.05)) for n, x in (("b", 0.03), ("c", -0.03))]
    read = loaded(tmp_path, tied, *others)
    assert [joint(read, n).direction for n in ("a_j0", "a_j1")] == [1, 1]
    assert (
        "side of the other fingers" in joint(read, "a_j0").direction_reason
        or "upper" in joint(read, "a_j0").direction_reason
    )
    mirrored = [finger(n, (x, 0.0, 0.05), limits=["-1.6 0"] * 2) for n, x in (("b", 0.03), ("c", -0.03))]
    read = loaded(tmp_path, tied, *mirrored)
    assert [joint(read, n).direction for n in ("a_j0", "a_j1")] == [-1, -1]


def test_even_votes_of_a_thumb_go_to_where_the_tips_meet(tmp_path) -> None:
    fingers = [finger(n, (x, 0.0, 0.05)) for n, x in (("index", 0.02), ("middle", -0.02))]
    for axis, way in (("-1 0 0", 1), ("1 0 0", -1)):
        thumb = finger("thumb", (0.0, -0.08, 0.05), axes=[axis] * 2, limits=["-0.3 0.4", "-1.6 0.1"])
        read = loaded(tmp_path, *fingers, thumb)
        assert [joint(read, n).direction for n in ("thumb_j0", "thumb_j1")] == [way, way]
        assert any(f.code == "direction_uncertain" for f in read.findings)


def test_followers_have_no_vote(tmp_path) -> None:
    """Both followers lean to their lower limits, and turn with their leader all the same."""
    couplings = '<equality><joint joint1="a_j1" joint2="a_j0"/><joint joint1="a_j2" joint2="a_j0"/></equality>'
    leaning = three("a", 0.0, ["-0.2 1.0", "-1.6 1.0", "-1.6 1.0"])
    read = loaded(tmp_path, leaning, three("b", 0.03, CURLED), extra=couplings)
    assert [joint(read, f"a_j{k}").direction for k in range(3)] == [1, 1, 1]
    assert not read.warnings


def test_a_finger_of_followers_turns_with_its_leader(tmp_path) -> None:
    read = loaded(
        tmp_path,
        *jaws(("-0.8 0", "-0.9 0.9")),
        extra='<equality><joint joint1="right_j0" joint2="left_j0" polycoef="0 -1 0 0 0"/></equality>',
    )
    assert [joint(read, n).direction for n in ("left_j0", "right_j0")] == [1, -1]
    assert gap(read, 1.0) < gap(read, 0.5) < gap(read, 0.0)


@pytest.mark.parametrize(
    ("limits", "open_at"), [(("-0.8 0", "0 0.8"), (-0.8, 0.8)), (("-0.7 0.05", "-0.05 0.7"), (-0.7, 0.7))]
)
def test_jaws_whose_zero_is_closed_close(tmp_path, limits: tuple[str, str], open_at: tuple[float, float]) -> None:
    read = loaded(tmp_path, *jaws(limits))
    assert [joint(read, n).direction for n in ("left_j0", "right_j0")] == [1, -1]
    np.testing.assert_allclose(read.open_angles(), open_at)
    assert gap(read, 0.0) > 0.1 > 0.03 > gap(read, 1.0)
    assert any("zero is closed" in f.text for f in read.findings)
    np.testing.assert_allclose(read.palm_normal, [0.0, 0.0, 1.0], atol=1e-9)


def test_jaws_whose_zero_is_open_close_as_their_limits_say(tmp_path) -> None:
    wide = [
        text.replace('pos="-0.012', 'pos="-0.05').replace('pos="0.012', 'pos="0.05')
        for text in jaws(("0 0.6", "-0.6 0"))
    ]
    read = loaded(tmp_path, *wide)
    assert [joint(read, n).direction for n in ("left_j0", "right_j0")] == [1, -1]
    np.testing.assert_allclose(read.open_angles(), 0.0)
    assert not any("zero is closed" in f.text for f in read.findings)


def test_a_jaw_that_is_closed_on_a_fixed_one_opens_away_from_it(tmp_path) -> None:
    fixed = '<geom type="box" size="0.006 0.01 0.045" pos="-0.016 0 0.09"/>'
    read = Hand.load(written(tmp_path, hand(jaws(("0 0", "-0.1 1.2"))[1] + fixed)))
    assert (joint(read, "right_j0").direction, joint(read, "right_j0").open_value) == (-1, 1.2)


def test_a_single_finger_on_a_flat_palm_closes_as_its_limits_say(tmp_path) -> None:
    assert {j.direction for j in loaded(tmp_path, finger("a")).joints} == {1}


@pytest.mark.parametrize("tilt", [0.0, 1.0, 2.6])
def test_the_palms_normal_is_that_of_the_fingers_alone(tmp_path, tilt: float) -> None:
    """The thumb closes sideways, against the fingers, or lies against them; the normal stays."""
    thumb = finger("thumb", (0.05, -0.04, 0.0), axes=["0 -1 0"] * 2).replace("<body ", f'<body euler="{tilt} 0 0" ', 1)
    read = loaded(tmp_path, finger("index", (0.02, 0.0, 0.05)), finger("middle", (-0.02, 0.0, 0.05)), thumb)
    np.testing.assert_allclose(read.palm_normal, [0.0, -1.0, 0.0], atol=1e-9)


SWUNG = ["1 0 0", "0 0 1", "1 0 0", "1 0 0"]


def swung(name: str, at: tuple[float, float, float]) -> str:
    limits = ["-0.2 1.2", "-0.9 0.9", "-0.2 1.6", "-0.2 1.6"]
    return finger(name, at, (0.02, 0.02, 0.04, 0.03), SWUNG, limits)


def test_a_thumbs_base_that_is_parallel_only_at_zero_is_posture(tmp_path) -> None:
    read = loaded(
        tmp_path, swung("index", (0.02, 0, 0.05)), swung("middle", (-0.02, 0, 0.05)), swung("thumb", (0, -0.05, 0))
    )
    assert [joint(read, f"thumb_j{k}").role for k in range(4)] == ["posture", "posture", "closing", "closing"]
    assert "'thumb_j1' turns it 52 deg away" in joint(read, "thumb_j0").role_reason
    assert [joint(read, f"index_j{k}").role for k in range(4)] == ["closing", "posture", "closing", "closing"]


def test_an_unnamed_thumb_has_a_base_only_when_it_is_built_unlike_the_fingers(tmp_path) -> None:
    thumb = swung("p", (0.0, -0.05, 0.0)).replace("<body ", '<body euler="0 0 3.14159265" ', 1)
    for plain, role in ((True, "posture"), (False, "closing")):
        fingers = [finger(n, (x, 0, 0.05)) if plain else swung(n, (x, 0, 0.05)) for n, x in (("q", 0.02), ("r", -0.02))]
        read = loaded(tmp_path, *fingers, thumb)
        assert [f.is_thumb for f in read.fingers] == [False, False, True]
        assert joint(read, "p_j0").role == role


def test_a_thumbs_base_that_stays_parallel_closes(tmp_path) -> None:
    thumb = finger("thumb", (0.0, -0.05, 0.0), (0.02, 0.02, 0.03), ["0 0 1", "1 0 0", "1 0 0"])
    read = loaded(tmp_path, finger("index", (0.02, 0, 0.05)), finger("middle", (-0.02, 0, 0.05)), thumb)
    assert [joint(read, f"thumb_j{k}").role for k in range(3)] == ["posture", "closing", "closing"]
