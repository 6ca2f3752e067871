"""Hands by name: from local copies of what the packages fetch, and with a sentence where nothing can be fetched."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

from clench.core.exceptions import FileError, HandError, UnknownNameError
from clench.models.hand.hand import Hand
from clench.models.hand.reading import named
from models.hand.hand_models import three_fingers, urdf_hand


@pytest.fixture
def menagerie(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a checkout of the Menagerie with two entries of one hand."""
    folder = tmp_path / "menagerie" / "shadow_hand"
    folder.mkdir(parents=True)
    for side in ("left", "right"):
        (folder / f"{side}_hand.xml").write_text(three_fingers().replace("test hand", f"{side} hand"))
    monkeypatch.setenv("MENAGERIE_ROOT", str(folder.parent))
    return folder.parent


@pytest.fixture
def descriptions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a cache of robot_descriptions in which a small hand stands for the Allegro hand, as a git repository."""
    work = tmp_path / "work"
    folder = work / "manipulation" / "models" / "allegro_hand_description" / "urdf"
    folder.mkdir(parents=True)
    for side in ("left", "right"):
        (folder / f"allegro_hand_description_{side}.urdf").write_text(urdf_hand().replace('"two"', f'"{side}"'))
    who = ["-c", "user.name=test", "-c", "user.email=test@example.com"]
    for command in (["init", "-q"], ["add", "."], [*who, "commit", "-q", "-m", "hand"]):
        subprocess.run(["git", "-C", str(work), *command], check=True)
    commit = subprocess.check_output(["git", "-C", str(work), "rev-parse", "HEAD"], text=True).strip()
    cache = tmp_path / "cache"
    (cache / f"drake-{commit}").mkdir(parents=True)
    work.rename(cache / f"drake-{commit}" / "drake")
    monkeypatch.setenv("ROBOT_DESCRIPTIONS_CACHE", str(cache))
    monkeypatch.setenv("ROBOT_DESCRIPTION_COMMIT", commit)
    monkeypatch.delitem(sys.modules, "robot_descriptions.allegro_hand_description", raising=False)
    return cache


@pytest.fixture
def offline(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave both packages with empty caches and sources that are not there."""
    import mujoco_menagerie._cache as cache
    import robot_descriptions._cache as clones

    monkeypatch.delenv("MENAGERIE_ROOT", raising=False)
    monkeypatch.setenv("MENAGERIE_CACHE_DIR", str(tmp_path / "empty"))
    monkeypatch.setenv("MENAGERIE_BASE_URL", "file:///nowhere")
    monkeypatch.setattr(cache.time, "sleep", lambda seconds: None)
    monkeypatch.setenv("ROBOT_DESCRIPTIONS_CACHE", str(tmp_path / "no_clones"))

    def no_network(*arguments: object, **options: object) -> None:
        print("Cloning ...")
        raise clones.GitCommandError("git fetch", 128, b"Could not resolve host")

    monkeypatch.setattr(clones, "clone_to_directory", no_network)
    monkeypatch.delitem(sys.modules, "robot_descriptions.barrett_hand_description", raising=False)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("shadow_hand", "left hand"),
        ("shadow_hand/right_hand", "right hand"),
        ("mujoco_menagerie:shadow_hand/right_hand", "right hand"),
    ],
)
def test_a_hand_of_the_menagerie(menagerie: Path, name: str, expected: str) -> None:
    hand = Hand.load(name)
    assert hand.name == expected
    assert hand.path is not None
    assert menagerie in hand.path.parents


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("allegro_hand_description", "left"),
        ("allegro_hand_description/right", "right"),
        ("robot_descriptions:allegro_hand_description/right", "right"),
    ],
)
def test_a_hand_of_robot_descriptions(descriptions: Path, capsys, name: str, expected: str) -> None:
    hand = Hand.load(name)
    assert hand.name == expected
    assert hand.path is not None
    assert descriptions in hand.path.parents
    assert capsys.readouterr().out == ""


def test_a_file_of_the_same_name_comes_first(menagerie: Path, tmp_path, monkeypatch) -> None:
    (tmp_path / "shadow_hand").write_text("x")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FileError, match="expected a hand model"):
        Hand.load("shadow_hand")


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        (
            "shadow_hand/rigt_hand",
            r"Model 'rigt_hand' is not in 'shadow_hand' of mujoco_menagerie\. Did you mean 'right",
        ),
        ("mujoco_menagerie:shadow", r"Hand 'shadow' is not in the package mujoco_menagerie\..*Hands: .*shadow_hand"),
        ("robot_descriptions:alegro_hand_description", r"Did you mean 'allegro_hand_mj_description'\?"),
        ("shadw_hand", r"Did you mean 'shadow_hand'\? Hands: patent15, robonaut2, .*allegro_hand_mj_description"),
        # Grippers that clench refuses are in both packages, and are not suggested.
        ("robotiq_2f86", r"no such file exists\. Hands: (?!.*(robotiq|umi_gripper))"),
        ("allegro_hand_description/both", r"Model 'both' is not in .* Models: left, right"),
    ],
)
def test_names_that_do_not_exist(menagerie: Path, descriptions: Path, name: str, sentence: str) -> None:
    with pytest.raises(UnknownNameError, match=sentence):
        Hand.load(name)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("leap_hand", r"Hand 'leap_hand': its files are not here and cannot be fetched \(.*\)\. .*MENAGERIE_ROOT"),
        ("barrett_hand_description", r"cannot be fetched \(.*Could not resolve host.*ROBOT_DESCRIPTIONS_CACHE"),
    ],
)
def test_no_network(offline: None, capsys, name: str, sentence: str) -> None:
    with pytest.raises(HandError, match=sentence) as error:
        Hand.load(name)
    assert "\n" not in str(error.value)
    assert capsys.readouterr().out == ""


def test_packages_that_are_not_installed(monkeypatch) -> None:
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name in (named.MENAGERIE, named.DESCRIPTIONS) else find(name)
    )
    for package in (named.MENAGERIE, named.DESCRIPTIONS):
        monkeypatch.delitem(sys.modules, package, raising=False)
    with pytest.raises(HandError, match=r"mujoco_menagerie is not installed; .*pip install 'clench\[hands\]'"):
        Hand.load("mujoco_menagerie:shadow_hand")
    with pytest.raises(
        UnknownNameError,
        match=r"more hands by name need pip install 'clench\[hands\]' \(in a checkout: uv .*\)\. Hands: pat",
    ):
        Hand.load("shadow_hand")


@pytest.mark.shared
def test_every_suggested_hand_loads(shared_data: Path, tmp_path, monkeypatch) -> None:
    # Both packages take these hands from the Menagerie; a clone of it stands in both caches.
    clone = tmp_path / "mujoco_menagerie"
    clone.mkdir()
    for robot in ("shadow_hand", "wonik_allegro"):
        (clone / robot).symlink_to(shared_data / "hands" / f"{robot}_mjcf")
    monkeypatch.setenv("MENAGERIE_ROOT", str(clone))
    monkeypatch.setattr("robot_descriptions._cache.clone_to_cache", lambda *arguments, **options: str(clone))
    suggested = named.known_names()
    assert set(suggested) == named._LOADING
    for name in suggested:
        monkeypatch.delitem(sys.modules, f"robot_descriptions.{name}", raising=False)
        assert len(Hand.load(name).fingers) in (4, 5)


@pytest.mark.shared
@pytest.mark.parametrize("name", ["shadow_hand/right_hand", "wonik_allegro/right_hand"])
def test_real_hands_of_the_menagerie_from_a_local_copy(shared_data: Path, tmp_path, monkeypatch, name: str) -> None:
    robot = name.split("/")[0]
    (tmp_path / robot).symlink_to(shared_data / "hands" / f"{robot}_mjcf")
    monkeypatch.setenv("MENAGERIE_ROOT", str(tmp_path))
    assert len(Hand.load(name).fingers) == (5 if robot == "shadow_hand" else 4)
