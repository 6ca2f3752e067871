"""Pickled dictionaries of arrays: what is plain is read to the bit, and everything else is refused or left out."""

import io
import pickle

import numpy as np
import pytest

from clench.core.exceptions import FileError
from clench.execution.formats.inert_pickle import NotNumbers, read_pickled_arrays
from hostile.data import Forged, forged_dtype, pickled


def saved(values, protocol=None) -> bytes:
    content = io.BytesIO()
    np.save(content, np.array(values, dtype=object), allow_pickle=True)
    data = content.getvalue()
    if protocol is None:
        return data
    return data[: data.index(b"\n") + 1] + pickle.dumps(np.array(values, dtype=object), protocol=protocol)


@pytest.mark.parametrize("kind", ["<f8", ">f8", "<f4", "<f2", "<i8", ">i2", "|u1", "|b1"])
@pytest.mark.parametrize("protocol", [None, 3, 4, 5])
def test_plain_numbers_come_back_to_the_bit(kind, protocol):
    rows = np.arange(6.0).reshape(2, 3).astype(kind)
    values = {
        "c": rows,
        "fortran": np.asfortranarray(rows),
        "one": rows[1, 2],
        "none": rows[:0],
        "zero": rows[0, 0:1][0],
    }
    read = read_pickled_arrays(saved(values, protocol), "x")
    assert list(read) == list(values)
    for key, value in values.items():
        np.testing.assert_array_equal(read[key], value)
        assert read[key].dtype.newbyteorder("=") == value.dtype.newbyteorder("=")


def test_lists_text_and_numbers():
    values = {"names": ["a", "b"], "path": "x/y", "scale": 0.5, "inside": {"k": (1, None, True)}}
    assert read_pickled_arrays(saved(values), "x") == {**values, "inside": {"k": [1, None, True]}}


@pytest.mark.parametrize("array", [np.array(["a"]), np.zeros(2, "V8"), np.zeros(2, "M8[s]"), np.ones(2, complex)])
def test_other_arrays_are_not_read(array):
    assert isinstance(read_pickled_arrays(saved({"x": array}), "x")["x"], NotNumbers)


def test_arrays_of_objects_become_lists():
    read = read_pickled_arrays(saved({"x": np.array(["a", 1.0, None], dtype=object)}), "x")
    assert read == {"x": ["a", 1.0, None]}


def test_a_forged_type_makes_nothing():
    assert isinstance(read_pickled_arrays(forged_dtype(), "x")["grasp_qpos"], NotNumbers)


@pytest.mark.parametrize(
    ("body", "sentence"),
    [
        (pickle.dumps({"a": Forged(eval, "1")}), "asks for 'builtins.eval'"),
        (pickle.dumps({"a": Forged(np.ndarray, (3,))}), "calls 'numpy.ndarray'"),
        (pickle.dumps({"a": io.BytesIO()}), "asks for '_io.BytesIO'"),
        (b"(i__main__\nx\n.", "makes objects"),
        (b"cnumpy\nndarray\n)\x81.", "makes objects"),
        (b"cnumpy\nndarray\n}X\x01\x00\x00\x00aK\x01sb.", "makes objects"),
        (b"Pid\n.", "makes objects"),
        (b"\x82\x01.", "makes objects"),
    ],
)
def test_everything_else_is_refused(body, sentence):
    with pytest.raises(FileError, match=sentence):
        read_pickled_arrays(pickled(body), "x")


def test_stand_ins_stay_as_they_are():
    """A pickle that gives a state to what is no array would change the reader for the files after it."""
    with pytest.raises(FileError, match="makes objects"):
        read_pickled_arrays(pickled(b"cnumpy\ndtype\n}(X\x04\x00\x00\x00codeX\x01\x00\x00\x00xub."), "x")
    np.testing.assert_array_equal(read_pickled_arrays(saved({"x": np.arange(3.0)}), "x")["x"], [0.0, 1.0, 2.0])
