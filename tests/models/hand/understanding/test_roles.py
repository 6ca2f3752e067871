"""Fingers, thumb, roles, closing directions and open values, found from models."""

from __future__ import annotations

import numpy as np
import pytest

from clench.core.exceptions import HandError
from clench.models.hand.hand import Hand, Joint
from clench.models.hand.understanding.finger_names import place_names, short_names
from models.hand.hand_models import finger, hand, three_fingers, written


def joint(loaded: Hand, name: str) -> Joint:
    return loaded.joints[loaded.joint_index(name)]


def test_fingers_thumb_and_palm(tmp_path) -> None:
    loaded = Hand.load(written(tmp_path, three_fingers()))
    assert [f.name for f in loaded.fingers] == ["index", "middle", "thumb"]
    assert [f.is_thumb for f in loaded.fingers] == [False, False, True]
    assert loaded.links[loaded.palm].name == "palm"
    assert [loaded.links[i].name for i in loaded.fixed_links] == ["palm"]
    index = loaded.finger("index")
    assert [loaded.links[i].name for i in index.links] == ["index_link0", "index_link1"]
    assert loaded.links[index.tip_link].name == "index_link1"
    np.testing.assert_allclose(loaded.palm_center, [0.0, -0.04 / 3, 0.13 / 3], atol=1e-12)
    # Closing about +x turns +z towards -y; the thumb, which closes straight against that, is left out.
    np.testing.assert_allclose(loaded.palm_normal, [0.0, -1.0, 0.0], atol=1e-9)


def test_palm_faces_the_side_where_the_fingers_close(tmp_path) -> None:
    fingers = [finger("index", (0.02, 0.0, 0.05)), finger("middle", (-0.02, 0.0, 0.05))]
    text = hand(*fingers, finger("thumb", (0.05, 0.0, 0.0), axes=["0 -1 0"] * 2))
    # Closing about +x turns +z towards -y; the thumb, which closes sideways, is left out of the mean.
    np.testing.assert_allclose(Hand.load(written(tmp_path, text)).palm_normal, [0.0, -1.0, 0.0], atol=1e-9)


@pytest.mark.parametrize(("degrees", "role"), [(4.9, "closing"), (5.1, "posture"), (90.0, "posture")])
def test_closing_joints_are_those_parallel_to_the_last_axis(tmp_path, degrees: float, role: str) -> None:
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    for sign in (1.0, -1.0):
        axes = [f"{sign * c} {sign * s} 0", "1 0 0"]
        text = hand(finger("a", axes=axes, limits=["-1.6 1.7"] * 2), finger("b", (0.03, 0, 0.05)))
        assert joint(Hand.load(written(tmp_path, text)), "a_j0").role == role


@pytest.mark.parametrize("flipped", [False, True])
def test_direction_runs_to_the_farther_limit_whatever_the_axis_sign(tmp_path, flipped: bool) -> None:
    axes, limits = (["1 0 0", "-1 0 0"], ["-0.2 1.6", "-1.6 0.1"]) if flipped else (["1 0 0"] * 2, ["-0.2 1.6"] * 2)
    loaded = Hand.load(written(tmp_path, hand(finger("a", axes=axes, limits=limits), finger("b", (0.03, 0, 0.05)))))
    assert [joint(loaded, n).direction for n in ("a_j0", "a_j1")] == ([1, -1] if flipped else [1, 1])
    assert joint(loaded, "a_j1").open_value == 0.0
    assert "farther from straight" in joint(loaded, "a_j1").direction_reason
    assert not any("opposite" in w for w in loaded.warnings)


def test_equal_limits_follow_the_other_joints_of_the_finger(tmp_path) -> None:
    text = hand(finger("a", axes=["-1 0 0", "1 0 0"], limits=["-0.7 0.7", "-0.2 1.6"]), finger("b", (0.03, 0, 0.05)))
    loaded = Hand.load(written(tmp_path, text))
    assert joint(loaded, "a_j0").direction == -1
    assert "like the other joints" in joint(loaded, "a_j0").direction_reason


def claw(angle: float, name: str) -> str:
    """Return a finger of a claw: it stands on a circle and turns about the tangent, limits alike on both sides."""
    c, s = np.cos(angle), np.sin(angle)
    sign = 1 if name != "b" else -1
    return finger(name, (0.05 * c, 0.05 * s, 0.02), axes=[f"{-sign * s} {sign * c} 0"] * 2, limits=["-1.5 1.5"] * 2)


def test_a_claw_closes_inwards_when_limits_tell_nothing(tmp_path) -> None:
    fingers = [claw(a, n) for a, n in zip((0.0, 2.1, 4.2), "abc", strict=True)]
    loaded = Hand.load(written(tmp_path, hand(*fingers)))
    q, reach = loaded.open_angles(), []
    for angle in (0.0, 0.4):
        for i, j in enumerate(loaded.joints):
            q[i] = j.open_value + j.direction * angle
        poses = loaded.link_poses(q)
        reach.append([np.linalg.norm(poses[f.tip_link][:2, 3]) for f in loaded.fingers])
    assert (np.array(reach[1]) < np.array(reach[0]) - 0.005).all()
    assert joint(loaded, "b_j0").direction == -joint(loaded, "a_j0").direction
    np.testing.assert_allclose(loaded.palm_normal, [0, 0, 1], atol=0.05)
    assert not any(f.is_thumb for f in loaded.fingers)


def test_flat_symmetric_fingers_are_reported_as_uncertain(tmp_path) -> None:
    text = hand(*(finger(n, (x, 0, 0.05), limits=["-1.5 1.5"] * 2) for n, x in (("a", 0.02), ("b", -0.02))))
    assert any("hardly be told" in w for w in Hand.load(written(tmp_path, text)).warnings)


def test_bent_links_move_the_straight_angle(tmp_path) -> None:
    bent = finger("a", limits=["-0.2 1.6", "-1.2 1.6"]).replace(
        'name="a_link1" pos="0 0 0.05"', 'name="a_link1" pos="0 0 0.05" euler="0.7 0 0"'
    )
    loaded = Hand.load(written(tmp_path, hand(bent, finger("b", (0.03, 0, 0.05)))))
    assert joint(loaded, "a_j1").open_value == pytest.approx(-0.7, abs=0.02)
    assert joint(loaded, "a_j1").direction == 1
    assert "in line at -40 deg" in joint(loaded, "a_j1").open_reason


def test_reference_posture_is_straight_when_the_links_say_so(tmp_path) -> None:
    text = hand(finger("a", limits=["-0.2 1.6", "-0.9 1.5"], attributes='ref="-0.6"'), finger("b", (0.03, 0, 0.05)))
    loaded = Hand.load(written(tmp_path, text))
    assert joint(loaded, "a_j1").open_value == -0.6
    assert "reference posture" in joint(loaded, "a_j1").open_reason


def test_open_value_stays_inside_the_limits(tmp_path) -> None:
    text = hand(finger("a", limits=["0.3 1.6", "0.1 1.6"]), finger("b", (0.03, 0, 0.05)))
    loaded = Hand.load(written(tmp_path, text))
    assert [joint(loaded, n).open_value for n in ("a_j0", "a_j1")] == [0.3, 0.1]
    assert "limit nearest to straight" in joint(loaded, "a_j0").open_reason


def test_opposing_finger_without_a_name_is_the_thumb(tmp_path) -> None:
    text = hand(
        finger("p", (0.02, 0.03, 0.05)),
        finger("q", (-0.02, 0.03, 0.05)),
        finger("r", (0.0, -0.03, 0.05), axes=["-1 0 0"] * 2),
    )
    loaded = Hand.load(written(tmp_path, text))
    assert [f.is_thumb for f in loaded.fingers] == [False, False, True]
    np.testing.assert_allclose(loaded.palm_normal, [0, 0, 1], atol=1e-6)


def test_a_chain_without_geometry_makes_no_finger(tmp_path) -> None:
    bare = (
        '<body name="x" pos="0 0 0.1"><joint name="dial" axis="0 0 1" range="0 1"/>'
        '<inertial mass="0.1" pos="0 0 0" diaginertia="1e-5 1e-5 1e-5"/></body>'
    )
    loaded = Hand.load(written(tmp_path, hand(finger("a"), finger("b", (0.03, 0, 0.05)), bare)))
    assert [f.name for f in loaded.fingers] == ["a", "b"]
    assert any("'dial' move no geometry" in w for w in loaded.warnings)


def test_one_finger_is_a_hand_with_a_warning(tmp_path) -> None:
    loaded = Hand.load(written(tmp_path, hand(finger("a"))))
    assert loaded.links[loaded.palm].name == "palm"
    assert "The hand has only one finger." in loaded.warnings


def test_fingers_that_stand_on_the_world_take_it_as_palm(tmp_path) -> None:
    text = hand(finger("a"), finger("b", (0.03, 0, 0.05))).replace('<body name="palm">', "")
    loaded = Hand.load(written(tmp_path, text.replace("</body></worldbody>", "</worldbody>")))
    assert loaded.links[loaded.palm].name == "world"
    assert len(loaded.fingers) == 2


def test_shared_metacarpal_joint_is_posture_and_nobodys(tmp_path) -> None:
    meta = (
        '<body name="meta" pos="0 0 0.02"><joint name="arch" axis="0 0 1" range="0 0.5"/><geom size="0.01"/>'
        + finger("ring", (0.01, 0, 0.03))
        + finger("little", (-0.01, 0, 0.03))
        + "</body>"
    )
    text = hand(finger("index", (0.05, 0, 0.05)), finger("middle", (0.03, 0, 0.05)), meta)
    loaded = Hand.load(written(tmp_path, text))
    assert loaded.links[loaded.palm].name == "palm"
    assert sorted(f.name for f in loaded.fingers) == ["index", "little", "middle", "ring"]
    assert joint(loaded, "arch").role == "posture"
    assert "share" in joint(loaded, "arch").role_reason
    assert "meta" in [loaded.links[i].name for i in loaded.fixed_links]


ARM = (
    '<body name="base"><geom size="0.05"/><body name="arm1" pos="0 0 0.2"><joint name="s1" axis="0 1 0" range="-2 2"/>'
    '<geom size="0.04"/><body name="arm2" pos="0 0 0.3"><joint name="s2" axis="1 0 0" range="-2 2"/><geom size="0.04"/>'
)


def robot() -> str:
    """Return a body with two arms of three joints, a hand on each, and two legs."""
    arms = ""
    for side, y in (("left", 0.3), ("right", -0.3)):
        arms += f'<body name="{side}_0" pos="0 {y} 0">' + "".join(
            f'<body name="{side}_{k}" pos="0 0 0.2"><joint name="{side}_s{k}" axis="0 1 0" range="-2 2"/>'
            '<geom size="0.04"/>'
            for k in range(1, 4)
        )
        arms += f'<body name="{side}_palm" pos="0 0 0.1"><geom size="0.03"/>'
        arms += finger(f"{side}_a", (0.03, 0, 0.03)) + finger(f"{side}_b", (-0.03, 0, 0.03), axes=["-1 0 0"] * 2)
        arms += "</body>" * 5
    extra = (
        '<actuator><motor joint="left_s1"/><motor joint="right_s1"/></actuator>'
        '<keyframe><key qpos="' + " ".join(["0"] * 14) + '"/></keyframe>'
    )
    return (
        '<mujoco model="robot"><compiler angle="radian" autolimits="true"/><worldbody><body name="torso">'
        f'<geom size="0.1"/>{arms}</body></worldbody>{extra}</mujoco>'
    )


def test_a_hand_on_an_arm_finds_its_palm_by_itself(tmp_path) -> None:
    text = hand(finger("a", (0.03, 0, 0.05)), finger("b", (-0.03, 0, 0.05)), before=ARM, after="</body>" * 3)
    loaded = Hand.load(written(tmp_path, text))
    assert loaded.links[loaded.palm].name == "palm"
    assert [joint(loaded, n).role for n in ("s1", "s2", "a_j0")] == ["upstream", "upstream", "closing"]
    assert [loaded.links[i].name for i in loaded.fixed_links] == ["base", "arm1", "arm2", "palm"]


def test_a_hand_in_a_robot_is_picked_by_its_palm(tmp_path) -> None:
    path = written(tmp_path, robot())
    with pytest.raises(HandError, match=r"several links carry.*'left_palm', 'right_palm'.*name the palm"):
        Hand.load(path)
    loaded = Hand.load(path, palm="left_palm")
    assert [f.name for f in loaded.fingers] == ["a", "b"]
    assert loaded.joint_names[:3] == ("left_s1", "left_s2", "left_s3")
    assert not any("right" in link.name for link in loaded.links)
    assert "right" not in loaded.spec_xml
    assert any("eft out" in f.text for f in loaded.findings)


def test_lights_and_cameras_that_look_at_another_limb_go_with_it(tmp_path) -> None:
    looking = (
        '<light name="spot" mode="targetbody" target="right_palm" pos="0 0 2"/>'
        '<camera name="lost" mode="targetbodycom" target="right_a_link0" pos="0 0 2"/>'
        '<camera name="kept" mode="targetbody" target="left_palm" pos="0 0 2"/>'
    )
    loaded = Hand.load(written(tmp_path, robot().replace("<worldbody>", f"<worldbody>{looking}")), palm="left_palm")
    assert [name in loaded.spec_xml for name in ("spot", "lost", "kept")] == [False, False, True]


def test_the_pruned_robot_still_moves_like_the_whole(tmp_path) -> None:
    import mujoco

    loaded = Hand.load(written(tmp_path, robot()), palm="right_palm")
    whole = mujoco.MjSpec.from_string(robot()).compile()
    data = mujoco.MjData(whole)
    q = np.linspace(-0.2, 0.5, len(loaded.joints))
    for name, angle in zip(loaded.joint_names, q, strict=True):
        data.qpos[whole.joint(name).qposadr[0]] = angle
    mujoco.mj_kinematics(whole, data)
    palm, tip = whole.body("right_palm").id, whole.body("right_b_link1").id
    expected = data.xmat[palm].reshape(3, 3).T @ (data.xpos[tip] - data.xpos[palm])
    np.testing.assert_allclose(loaded.link_poses(q)[loaded.link_index("right_b_link1")][:3, 3], expected, atol=1e-12)
    mujoco.MjSpec.from_string(loaded.spec_xml, assets=dict(loaded.assets)).compile()


@pytest.mark.parametrize(
    ("joints", "links", "names"),
    [
        ([["rh_FFJ4", "rh_FFJ3"], ["rh_THJ5", "rh_THJ4"]], [["a"], ["b"]], ["ff", "th"]),
        ([["x:FFJ1", "x:FFJ0"], ["x:MFJ1", "x:MFJ0"]], [["a"], ["b"]], ["ff", "mf"]),
        ([["joint_f1_0", "joint_f1_1"], ["joint_f2_0", "joint_f2_1"]], [["a"], ["b"]], ["f1", "f2"]),
        ([["finger_1_a", "finger_1_b"], ["finger_2_a", "finger_2_b"]], [["a"], ["b"]], ["finger_1", "finger_2"]),
        ([["h/rl/ring", "h/rl/ringMedial"], ["h/rl/little", "h/rl/littleMedial"]], [["a"], ["b"]], ["ring", "little"]),
        ([["R_thumb_yaw"], ["R_index_proximal"]], [["a"], ["b"]], ["thumb", "index"]),
        ([["0", "1"], ["12", "13"]], [["pip", "index_tip"], ["thumb_pip", "pip_4"]], ["index", "thumb"]),
        ([["joint_0.0", "joint_1.0"], ["joint_12.0", "joint_13.0"]], [["l0"], ["l1"]], ["", ""]),
        ([["0"], ["1"]], [["a"], ["b"]], ["", ""]),
    ],
)  # fmt: skip
def test_short_names(joints: list[list[str]], links: list[list[str]], names: list[str]) -> None:
    assert short_names(joints, links) == names


def test_place_names_count_from_the_thumb() -> None:
    assert place_names([0.04, 0.0, -0.04, 0.1], 3, [""] * 4) == ["ring", "middle", "index", "thumb"]
    assert place_names([0.0] * 3, None, [""] * 3) == ["finger1", "finger2", "finger3"]
    assert place_names([0.0] * 3, None, ["finger2", "", ""]) == ["finger2", "finger3", "finger4"]
