"""The picture of a hand: drawn for every kind of hand, and what it draws lies where the hand moves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, along_x, mount, one_link, three_links
from clench.apps.cli.main import main
from clench.apps.figures.drawing import style
from clench.apps.figures.maps.hand_map import _map_finger, draw_hand_map
from clench.models.hand.hand import JointRole


def picture(path: Path) -> np.ndarray:
    from PIL import Image

    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def test_the_path_of_a_single_link_is_a_circle_in_every_plane() -> None:
    hand = one_link(radius=0.008, length=0.1, upper=1.0)
    found = _map_finger(hand, hand.fingers[0], hand.default_source, 0.02)
    assert found.paths.shape[::2] == (3, 3)
    radii = np.linalg.norm(found.paths[:, :, [0, 2]], axis=2)
    assert radii == pytest.approx(np.full(radii.shape, radii[0, 0]), rel=1e-12)
    turned = np.arctan2(found.paths[1, -1, 2], found.paths[1, -1, 0])
    assert turned == pytest.approx(1.0, abs=1e-12)
    assert sorted(found.paths[:, 0, 1]) == pytest.approx([-0.008, 0.0, 0.008], abs=1e-5)
    assert found.axes[0] == pytest.approx(np.array([[0, 0.02, 0], [0, -0.02, 0]]), abs=1e-15)


def test_a_builtin_hand(tmp_path) -> None:
    image = picture(draw_hand_map(clench.Hand.load("patent15"), tmp_path / "hand.png"))
    assert image.shape == (750, 1710, 3)
    orange = (abs(image - [0xD5, 0x5E, 0x00]).sum(axis=2) < 60).sum()
    assert orange > 1000


@pytest.mark.parametrize(
    "hand",
    [
        one_link(upper=0.0),
        HandBuilder().finger("still", [along_x(0.006, 0.05)], [0.05], roles=[JointRole.POSTURE]).hand(),
        three_links(direction=-1, lower=-1.0, upper=0.0),
        HandBuilder().finger("a", [None, along_x(0.006, 0.05)], [0.0, 0.05], base=mount((0, 0.03, 0))).hand(),
    ],
    ids=["no motion", "no closing joint", "closes down", "empty link"],
)
def test_odd_hands_are_drawn_too(tmp_path, hand) -> None:
    assert picture(draw_hand_map(hand, tmp_path / "hand.png")).min() < 100


#: How the files of each format begin.
BEGINNINGS = {
    ".png": b"\x89PNG",
    "": b"\x89PNG",
    ".PNG": b"\x89PNG",
    ".pdf": b"%PDF",
    ".svg": b"<?xml",
    ".webp": b"RIFF",
    ".eps": b"%!PS",
    ".ps": b"%!PS",
    ".jpg": b"\xff\xd8",
    ".jpeg": b"\xff\xd8",
    ".tif": b"II*",
    ".tiff": b"II*",
}


def test_the_ending_says_the_format(tmp_path) -> None:
    assert set(style.ENDINGS) <= set(BEGINNINGS)
    figure = style.new_figure(40, 30)
    for ending, beginning in BEGINNINGS.items():
        path = style.save_figure(figure, tmp_path / f"hand{ending}")
        assert path.read_bytes().startswith(beginning)
    with pytest.raises(clench.FileError, match=r"no figure has the ending '\.txt'; expected \.png, "):
        style.save_figure(figure, tmp_path / "hand.txt")
    assert not (tmp_path / "hand.txt").exists()


def test_the_command_writes_it_and_says_where(tmp_path, capsys) -> None:
    path = tmp_path / "hand.png"
    assert main(["hand", "robonaut2", "--figure", str(path)]) == 0
    assert "hand.png" in capsys.readouterr().out
    assert path.is_file()
    assert main(["hand", "robonaut2", "--figure", str(tmp_path / "no" / "hand.png")]) == 2
    assert "cannot be written" in capsys.readouterr().err


def test_the_report_names_findings_in_words_and_in_json(tmp_path, capsys) -> None:
    import json

    model = tmp_path / "two.urdf"
    links = "".join(
        f'<link name="{n}"><visual><geometry><box size="0.02 0.02 0.05"/></geometry></visual></link>' for n in "pab"
    )
    joints = "".join(
        f'<joint name="j{c}" type="revolute"><parent link="p"/><child link="{c}"/><axis xyz="{2 * s} 0 0"/>'
        f'<origin xyz="0 {0.03 * s} 0.05"/><limit lower="0" upper="1.5"/></joint>'
        for c, s in (("a", 1), ("b", -1))
    )
    model.write_text(f'<robot name="two">{links}{joints}</robot>')
    assert main(["hand", str(model), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    codes = [finding["code"] for finding in document["findings"]]
    assert codes == ["collision_from_visuals", "axis_not_unit", "axis_not_unit", "effort_missing"]
    assert document["findings"][1]["numbers"] == {"length": 2.0}
    # The last one is a note.
    assert document["warnings"] == [f["text"] for f in document["findings"][:-1]]
    assert main(["hand", str(model)]) == 0
    shown = capsys.readouterr().out
    assert "warning (axis_not_unit): Joint 'ja': its axis has length 2 in the model" in shown
    assert "-> Correct the model" in shown
    assert main(["hand", "robonaut2"]) == 0
    assert "nothing looks wrong" in capsys.readouterr().out
