"""Bad models are answered in one sentence that names the file, the element and what was expected."""

from __future__ import annotations

from pathlib import Path

import pytest

from clench.core.exceptions import ClenchError, FileError, HandError, UnknownNameError
from clench.models.hand.hand import Hand
from models.hand.hand_models import finger, hand, three_fingers, urdf_hand, written


def test_unknown_built_in_names_list_what_exists() -> None:
    with pytest.raises(UnknownNameError, match=r"'robonaut' is not in the built-in hands.*Did you mean 'robonaut2'"):
        Hand.load("robonaut")


def test_missing_file(tmp_path) -> None:
    with pytest.raises(FileError, match=r"nowhere\.urdf: no such file; expected a hand model"):
        Hand.load(tmp_path / "nowhere.urdf")
    with pytest.raises(FileError, match="is a folder"):
        Hand.load(tmp_path)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("hand.xml", "this is no XML", "not well-formed XML"),
        ("hand.urdf", "<robot name='x'><link", "not well-formed XML"),
        ("hand.xml", "<sdf version='1.6'/>", r"root element <sdf>; expected <robot> \(URDF\) or <mujoco>"),
        ("hand.txt", "<mujoco/>", r"expected a hand model \(\.urdf, \.xml, \.mjcf\), got a '\.txt' file"),
        ("hand.urdf", "<robot name='x'/>", "has no <link>"),
        ("hand.xml", "<mujoco><worldbody><body><joint typ='hinge'/></body></worldbody></mujoco>", "MuJoCo cannot"),
        ("hand.xml", "<mujoco><worldbody><include file='gone.xml'/></worldbody></mujoco>", "'gone.xml' is missing"),
    ],
)
def test_malformed_files(tmp_path, name: str, text: str, message: str) -> None:
    with pytest.raises(FileError, match=message) as error:
        Hand.load(written(tmp_path, text, name))
    assert name in str(error.value)


def test_a_file_that_includes_itself(tmp_path) -> None:
    path = written(tmp_path, "<mujoco><include file='hand.xml'/></mujoco>")
    with pytest.raises(FileError, match=r"file 'hand\.xml' is included twice"):
        Hand.load(path)


@pytest.mark.parametrize("named", ["package://shop/meshes/tip.stl", "meshes/tip.obj", "file:///gone/tip.dae"])
def test_missing_mesh_is_named_with_its_link(tmp_path, named: str) -> None:
    path = written(tmp_path, urdf_hand(geometry=f'<mesh filename="{named}"/>'), "two.urdf")
    with pytest.raises(FileError, match=f"mesh '{named}' of link 'b_2' is missing; looked for") as error:
        Hand.load(path)
    assert "tip" in str(error.value)


def test_missing_mjcf_mesh_is_named(tmp_path) -> None:
    text = three_fingers('<asset><mesh name="tip" file="gone.stl"/></asset>')
    with pytest.raises(FileError, match=r"mesh 'gone\.stl' of <mesh> 'tip' is missing"):
        Hand.load(written(tmp_path, text))


@pytest.mark.parametrize(
    ("content", "suffix"), [(b"", "stl"), (b"no mesh at all", "ply"), (b"solid x\nendsolid", "stl")]
)
def test_unreadable_mesh(tmp_path, content: bytes, suffix: str) -> None:
    (tmp_path / f"tip.{suffix}").write_bytes(content)
    path = written(tmp_path, urdf_hand(geometry=f'<mesh filename="tip.{suffix}"/>'), "two.urdf")
    with pytest.raises(FileError, match=rf"mesh 'tip\.{suffix}' of link 'b_2'"):
        Hand.load(path)


def test_xacro_is_refused(tmp_path) -> None:
    text = urdf_hand().replace("<link", '<xacro:macro xmlns:xacro="http://www.ros.org/wiki/xacro" name="m"/><link', 1)
    with pytest.raises(FileError, match="xacro template"):
        Hand.load(written(tmp_path, text, "two.urdf"))


def test_joint_with_unknown_link(tmp_path) -> None:
    text = urdf_hand().replace('<child link="b_2"/>', '<child link="b_9"/>')
    with pytest.raises(FileError, match=r"joint 'b2' names the child link 'b_9', which does not exist\. Links: a_1"):
        Hand.load(written(tmp_path, text, "two.urdf"))


@pytest.mark.parametrize("text", [hand(), hand("<body name='tip'><geom size='0.01'/></body>")])
def test_hand_with_no_closing_joint(tmp_path, text: str) -> None:
    with pytest.raises(HandError, match="has no closing joint"):
        Hand.load(written(tmp_path, text))


def test_no_joint_below_the_named_palm(tmp_path) -> None:
    path = written(tmp_path, three_fingers())
    with pytest.raises(HandError, match="no joint moves anything below the palm 'index_link1'"):
        Hand.load(path, palm="index_link1")
    with pytest.raises(UnknownNameError, match=r"Link 'plam' is not in .*Did you mean 'palm'"):
        Hand.load(path, palm="plam")


def test_a_link_turned_by_nothing_is_named(tmp_path) -> None:
    turned = three_fingers().replace('<body name="index_link1"', '<body quat="1e200 0 0 0" name="index_link1"')
    with pytest.raises(ClenchError, match=r"<body> 'index_link1': quat '1e200 0 0 0'; expected finite numbers"):
        Hand.load(written(tmp_path, turned))


def test_prismatic_finger(tmp_path) -> None:
    sliding = finger("a").replace('<joint name="a_j1"', '<joint type="slide" name="a_j1"')
    text = hand(sliding, finger("b", (0.03, 0, 0.05)))
    with pytest.raises(HandError, match="joint 'a_j1' of link 'a_link1' is prismatic"):
        Hand.load(written(tmp_path, text))


@pytest.mark.parametrize(
    ("loop", "kind"),
    [
        ('<connect body1="index_link1" body2="middle_link1" anchor="0 0 0"/>', "connect"),
        ('<weld body1="index_link1" body2="palm"/>', "weld"),
    ],
)
def test_closed_loops_name_their_bodies(tmp_path, loop: str, kind: str) -> None:
    path = written(tmp_path, three_fingers(f"<equality>{loop}</equality>"))
    with pytest.raises(HandError, match=rf"bodies 'index_link1' and '\w+' close a kinematic loop \(<{kind}>\)"):
        Hand.load(path)
    with pytest.raises(HandError, match="close a kinematic loop"):
        Hand.load(path, palm="palm")


def test_a_weld_to_the_world_or_a_mocap_body_is_no_loop(tmp_path) -> None:
    mocap = '</worldbody><worldbody><body name="target" mocap="true"/></worldbody>'
    text = three_fingers('<equality><weld body1="target" body2="palm"/></equality>').replace("</worldbody>", mocap, 1)
    assert len(Hand.load(written(tmp_path, text)).fingers) == 3


def test_bodies_and_joints_without_names_get_some(tmp_path) -> None:
    text = three_fingers().replace('name="index_link1"', "").replace('name="index_j1"', "")
    loaded = Hand.load(written(tmp_path, text))
    assert "body3" in [link.name for link in loaded.links]
    assert "body3_joint" in loaded.joint_names
    assert 'name="body3_joint"' in loaded.spec_xml


def test_unknown_collision_source(tmp_path) -> None:
    with pytest.raises(UnknownNameError, match=r"'hull' is not in the collision sources.*engine, raw, visual"):
        Hand.load(written(tmp_path, three_fingers()), collision_source="hull")


def test_every_message_is_one_sentence_without_a_traceback(tmp_path) -> None:
    for text in ("<mujoco><worldbody/></mujoco>", "<mujoco", hand()):
        with pytest.raises(ClenchError) as error:
            Hand.load(written(tmp_path, text))
        assert "Traceback" not in str(error.value)
        assert "\n" not in str(error.value)
        assert str(Path("hand.xml")) in str(error.value)
