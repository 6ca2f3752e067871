"""The cache folder is where the environment says; a user without a home folder works without one."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import pytest

from clench.core.caching import kept_arrays
from clench.core.caching.cache_folder import RENEWED_AFTER, cache_folder, note_use
from clench.execution.simulation import convex_pieces
from clench.models.hand import kept_hand
from clench.models.hand.hand import Hand
from clench.models.mesh import TriangleMesh
from clench.solver.preshapes import preshape_cache


@pytest.fixture
def homeless(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take the home folder away, as where HOME is not set and no list of users names this one."""

    def unknown() -> Path:
        raise RuntimeError("Could not determine home directory.")

    for name in ("CLENCH_CACHE_DIR", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    for switch in (kept_hand.SWITCH, kept_arrays.SWITCH, preshape_cache.SWITCH):
        monkeypatch.delenv(switch, raising=False)
    monkeypatch.setattr(Path, "home", unknown)


@pytest.mark.parametrize(
    ("system", "variable", "place"),
    [
        ("linux", None, "home/.cache/clench"),
        ("linux", "XDG_CACHE_HOME", "other/clench"),
        ("darwin", None, "home/Library/Caches/clench"),
        ("win32", None, "home/AppData/Local/clench"),
        ("win32", "LOCALAPPDATA", "other/clench"),
        ("linux", "CLENCH_CACHE_DIR", "other"),
    ],
)
def test_the_environment_names_the_folder(
    homeless: None, monkeypatch: pytest.MonkeyPatch, system: str, variable: str | None, place: str
) -> None:
    monkeypatch.setattr("sys.platform", system)
    if variable:
        monkeypatch.setenv(variable, "other")
    else:
        monkeypatch.setattr(Path, "home", lambda: Path("home"))
    assert cache_folder() == Path(place)


@pytest.mark.parametrize(("age", "renewed"), [(0.9 * RENEWED_AFTER, False), (1.1 * RENEWED_AFTER, True)])
def test_use_renews_the_time_of_a_file_now_and_then(tmp_path: Path, age: float, renewed: bool) -> None:
    file = tmp_path / "file"
    file.touch()
    written = time.time() - age
    os.utime(file, (written, written))
    note_use(file, file.stat().st_mtime)
    assert (file.stat().st_mtime > written + 1.0) == renewed
    note_use(tmp_path / "gone", 0.0)


def test_without_a_home_folder_hands_load_and_nothing_is_kept(homeless: None) -> None:
    assert cache_folder() is None
    assert Hand.load("patent15").fingers == Hand.load("patent15").fingers
    preshape_cache.keep_preshapes("0" * 64, [])
    assert preshape_cache.read_preshapes("0" * 64, ()) is None


def test_without_a_home_folder_a_mesh_is_decomposed_every_time(homeless: None, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    box = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    monkeypatch.setattr(convex_pieces, "decompose", lambda *given: asked.append(given) or (box,))
    for _ in range(2):
        assert convex_pieces.convex_pieces(TriangleMesh(box, [[0, 1, 2]]), "part") == (box,)
    assert len(asked) == 2
