"""Archives of arrays (.npz): what is claimed is checked before it is unpacked."""

import io
import zipfile

import numpy as np
import pytest

from clench.core.exceptions import FileError
from clench.core.files import array_files
from clench.core.files.array_files import read_arrays

ARRAYS = {"a": np.arange(6.0).reshape(2, 3), "b": np.array([True, False]), "c": np.array("text"), "d": np.array(["x"])}


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_good_archives_are_read(tmp_path, save):
    save(tmp_path / "a.npz", **ARRAYS, e=np.asfortranarray(np.eye(3)[:, :2]), f=np.array(["é", "😀"], dtype=">U3"))
    found = read_arrays(tmp_path / "a.npz", ("a", "b", "c", "e", "f", "absent"))
    assert set(found) == {"a", "b", "c", "e", "f"}
    for name in ("a", "b", "c"):
        np.testing.assert_array_equal(found[name], ARRAYS[name])
    np.testing.assert_array_equal(found["e"], np.eye(3)[:, :2])
    assert found["f"].tolist() == ["é", "😀"]


def test_what_unpacks_to_too_much_is_refused_before(tmp_path, monkeypatch):
    np.savez_compressed(tmp_path / "a.npz", a=np.zeros(10_000), b=np.zeros(10_000))
    monkeypatch.setattr(array_files, "ARRAY_BYTES", 100_000)
    assert read_arrays(tmp_path / "a.npz", ("a",))["a"].size == 10_000
    monkeypatch.setattr(array_files, "_array", lambda *_: pytest.fail("it was unpacked"))
    with pytest.raises(FileError, match=r"a\.npz: is too large: its arrays take 160256 bytes, expected up to 100000"):
        read_arrays(tmp_path / "a.npz", ("a", "b"))


def test_many_names_are_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        for i in range(30_000):
            archive.writestr(str(i), b"")
    with pytest.raises(FileError, match=r"its list of names has \d+ bytes, expected up to 1048576"):
        read_arrays(tmp_path / "a.npz", ("a",))


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.array([{}], dtype=object), "a: expected an array of numbers or text, got one of object"),
        (np.zeros(2, dtype="M8[s]"), "a: expected an array of numbers or text, got one of datetime64"),
        (np.frombuffer(b"\xff" * 8, "<U2"), "a: has text with characters that do not exist"),
        (np.frombuffer(b"\0\xd8\0\0", "<U1"), "a: has text with characters that do not exist"),
    ],
    ids=["objects", "dates", "no character", "half a character"],
)
def test_other_values_are_refused(tmp_path, array, message):
    np.savez(tmp_path / "a.npz", a=array)
    with pytest.raises(FileError, match=message):
        read_arrays(tmp_path / "a.npz", ("a",))


def test_a_long_text_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(array_files, "JSON_BYTES", 1000)
    np.savez(tmp_path / "a.npz", a=np.array("x" * 1001))
    with pytest.raises(FileError, match="a: is too large: a text has 1001 characters"):
        read_arrays(tmp_path / "a.npz", ("a",))


def test_an_array_larger_than_its_entry_is_refused(tmp_path):
    out = io.BytesIO()
    np.lib.format.write_array_header_1_0(out, {"descr": "<f8", "fortran_order": False, "shape": (1 << 40,)})
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("a.npy", out.getvalue())
    with pytest.raises(
        FileError, match=r"a: its array of shape \(1099511627776,\) takes \d+ bytes, but the file has 0"
    ):
        read_arrays(tmp_path / "a.npz", ("a",))
