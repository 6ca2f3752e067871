"""Arrays on disk are those that were made; a file that is damaged, or of something else, is never used."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clench.core.caching import kept_arrays
from clench.core.caching.kept_arrays import Arrays, arrays_of

KEY, OTHER = "a" * 64, "b" * 64


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CLENCH_CACHE_DIR", str(tmp_path))
    monkeypatch.delenv(kept_arrays.SWITCH, raising=False)
    return tmp_path / "arrays"


def some_arrays() -> Arrays:
    fixed = np.arange(5, dtype=np.int32)
    fixed.flags.writeable = False
    return [
        np.array([[0.1, -0.0, np.nan], [np.inf, 5e-324, 1.0]]),
        np.asfortranarray(np.arange(6, dtype=np.float32).reshape(2, 3)),
        fixed,
        np.empty((0, 3)),
        np.array([True, False]),
        np.array(2.5),
        np.arange(3, dtype=np.uint8),
    ]


def never() -> Arrays:
    raise AssertionError("the arrays are on disk")


def same(a: np.ndarray[Any, Any], b: np.ndarray[Any, Any]) -> bool:
    def flags(x: np.ndarray[Any, Any]) -> tuple[bool, ...]:
        return x.flags.c_contiguous, x.flags.f_contiguous, x.flags.writeable, x.flags.aligned

    return (a.dtype, a.shape, flags(a), a.tobytes()) == (b.dtype, b.shape, flags(b), b.tobytes())


def test_what_is_read_is_what_was_made(folder: Path) -> None:
    made = arrays_of(KEY, some_arrays)
    read = arrays_of(KEY, never)
    assert all(same(a, b) for a, b in zip(made, read, strict=True))
    read[0][:] = 7.0  # it can be written to, and the file stays
    assert same(arrays_of(KEY, never)[0], made[0])
    assert arrays_of(OTHER, list) == arrays_of(OTHER, never) == []


def test_no_damage_goes_unseen(folder: Path) -> None:
    """Any byte that differs, in the head or in the numbers, counts as a missing file, which is written anew."""
    arrays_of(KEY, some_arrays)
    path = folder / f"{KEY}.arrays"
    whole = path.read_bytes()
    body = whole.index(b"\n") + 1
    damaged = [
        whole[:n] + bytes([whole[n] ^ 1]) + whole[n + 1 :] for n in (*range(0, body, 7), *range(body, len(whole)))
    ]
    damaged += [b"", b"\n", b"{}\n", b"[1]\n", b"[" * 100_000 + b"\n", whole[:-1], whole + b"\0", whole[:body]]
    for content in damaged:
        path.write_bytes(content)
        found = arrays_of(KEY, lambda: [np.array([1.0])])
        assert len(found) == 1 or all(same(a, b) for a, b in zip(found, some_arrays(), strict=True)), content
        if len(found) == 1:
            assert len(arrays_of(KEY, never)) == 1
    path.write_bytes(whole.replace(kept_arrays.SCHEMA.encode(), b"clench.arrays/0"))
    assert len(arrays_of(KEY, lambda: [np.array([1.0])])) == 1
    path.write_bytes(whole)
    (folder / f"{OTHER}.arrays").write_bytes(whole)  # of something else
    assert len(arrays_of(OTHER, lambda: [np.array([1.0])])) == 1


def test_a_head_that_does_not_fit_the_numbers_is_not_used(folder: Path) -> None:
    """A checksum does not tell that a head promises more numbers than follow, or objects."""
    folder.mkdir()
    for rows in ([["<f8", [3], "C", True]], [["|O", [1], "C", True]], [["<f8", [-1], "C", True]], [["<f8", [1], 3, 1]]):
        body = bytearray(80)
        head = kept_arrays._head(KEY, kept_arrays._digest(rows, body), rows)
        (folder / f"{KEY}.arrays").write_bytes(head + bytes(body))
        assert same(arrays_of(KEY, lambda: [np.array([1.0])])[0], np.array([1.0]))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no named pipes")
@pytest.mark.parametrize("put", [os.mkfifo, lambda path: path.symlink_to("/dev/zero")])
def test_a_pipe_or_a_device_in_the_place_of_a_file_is_replaced(folder: Path, put: Callable[[Path], None]) -> None:
    folder.mkdir()
    put(folder / f"{KEY}.arrays")
    found: Arrays = []
    reader = threading.Thread(target=lambda: found.extend(arrays_of(KEY, some_arrays)), daemon=True)
    reader.start()
    reader.join(timeout=20)
    assert found, "it waits for somebody who writes into the pipe"
    assert len(arrays_of(KEY, never)) == len(found)


def test_files_have_bounds(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_arrays, "MOST_FILES", 3)
    names = [f"{n:064x}" for n in range(6)]
    for n, name in enumerate(names):
        arrays_of(name, some_arrays)
        os.utime(folder / f"{name}.arrays", (n, n))
    (folder / "notes.txt").write_text("not ours")
    arrays_of(KEY, some_arrays)
    kept = sorted(path.name for path in folder.iterdir())
    assert kept == [*(f"{name}.arrays" for name in names[4:]), f"{KEY}.arrays", "notes.txt"]
    monkeypatch.setattr(kept_arrays, "MOST_TOGETHER", 1)
    arrays_of(OTHER, some_arrays)
    assert sorted(path.name for path in folder.iterdir()) == [f"{OTHER}.arrays", "notes.txt"]
    monkeypatch.setattr(kept_arrays, "MOST_BYTES", 100)
    arrays_of(names[0], some_arrays)
    assert not (folder / f"{names[0]}.arrays").exists()
    assert len(arrays_of(OTHER, lambda: [np.array([1.0])])) == 1  # a larger file is not read


def test_a_file_in_use_outlasts_files_that_were_written_later(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_arrays, "MOST_FILES", 2)
    for n, name in enumerate((KEY, OTHER)):
        arrays_of(name, some_arrays)
        os.utime(folder / f"{name}.arrays", (n, n))
    arrays_of(KEY, never)
    arrays_of("c" * 64, some_arrays)
    assert sorted(path.stem[0] for path in folder.iterdir()) == ["a", "c"]


def test_without_a_folder_nothing_is_kept(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(kept_arrays.SWITCH, "0")
    arrays_of(KEY, some_arrays)
    assert not folder.exists()
    monkeypatch.delenv(kept_arrays.SWITCH)
    folder.write_text("a file")
    assert len(arrays_of(KEY, some_arrays)) == len(some_arrays())


def test_arrays_that_have_gaps_or_hold_objects_are_not_kept(folder: Path) -> None:
    for array in (np.arange(6)[::2], np.array([None])):
        arrays_of(KEY, lambda array=array: [array])
        assert not folder.exists()


def test_processes_that_write_at_the_same_time_read_whole_files(folder: Path) -> None:
    program = (
        "import numpy as np\n"
        "from clench.core.caching import kept_arrays\n"
        "for n in range(60):\n"
        f"    path = kept_arrays.cache_folder() / 'arrays' / '{KEY}.arrays'\n"
        "    if n % 3 == 0: path.unlink(missing_ok=True)\n"
        f"    found, = kept_arrays.arrays_of('{KEY}', lambda: [np.arange(50_000.0)])\n"
        "    assert np.array_equal(found, np.arange(50_000.0))\n"
    )
    running = [subprocess.Popen([sys.executable, "-c", program]) for _ in range(2)]
    assert [process.wait() for process in running] == [0, 0]
    assert [path.name for path in folder.iterdir()] == [f"{KEY}.arrays"]
