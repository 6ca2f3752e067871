"""Readers of data: what is good is read, what is close to a limit as well, and what is beyond is refused."""

import json

import numpy as np
import pytest

from clench.core.exceptions import FileError
from clench.core.files.array_files import read_array
from clench.core.files.file_limits import DOCUMENT_DEPTH
from clench.core.files.json_files import non_finite_path, read_json
from clench.core.files.nesting import is_too_deep
from clench.core.files.toml_files import read_toml
from clench.core.files.yaml_files import read_yaml
from clench.core.numbers import real_array


def nested(depth):
    value = 1.0
    for _ in range(depth):
        value = [value]
    return value


def test_depth():
    assert not is_too_deep(nested(DOCUMENT_DEPTH))
    assert is_too_deep(nested(DOCUMENT_DEPTH + 1))
    assert is_too_deep({"a": nested(DOCUMENT_DEPTH)})
    assert not is_too_deep(3.0)


def test_json(tmp_path):
    path = tmp_path / "a.json"
    path.write_text(json.dumps(nested(DOCUMENT_DEPTH)))
    assert read_json(path) == nested(DOCUMENT_DEPTH)
    path.write_text(json.dumps(nested(DOCUMENT_DEPTH + 1)))
    with pytest.raises(FileError, match=r"a\.json: not JSON that can be read: it has more than 64 lists"):
        read_json(path)


def test_path_of_the_first_number_that_is_none():
    value = {"a": [1.0, {"b": float("nan")}], "c": float("inf")}
    assert non_finite_path(value) == "a[1].b"
    assert non_finite_path({"a": [1.0, "nan", None]}) is None
    assert non_finite_path(nested(100_000)) is None


def test_toml(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text('a.b."c.d" = [0.1, 0.2]\n' + "x = [" + "0.5, " * 1000 + "]\n")
    assert read_toml(path)["a"] == {"b": {"c.d": [0.1, 0.2]}}
    path.write_text(".".join(["a"] * (DOCUMENT_DEPTH + 2)) + " = 1")
    with pytest.raises(FileError, match="a key has more than 64 parts"):
        read_toml(path)


def test_yaml_with_aliases(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("a: &x {p: 1, q: [2, 3]}\nb: *x\nc: {<<: *x, p: 4}\n")
    assert read_yaml(path) == {"a": {"p": 1, "q": [2, 3]}, "b": {"p": 1, "q": [2, 3]}, "c": {"p": 4, "q": [2, 3]}}
    path.write_text("")
    assert read_yaml(path) is None


@pytest.mark.parametrize("order", ["C", "F"])
def test_arrays(tmp_path, order):
    rows = np.array(np.arange(14.0).reshape(2, 7), order=order)
    np.save(tmp_path / "a.npy", rows)
    np.testing.assert_array_equal(read_array(tmp_path / "a.npy"), rows)


def test_real_numbers():
    assert real_array([1, 2.5]).tolist() == [1.0, 2.5]
    for other in (["1"], [True], [1j], [None], [[1], [1, 2]], "1", np.zeros(2, "M8[s]"), [10**400]):
        assert real_array(other) is None
