"""Weights, scales and limits come from a small TOML file or a preset; what is wrong is said in one sentence."""

import tomllib

import pytest

from clench.core.exceptions import CommandError, FileError, UnknownNameError
from clench.scoring.calibration import (
    Calibration,
    calibration_of,
    calibration_to_toml,
    load_calibration,
    load_preset,
    preset_names,
)


def write(folder, text):
    path = folder / "calibration.toml"
    path.write_text(text)
    return path


def test_weights_scales_and_limits_of_a_file(tmp_path):
    path = write(
        tmp_path,
        "[weights]\nrange_of_motion = 0.5\ntouching_links = 0\n[scales]\nrange_of_motion = 2\n"
        "[limits]\nlimit_distance = 0.1\n[joints]\nindex_yaw = 3\n",
    )
    calibration = load_calibration(path)
    assert calibration.name == str(path)
    assert calibration.weights == {"range_of_motion": 0.5, "touching_links": 0.0}
    assert calibration.criteria == ("range_of_motion", "limit_distance")
    assert calibration.joints == {"index_yaw": 3.0}
    assert calibration_of(path) == calibration_of(str(path)) == calibration


def test_worth_follows_direction_weight_and_scale():
    c = Calibration(weights={"range_of_motion": 1.0, "touching_links": 2.0}, scales={"range_of_motion": 4.0})
    assert c.worth("range_of_motion", 2.0) == -0.5
    assert c.worth("touching_links", 3.0) == 6.0
    assert c.worth("limit_distance", 3.0) == 0.0


def test_limits_are_the_least_where_more_is_better_and_the_most_where_less_is():
    c = Calibration(limits={"range_of_motion": 1.0, "limit_distance": 0.1})
    assert [c.allows("range_of_motion", v) for v in (0.9, 1.0, 1.1)] == [True, True, False]
    assert [c.allows("limit_distance", v) for v in (0.09, 0.1, 0.2)] == [False, True, True]
    assert not c.allows("limit_distance", None)
    assert c.allows("touching_links", None)


def test_a_command_gives_weights_or_a_preset_or_nothing():
    assert calibration_of(None) is load_preset("balanced")
    assert calibration_of({"limit_distance": 3.0}).weights == {"limit_distance": 3.0}
    assert calibration_of("balanced").name == "balanced"


@pytest.mark.parametrize("name", preset_names())
def test_presets_load_and_say_what_they_are_for(name):
    preset = load_preset(name)
    assert preset.name == name
    assert preset.criteria
    from clench.scoring import calibration

    text = (calibration._PRESETS / f"{name}.toml").read_text()
    assert text.startswith("# ")


def test_presets_that_are_promised_exist():
    assert {"balanced", "steady", "gentle", "quick"} <= set(preset_names())


def test_unknown_presets_are_refused_with_those_that_exist():
    with pytest.raises(UnknownNameError, match=r"Did you mean 'balanced'.*balanced"):
        calibration_of("balancd")


def test_what_is_written_is_read_again(tmp_path):
    first = Calibration(
        "x",
        {"range_of_motion": 1.0 / 3.0, "touching_links": 0.0},
        {"touching_links": 3.0},
        {"limit_distance": 0.05},
        {"odd joint.name": 2.0},
    )
    text = calibration_to_toml(first, {"": "What for.", "weights": "From examples."})
    assert text.startswith("# What for.\n")
    assert "# rad, less is better" in text
    again = load_calibration(write(tmp_path, text))
    assert (again.weights, again.scales, again.limits, again.joints) == (
        first.weights,
        first.scales,
        first.limits,
        first.joints,
    )
    assert tomllib.loads(text)["joints"] == {"odd joint.name": 2.0}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("weights = [", "not a calibration file"),
        ("[weight]\nrange_of_motion = 1\n", r"unknown key 'weight'; expected tables \[weights\], \[scales\]"),
        ("weights = 3\n", r"table \[weights\]"),
        ("[weights]\nrange_of_motion = 'much'\n", "numbers"),
        ("[weights]\nrange_of_motion = true\n", "numbers"),
        ("[weights]\nrange_of_motion = -1\n", r"weights\.range_of_motion.*at least 0"),
        ("[weights]\nrange_of_motion = nan\n", "at least 0"),
        ("[weights]\nrange = 1\n", "range_of_motion"),
        ("[scales]\nrange_of_motion = 0\n", r"scales\.range_of_motion.*above 0"),
        ("[limits]\nrange_of_motion = nan\n", r"limits\.range_of_motion.*a finite number"),
        ("[limits]\nrange_of_motion = inf\n", "a finite number"),
        ("[joints]\nindex_yaw = -1\n", r"joints\.index_yaw.*at least 0"),
        ("[joints]\nindex_yaw = nan\n", r"joints\.index_yaw.*at least 0"),
        ("", r"nothing counts in the choice; expected a weight above 0 in \[weights\], or \[limits\]"),
        ("[weights]\nrange_of_motion = 0\ntouching_links = 0.0\n", "nothing counts"),
        ("[scales]\nrange_of_motion = 2\n[joints]\nindex_yaw = 2\n", "nothing counts"),
    ],
)
def test_malformed_files(tmp_path, text, message):
    path = write(tmp_path, text)
    with pytest.raises(FileError, match=message) as caught:
        load_calibration(path)
    assert "calibration.toml" in str(caught.value)


def test_a_missing_file_and_a_folder(tmp_path):
    with pytest.raises(FileError, match="no such calibration file; presets, by name alone: balanced"):
        load_calibration(tmp_path / "none.toml")
    with pytest.raises(FileError, match="it is a folder, expected a file"):
        load_calibration(tmp_path)


def test_limits_alone_count(tmp_path):
    assert load_calibration(write(tmp_path, "[limits]\nlimit_distance = 0.1\n")).criteria == ("limit_distance",)


@pytest.mark.parametrize("weights", [{}, {"range_of_motion": 0.0}])
def test_weights_of_which_none_counts_are_refused(weights):
    with pytest.raises(CommandError, match="criteria: nothing counts in the choice; expected a weight above 0"):
        calibration_of(weights)


def test_negative_weights_of_a_command_are_refused():
    with pytest.raises(CommandError, match=r"criteria\.limit_distance.*at least 0, got -1"):
        calibration_of({"limit_distance": -1.0})


@pytest.mark.parametrize(("table", "number"), [("weights", "1e308"), ("scales", "1e-320"), ("limits", "-1e300")])
def test_numbers_whose_sums_would_overflow_are_refused(tmp_path, table, number):
    path = tmp_path / "calibration.toml"
    path.write_text(f"[{table}]\nrange_of_motion = {number}\n")
    with pytest.raises(FileError, match=rf"{table}\.range_of_motion: .*, between 1e-12 and 1e\+12 in size"):
        load_calibration(path)
