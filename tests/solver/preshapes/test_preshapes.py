"""The preshapes of a hand: their names, and the files that keep them."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, along_x, mount
from clench.core.caching.keeping import Keeper
from clench.solver.preshapes import preshape_cache, preshapes
from clench.solver.preshapes.preshape_cache import MOST_FILES, cache_key, keep_preshapes, read_preshapes
from clench.solver.preshapes.preshape_names import name_preshapes
from clench.solver.preshapes.preshapes import Preshape, opposition_zones


def zones(best: float, bent: bool = False) -> tuple[np.ndarray, np.ndarray, bool]:
    """Return zones that oppose best at an aperture [m]."""
    return np.array([best - 0.002, best, best + 0.01]), np.array([0.3, 0.9, 0.5]), bent


def test_names_say_kind_and_aperture_and_are_unique() -> None:
    shapes = [zones(0.05), zones(0.02), zones(0.06), zones(0.09), zones(0.06, True), zones(0.0203), zones(0.0198)]
    assert name_preshapes(shapes) == [
        *("open", "pinch-20mm", "grip-60mm", "wide-90mm", "curled-60mm", "pinch-20mm-b", "pinch-20mm-c"),
    ]
    many = name_preshapes([zones(0.05)] * 40)
    assert len(set(many)) == 40
    empty = np.empty(0), np.empty(0), False
    assert name_preshapes([empty, empty]) == ["open", "fist"]
    assert name_preshapes([]) == []


def test_the_names_of_a_hand_fit_its_preshapes() -> None:
    hand = clench.Hand.load("robonaut2")
    found = opposition_zones(hand)
    assert found[0].name == "open"
    assert len({shape.name for shape in found}) == len(found)
    for shape in found[1:]:
        kind, _, rest = shape.name.partition("-")
        assert kind in ("pinch", "grip", "wide", "curled")
        assert int(rest.split("mm")[0]) == round(1e3 * shape.aperture[shape.quality.argmax()])
        bent = {name for name in shape.angles if name.endswith(("_medial", "_distal")) and "thumb" not in name}
        assert (kind == "curled") == bool(bent)
    assert all(set(found[0].angles) <= set(shape.angles) for shape in found)
    assert {"thumb_roll", "thumb_proximal", "index_yaw", "middle_yaw"} == set(found[0].angles)


def test_hands_whose_fingers_never_face_each_other_have_none() -> None:
    parts = ([along_x(0.006, 0.05)], [0.05])
    one = HandBuilder().finger("a", *parts).hand()
    assert opposition_zones(one) == ()
    bare = HandBuilder().finger("a", [None], [0.05]).finger("b", [None], [0.05], base=mount((0, 0.05, 0))).hand()
    assert opposition_zones(bare) == ()


@pytest.fixture
def searched(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[Any]:
    """Use an empty cache folder, forget what is in memory, and note every search."""
    searches: list[Any] = []
    search = preshapes._find_zones

    def noted(*given: Any) -> Any:
        searches.append(given)
        return search(*given)

    def forgetful(hand: clench.Hand, key: tuple[Any, ...], make: Any) -> Any:
        return make() if key[0] == "preshapes" else Keeper.kept(hand, key, make)

    monkeypatch.setenv("CLENCH_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(clench.Hand, "kept", forgetful)
    monkeypatch.setattr(preshapes, "_find_zones", noted)
    monkeypatch.setattr(preshapes, "_DRAWS", 60)
    return searches


def files(tmp_path: Path) -> list[Path]:
    return sorted((tmp_path / "cache" / "preshapes").glob("*"))


def assert_same(one: tuple[Preshape, ...], other: tuple[Preshape, ...]) -> None:
    assert [shape.name for shape in one] == [shape.name for shape in other]
    for a, b in zip(one, other, strict=True):
        assert a.angles == b.angles
        for field in ("center", "axis", "aperture", "quality"):
            assert getattr(a, field).tobytes() == getattr(b, field).tobytes()


def test_they_are_found_once_and_read_to_the_bit(searched, tmp_path) -> None:
    hand = clench.Hand.load("robonaut2")
    first = opposition_zones(hand)
    assert len(first) > 3
    (file,) = files(tmp_path)
    assert file.stat().st_size < preshape_cache.MOST_BYTES
    assert_same(first, opposition_zones(clench.Hand.load("robonaut2")))
    assert len(searched) == 1
    opposition_zones(hand, ("thumb", "index"))
    assert len(searched) == 2
    assert len(files(tmp_path)) == 2


def _cut(text: str) -> str:
    return text[: len(text) // 2]


def _other_key(text: str) -> str:
    return json.dumps(json.loads(text) | {"key": "0" * 64})


def _other_schema(text: str) -> str:
    return json.dumps(json.loads(text) | {"schema": "clench.preshapes/0"})


def _other_angle(text: str) -> str:
    document = json.loads(text)
    document["preshapes"][1]["angles"] = {"thumb_roll": 0.01}
    return json.dumps(document)


@pytest.mark.parametrize(
    "damage",
    [
        _cut,
        _other_key,
        _other_schema,
        _other_angle,
        lambda text: "",
        lambda text: "[]",
        lambda text: "[" * 100_000,
        lambda text: text + " " * preshape_cache.MOST_BYTES,
    ],
)
def test_a_damaged_file_is_never_used(searched, tmp_path, damage) -> None:
    hand = clench.Hand.load("robonaut2")
    first = opposition_zones(hand)
    (file,) = files(tmp_path)
    whole = file.read_text()
    file.write_text(damage(whole))
    assert_same(first, opposition_zones(hand))
    assert len(searched) == 2
    assert file.read_text() == whole  # and written anew


def test_joints_that_the_hand_does_not_have_are_not_believed(searched, tmp_path) -> None:
    hand = clench.Hand.load("robonaut2")
    key = cache_key(hand, ("thumb",))
    entry = preshape_cache.Entry({"absent": 0.1}, [[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.05, 0.9]])
    keep_preshapes(key, [entry])
    assert read_preshapes(key, ["absent"]) == [entry]
    assert read_preshapes(key, hand.joint_names) is None


def test_the_key_is_of_the_hand() -> None:
    def hand(length: float, upper: float = 1.5) -> clench.Hand:
        return HandBuilder().finger("a", [along_x(0.006, length)], [length], upper=[upper]).hand()

    keys = [cache_key(hand(0.05), ("a",)), cache_key(hand(0.051), ("a",)), cache_key(hand(0.05), ())]
    assert len({*keys, cache_key(hand(0.05, 1.4), ("a",))}) == 4
    assert cache_key(hand(0.05), ("a",)) == keys[0]


def test_it_can_be_switched_off(searched, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv(preshape_cache.SWITCH, "0")
    hand = clench.Hand.load("robonaut2")
    opposition_zones(hand)
    opposition_zones(hand)
    assert len(searched) == 2
    assert not files(tmp_path)


def test_a_folder_that_cannot_be_written_is_no_error(searched, tmp_path, monkeypatch) -> None:
    (tmp_path / "file").write_text("x")
    monkeypatch.setenv("CLENCH_CACHE_DIR", str(tmp_path / "file"))
    assert opposition_zones(clench.Hand.load("robonaut2"))
    (tmp_path / "cache" / "preshapes").mkdir(parents=True)
    monkeypatch.setenv("CLENCH_CACHE_DIR", str(tmp_path / "cache"))
    key = cache_key(clench.Hand.load("robonaut2"), ())
    (tmp_path / "cache" / "preshapes" / f"{key}.json").mkdir()
    keep_preshapes(key, [])
    assert read_preshapes(key, ()) is None


def test_the_files_go_that_were_not_used_for_longest_and_others_stay(searched, tmp_path) -> None:
    folder = tmp_path / "cache" / "preshapes"
    folder.mkdir(parents=True)
    (folder / "notes.txt").write_text("mine")
    for number in range(MOST_FILES + 3):
        keep_preshapes(f"{number:064x}", [])
        os.utime(folder / f"{number:064x}.json", (number, number))
    oldest = f"{3:064x}"
    assert read_preshapes(oldest, ()) == []
    keep_preshapes("f" * 64, [])
    names = [file.name for file in files(tmp_path)]
    assert len(names) == MOST_FILES + 1
    assert {"notes.txt", f"{'f' * 64}.json", f"{MOST_FILES + 2:064x}.json", f"{oldest}.json"} <= set(names)
    assert not {f"{0:064x}.json", f"{4:064x}.json"} & set(names)
    assert msgspec.json.decode((folder / f"{'f' * 64}.json").read_bytes())["preshapes"] == []
