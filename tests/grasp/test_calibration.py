"""Weights come from a small TOML file; what is wrong with it is said in one sentence."""

import pytest

from clench.base.errors import FileError, UnknownNameError
from clench.grasp.calibration import load_calibration, weights_of
from clench.grasp.criteria import DEFAULT_WEIGHTS


def write(folder, text):
    path = folder / "calibration.toml"
    path.write_text(text)
    return path


def test_weights_of_a_file(tmp_path):
    path = write(tmp_path, "[weights]\nrange_of_motion = 0.5\ntouching_links = 2\n")
    assert load_calibration(path) == {"range_of_motion": 0.5, "touching_links": 2.0}
    assert weights_of(path) == load_calibration(path)


def test_weights_of_a_command(tmp_path):
    assert weights_of(None) == dict(DEFAULT_WEIGHTS)
    assert weights_of({"limit_distance": 3.0}) == {"limit_distance": 3.0}
    assert load_calibration(write(tmp_path, "")) == {}
    with pytest.raises(UnknownNameError, match="limit_distance"):
        weights_of({"limit": 3.0})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("weights = [", "not a calibration file"),
        ("[weight]\nrange_of_motion = 1\n", "unknown key 'weight'"),
        ("weights = 3\n", r"table \[weights\]"),
        ("[weights]\nrange_of_motion = 'much'\n", "numbers"),
        ("[weights]\nrange_of_motion = true\n", "numbers"),
        ("[weights]\nrange_of_motion = -1\n", "at least 0"),
        ("[weights]\nrange_of_motion = nan\n", "at least 0"),
        ("[weights]\nrange = 1\n", "range_of_motion"),
    ],
)
def test_malformed_files(tmp_path, text, message):
    path = write(tmp_path, text)
    with pytest.raises(FileError, match=message) as caught:
        load_calibration(path)
    assert "calibration.toml" in str(caught.value)


def test_a_missing_file_and_a_folder(tmp_path):
    with pytest.raises(FileError, match="no such calibration file"):
        load_calibration(tmp_path / "none.toml")
    with pytest.raises(FileError, match="not a calibration file"):
        load_calibration(tmp_path)
