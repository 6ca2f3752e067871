"""Targets of long work are checked before it, and files get the permissions that the system gives."""

import os
import stat

import pytest

from clench.core.exceptions import FileError
from clench.core.files.json_files import check_folder, check_writable, write_atomically


def test_a_file_that_can_be_written_leaves_nothing_behind(tmp_path):
    (tmp_path / "old").write_bytes(b"old")
    check_writable(tmp_path / "new")
    check_writable(tmp_path / "old")
    assert [path.name for path in tmp_path.iterdir()] == ["old"]
    assert (tmp_path / "old").read_bytes() == b"old"


def test_files_that_cannot_be_written(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "file").touch()
    for path, problem in (
        (tmp_path, "it is a folder"),
        (tmp_path / "pipe", "it is a pipe or a device"),
        (tmp_path / "none" / "a", "no folder"),
        (tmp_path / "file" / "a", "no folder"),
        (tmp_path / ("x" * 250), "File name too long"),
        ("a\0b", "is no path of a file"),
        ("", "is no path of a file|it is a folder"),
    ):
        with pytest.raises(FileError, match=problem):
            check_writable(path)


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="no /proc, a folder that refuses files even to root")
def test_a_folder_that_refuses_files():
    with pytest.raises(FileError, match="/proc/a: cannot be written"):
        check_writable("/proc/a")
    with pytest.raises(FileError, match="/proc/a/b: cannot be written to"):
        check_folder("/proc/a/b")


def test_folders_are_checked_and_not_made(tmp_path):
    check_folder(tmp_path / "a" / "b")
    check_folder(tmp_path)
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").touch()
    for path in (tmp_path / "file", tmp_path / "file" / "a" / "b"):
        with pytest.raises(FileError, match=r"cannot be made a folder \('.*file' is a file\)"):
            check_folder(path)
    with pytest.raises(FileError, match="is no path of a folder"):
        check_folder("a\0b")


def test_permissions_come_from_the_umask_which_is_left_alone(tmp_path, monkeypatch):
    """To ask for the umask sets it for a moment: files that another thread makes then are open to all."""
    before = os.umask(0o027)
    try:
        with monkeypatch.context() as patch:
            patch.setattr(os, "umask", lambda mask: pytest.fail("the umask was changed"))
            write_atomically(tmp_path / "a", b"content")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == 0o640
    assert (tmp_path / "a").read_bytes() == b"content"
    assert len(list(tmp_path.iterdir())) == 1


def test_a_file_that_cannot_be_replaced_leaves_nothing_behind(tmp_path):
    (tmp_path / "folder").mkdir()
    with pytest.raises(FileError, match="folder: cannot be written"):
        write_atomically(tmp_path / "folder", b"content")
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]
