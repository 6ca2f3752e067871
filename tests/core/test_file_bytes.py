"""Files that cannot be read, each with its sentence; none is waited for."""

import os

import pytest

from clench.core.exceptions import FileError
from clench.core.files.file_bytes import read_file, read_text


def test_bytes_and_text(tmp_path):
    path = tmp_path / "a.txt"
    path.write_bytes(b"\xef\xbb\xbfone")
    assert read_file(path, 100) == b"\xef\xbb\xbfone"
    assert read_text(path, 100) == "one"


def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(FileError, match="pipe: cannot be read: it is a pipe or a device, expected a file"):
        read_file(tmp_path / "pipe", 100)


def test_what_is_no_file(tmp_path):
    (tmp_path / "loop").symlink_to("loop")
    for path, problem in (
        (tmp_path, "cannot be read: it is a folder, expected a file"),
        (tmp_path / "none", "no such file"),
        (tmp_path / "loop", "cannot be read"),
        (tmp_path / ("x" * 300), "cannot be read"),
        ("a\0b", "is no path of a file"),
    ):
        with pytest.raises(FileError, match=problem):
            read_file(path, 100)


def test_text_of_another_encoding(tmp_path):
    (tmp_path / "a").write_bytes("x = 1".encode("utf-16"))
    with pytest.raises(FileError, match=r"not text in UTF-8 \(invalid start byte at byte 0\)"):
        read_text(tmp_path / "a", 100)
