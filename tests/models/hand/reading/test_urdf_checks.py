"""Whatever is wrong with a URDF is said in one sentence that names the link or joint; nothing is taken in silence."""

from __future__ import annotations

import pytest

from clench.core.exceptions import ClenchError, FileError, UnknownNameError
from clench.models.hand.hand import Hand
from models.hand.hand_models import three_fingers, urdf_hand, urdf_joint, urdf_link, written

U = urdf_hand()


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (U.replace("</robot>", urdf_link("palm") + "</robot>"), "link 'palm' is there twice"),
        (U.replace('name="b2"', 'name="b1"'), "joint 'b1' is there twice"),
        (U.replace('name="b2" type', "type"), "joint number 4 has no name"),
        (U.replace('<link name="b_2">', "<link>"), "link number 5 has no name"),
        (U.replace("</robot>", urdf_joint("c", "b_2", "palm") + "</robot>"), "there is no root"),
        (
            U.replace("</robot>", urdf_joint("c", "a_2", "b_2") + "</robot>"),
            "link 'b_2' is the child of two joints, 'b2' and 'c': a closed linkage",
        ),
        (U.replace('joint="a1" multiplier', 'joint="a2" multiplier'), "joint 'a2' mimics itself"),
        (U.replace('multiplier="0.8"', 'multiplier="nan"'), "joint 'a2': multiplier 'nan' of its mimic"),
        (U.replace('xyz="0 0 0.05"', 'xyz="nan 0 0"', 1), "joint 'a2': origin xyz 'nan 0 0'; expected three finite"),
        (U.replace('rpy="0.1 -0.2 0.3"', 'rpy="0.1"', 1), "joint 'a1': origin rpy '0.1'; expected three finite"),
        (urdf_hand(geometry="<mesh/>"), "collision of link 'b_2': its mesh names no file"),
        (urdf_hand(geometry='<mesh filename="a.stl" scale="1 0 1"/>'), "mesh scale '1 0 1'; expected three numbers"),
        (urdf_hand(geometry="<cone/>"), "collision of link 'b_2': no geometry; expected one of box, cylinder"),
        (urdf_hand(geometry='<box size="-1 1 1"/>'), "box size '-1 1 1'; expected three positive numbers"),
        (urdf_hand(geometry='<sphere radius="big"/>'), "sphere radius 'big'; expected a positive number"),
        (urdf_hand(geometry='<cylinder radius="0.1"/>'), "cylinder length ''; expected a positive number"),
    ],
)
def test_sentence(tmp_path, capfd, text: str, sentence: str) -> None:
    path = written(tmp_path, text, "two.urdf")
    with pytest.raises(FileError) as error:
        Hand.load(path)
    assert str(error.value).startswith(f"{path}: ")
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)
    assert capfd.readouterr() == ("", "")


def test_a_joint_that_mimics_nothing_is_refused(tmp_path) -> None:
    text = U.replace('joint="a1" multiplier', 'joint="a_1" multiplier')
    with pytest.raises(UnknownNameError, match=r"'a_1' is not in .*mimicked by 'a2'\)\. Did you mean 'a1'\?"):
        Hand.load(written(tmp_path, text, "two.urdf"))


@pytest.mark.parametrize("text", ['pos="nan 0 0"', 'quat="1 0 NaN 0"'])
def test_numbers_of_mjcf_that_are_none(tmp_path, text: str) -> None:
    model = three_fingers().replace('name="index_link1" pos="0 0 0.05"', f'name="index_link1" {text}')
    with pytest.raises(ClenchError, match=r"<body> 'index_link1': \w+ '.*'; expected finite numbers"):
        Hand.load(written(tmp_path, model))


def test_no_name_at_all() -> None:
    with pytest.raises(UnknownNameError, match="Hand '' is not in the built-in hands"):
        Hand.load("")
