"""A hand from disk is the one that was made, to the bit; one that is damaged, or of other files, is never used."""

from __future__ import annotations

import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clench.core.caching import kept_arrays
from clench.core.caching.plain_values import as_arrays
from clench.core.exceptions import ClenchError, HandError, UnknownNameError
from clench.models.hand import hand_making, kept_hand
from clench.models.hand.hand import Hand
from models.hand.hand_models import urdf_hand, written

TETRAHEDRON = "v 0 0 0\nv 0.01 0 0\nv 0 0.01 0\nv 0 0 0.02\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CLENCH_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.delenv(kept_hand.SWITCH, raising=False)
    monkeypatch.delenv(kept_arrays.SWITCH, raising=False)
    return tmp_path / "cache" / "arrays"


@pytest.fixture
def makings(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the names of the hands that are made from now on."""
    names: list[str] = []
    make = hand_making.make_hand

    def noted(text: Any, *rest: Any) -> Hand:
        names.append(text.name)
        return make(text, *rest)

    monkeypatch.setattr(hand_making, "make_hand", noted)
    return names


def bits(hand: Hand) -> list[tuple[object, ...]]:
    """Return everything that a hand has but its files: its parts, which of them are shared, and the bits of arrays."""
    arrays = as_arrays(replace(hand, path=None, assets={}), kept_hand.CLASSES)
    flags = [(a.flags.c_contiguous, a.flags.f_contiguous, a.flags.writeable, a.flags.aligned) for a in arrays]
    return [(a.dtype.str, a.shape, f, a.tobytes()) for a, f in zip(arrays, flags, strict=True)]


def mesh_hand(folder: Path, corner: str = "0.02") -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "tip.obj").write_text(TETRAHEDRON.replace("0.02", corner))
    return written(folder, urdf_hand(geometry='<mesh filename="tip.obj"/>'), "two.urdf")


@pytest.mark.parametrize("name", ["robonaut2", "patent15"])
def test_a_built_in_hand_is_the_same_from_disk(folder, makings, monkeypatch, name: str) -> None:
    monkeypatch.setenv(kept_hand.SWITCH, "0")
    plain = Hand.load(name)
    assert not folder.exists()
    monkeypatch.delenv(kept_hand.SWITCH)
    first, second = Hand.load(name), Hand.load(name)
    assert makings == [name, name]
    assert len(list(folder.iterdir())) == 1
    assert bits(first) == bits(second) == bits(plain)
    assert (second.path, second.assets) == (plain.path, plain.assets)
    assert {type(joint.role) for joint in second.joints} == {type(plain.joints[0].role)}


def test_a_hand_of_meshes_is_the_same_from_disk(folder, makings, tmp_path) -> None:
    path = mesh_hand(tmp_path / "hand")
    first, second = Hand.load(path), Hand.load(path)
    assert len(makings) == 1
    assert bits(first) == bits(second)
    assert (second.path, second.assets) == (path, first.assets)
    assert second.assets


@pytest.mark.shared
@pytest.mark.parametrize(
    "path",
    [
        *(
            "wonik_allegro_mjcf/right_hand.xml",
            "shadow_hand_mjcf/right_hand.xml",
            "leap_hand_urdf/leap_hand_right.urdf",
        ),
        *("orca_v1_mjcf/orcahand_right.mjcf", "wuji_hand/mjcf/right.xml", "barrett_hand_urdf/bhand_model.urdf"),
    ],
)
def test_hands_of_makers_are_the_same_from_disk(folder, makings, shared_data, path: str) -> None:
    first, second = (Hand.load(shared_data / "hands" / path) for _ in range(2))
    assert len(makings) == 1
    assert bits(first) == bits(second)


def test_whatever_changes_a_hand_changes_its_key(folder, makings, tmp_path, monkeypatch) -> None:
    path = mesh_hand(tmp_path / "hand")
    changes: list[Callable[[], Hand]] = [
        lambda: Hand.load(path),
        lambda: Hand.load(mesh_hand(tmp_path / "hand", "0.021")),
        lambda: Hand.load(mesh_hand(tmp_path / "elsewhere", "0.021")),
        lambda: Hand.load(path, collision_source="visual"),
        lambda: Hand.load(path, palm="palm"),
    ]
    for count, load in enumerate(changes, start=1):
        load()
        load()
        assert len(makings) == len(list(folder.iterdir())) == count
    (tmp_path / "hand" / "two.hand.toml").write_text("[links.palm]\nfriction = 0.5\n")
    assert Hand.load(path).links[0].friction == 0.5
    (tmp_path / "hand" / "two.hand.toml").write_text("[links.palm]\nfriction = 0.6\n")
    assert Hand.load(path).links[0].friction == 0.6
    for name in ("one.toml", "two.toml"):  # of equal content, but messages name the file
        (tmp_path / name).write_text("[links.palm]\nfriction = 0.7\n")
        Hand.load(path, hand_file=tmp_path / name)
    monkeypatch.setattr(kept_hand, "_made_by", lambda: "other sources, versions or another processor")
    Hand.load(path)
    assert len(makings) == len(changes) + 5


def test_sources_and_versions_are_part_of_the_key(monkeypatch) -> None:
    made_by = kept_hand._made_by.__wrapped__
    before = made_by()
    assert made_by() == before
    read_bytes = Path.read_bytes
    for name in ("hand_making.py", "fingers.py", "pose.py", "plain_values.py"):
        with monkeypatch.context() as patched:
            patched.setattr(Path, "read_bytes", lambda p, n=name: read_bytes(p) + b"#" * (p.name == n))
            assert made_by() != before, name
    for owner, name, other in (
        (sys, "version", "0.0"),
        (kept_hand, "_files_of", lambda package: []),
        (kept_hand, "number_code", lambda: "another processor"),
    ):
        with monkeypatch.context() as patched:
            patched.setattr(owner, name, other)
            assert made_by() != before, name


def test_a_damaged_file_is_made_anew(folder, makings) -> None:
    sound = bits(Hand.load("patent15"))
    (file,) = folder.iterdir()
    content = file.read_bytes()
    for damaged in (b"", content[:-1], content[:200], content[:-9] + b"x" + content[-8:]):
        file.write_bytes(damaged)
        assert bits(Hand.load("patent15")) == sound
        assert file.read_bytes() == content
    assert len(makings) == 5


def test_a_sound_file_of_something_else_is_not_used(folder, makings, monkeypatch) -> None:
    sound = bits(Hand.load("patent15"))
    (file,) = folder.iterdir()
    deep = np.frombuffer(b"\x92\x01" * 100_000 + b"\x90", np.uint8)
    for other in ([], [np.zeros(3, np.uint8)], as_arrays((1, 2), {}), [np.arange(4.0)], [deep]):
        file.unlink()
        kept_arrays.arrays_of(file.stem, lambda other=other: other)
        assert bits(Hand.load("patent15")) == sound
    assert len(makings) == 6


def test_a_hand_that_cannot_be_written_is_made_every_time(folder, monkeypatch) -> None:
    made = Hand.load("patent15")
    shutil.rmtree(folder)
    for odd in (replace(made, name="\udcff"), replace(made, fingers=[*made.fingers, 1j])):
        monkeypatch.setattr(hand_making, "make_hand", lambda *rest, odd=odd: odd)
        assert [Hand.load("patent15") is odd for _ in range(3)] == [True] * 3
        shutil.rmtree(folder)


@pytest.mark.parametrize("action", ["always", "ignore"])
def test_a_hand_that_is_warned_of_is_made_every_time(folder, makings, monkeypatch, action: str) -> None:
    make = hand_making.make_hand

    def warned(*arguments: Any) -> Hand:
        warnings.warn("its inertia is odd", stacklevel=1)
        return make(*arguments)

    monkeypatch.setattr(hand_making, "make_hand", warned)
    for _ in range(2):
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter(action)
            Hand.load("patent15")
        assert [str(each.message) for each in said] == ["its inertia is odd"] * (action == "always")
    assert len(makings) == 2


def test_a_warning_before_an_error_is_passed_on(folder, monkeypatch) -> None:
    def failing(*arguments: Any) -> Hand:
        warnings.warn("its inertia is odd", stacklevel=1)
        raise HandError("no hand")

    monkeypatch.setattr(hand_making, "make_hand", failing)
    with pytest.warns(UserWarning, match="inertia"), pytest.raises(HandError, match="no hand"):
        Hand.load("patent15")


def test_a_palm_of_the_name_none_is_not_the_palm_that_nobody_named(folder) -> None:
    Hand.load("patent15")
    with pytest.raises(UnknownNameError, match="None"):
        Hand.load("patent15", palm="None")


def test_an_error_is_the_same_every_time_and_leaves_nothing(folder) -> None:
    said = set()
    for _ in range(2):
        with pytest.raises(ClenchError) as error:
            Hand.load("patent15", palm="nowhere")
        said.add(str(error.value))
    assert len(said) == 1
    assert not folder.exists()


def test_a_hand_from_disk_loads_neither_mujoco_nor_what_understands_models(folder) -> None:
    program = (
        "import sys, clench; clench.Hand.load('robonaut2'); "
        "print([n for n in ('mujoco', 'numba', 'scipy.spatial', 'clench.models.hand.hand_making') if n in sys.modules])"
    )
    said = [
        subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    ]
    assert said == ["['mujoco', 'clench.models.hand.hand_making']\n", "[]\n"]
