"""What a dataset is to hold, and which run does what: options, job files, shards, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from clench.apps.cli.commands import export_import as exchange
from clench.apps.cli.commands import generate
from clench.apps.cli.main import main
from clench.core.exceptions import CommandError, UnknownNameError
from clench.dataset.access.exporting import DatasetFormat
from clench.dataset.jobs.job import DatasetJob, job_from, read_job
from clench.dataset.jobs.shards import Shard
from clench.dataset.jobs.units import Unit
from clench.execution.formats.exchange import GraspFormat
from clench.planner.options import GraspKind

JOB = DatasetJob(hands=("robonaut2",), objects=("mug", "ball"), scales=(1.0, 0.5), count=120, unit=50)


def test_units_part_the_grasps_and_have_keys_and_seeds_of_their_own() -> None:
    units = list(JOB.units())
    assert [unit.count for unit in units] == [50, 50, 20] * 4
    assert len({unit.key for unit in units}) == len({unit.seed for unit in units}) == 12
    assert units[0].in_words() == "'robonaut2' on 'mug', part 1"
    assert units[3].in_words() == "'robonaut2' on 'mug' at scale 0.5, part 1"


def test_a_unit_depends_on_nothing_but_itself() -> None:
    more = DatasetJob(**(JOB.document() | {"hands": ("patent15", "robonaut2"), "objects": ("ball",)}))
    assert {unit.key for unit in more.units() if unit.hand == "robonaut2"} < {unit.key for unit in JOB.units()}
    # Kept files name units by these: they must never change.
    unit = Unit(0, "robonaut2", "mug", 1.0, 0, 50)
    assert (unit.key, unit.seed) == ("9290c2ddca0ba266c49cf67b", 301137795041070302)


def test_the_hash_of_a_job_tells_options_apart() -> None:
    others = [{"seed": 1}, {"hold": True}, {"friction": 0.3}, {"objects": ("ball", "mug")}, {"effort": 10}]
    hashes = {DatasetJob(**(JOB.document() | other)).hash for other in others}
    assert len(hashes | {JOB.hash}) == 6
    assert job_from(json.loads(json.dumps(JOB.document())), "again").hash == JOB.hash


@pytest.mark.parametrize("name", ["job.toml", "job.json"])
def test_a_job_file_has_the_keys_of_the_job(tmp_path: Path, name: str) -> None:
    text = (
        'hands = ["robonaut2"]\nobjects = ["mug"]\nfriction = [0.3, 0.6]\nmass = 1\nkinds = ["pinch"]\npath = false\n'
    )
    if name.endswith("json"):
        import tomllib

        text = json.dumps(tomllib.loads(text))
    (tmp_path / name).write_text(text)
    job = job_from(read_job(tmp_path / name), name)
    assert (job.friction, job.mass, job.kinds, job.path, job.count) == ((0.3, 0.6), 1.0, ("pinch",), False, 100)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"hand": ["robonaut2"]}, "Key 'hand' is not in job. Did you mean 'hands'?"),
        ({"hands": []}, "hands: expected at least one hand, got none"),
        ({"hands": "robonaut2"}, "hands: expected `array`, got `str`"),
        ({"objects": ["mug", "mug"]}, "objects: 'mug' is named twice"),
        ({"scales": [1.0, -1.0]}, "scales: expected finite numbers above 0"),
        ({"count": 0}, "count: expected a whole number of at least 1"),
        ({"count": 1.5}, "count: expected `int`, got `float`"),
        ({"unit": 5000}, "unit: expected a whole number from 1 to 1000"),
        ({"seed": -1}, "seed: expected a whole number of at least 0"),
        ({"friction": [0.6, 0.3]}, "friction"),
        ({"kinds": ["hook"]}, "kinds: expected some of pinch, tripod, precision, power"),
        ({"count": 10**9, "unit": 1}, "unit: the job has more than"),
    ],
)
def test_bad_values_get_a_sentence(values: dict, said: str) -> None:
    with pytest.raises((CommandError, UnknownNameError)) as raised:
        job_from({"hands": ["robonaut2"], "objects": ["mug"]} | values, "job")
    assert said in str(raised.value)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"hands": "robonaut2"}, "hands: expected a list, got 'robonaut2'"),
        ({"scales": 1.0}, "scales: expected a list, got 1.0"),
        ({"objects": [1]}, "objects: expected a list of text"),
        ({"scales": ["1"]}, "scales: expected a list of numbers"),
        ({"unit": 2.5}, "unit: expected a whole number"),
    ],
)
def test_bad_values_from_python_get_a_sentence_too(values: dict, said: str) -> None:
    with pytest.raises(CommandError) as raised:
        DatasetJob(**({"hands": ["robonaut2"], "objects": ["mug"]} | values))
    assert said in str(raised.value)
    assert (
        DatasetJob(hands=["robonaut2"], objects=["mug"]).hash == DatasetJob(hands=("robonaut2",), objects=("mug",)).hash
    )


def test_whole_numbers_are_numbers() -> None:
    whole, same = (DatasetJob(hands=["patent15"], objects=["mug"], scales=[x], mass=x) for x in (1, 1.0))
    assert whole.hash == same.hash == job_from(json.loads(json.dumps(whole.document())), "again").hash
    assert [unit.key for unit in whole.units()] == [unit.key for unit in same.units()]


def test_every_unit_is_in_exactly_one_shard() -> None:
    for of in (1, 2, 5):
        found = [sum(Shard(i + 1, of).has(unit) for i in range(of)) for unit in JOB.units()]
        assert found == [1] * 12


@pytest.mark.parametrize("text", ["3/2", "0/2", "1", "a/b", "1/2/3", "-1/2", "٣/٤"])
def test_what_is_no_shard_is_refused(text: str) -> None:
    with pytest.raises(CommandError, match="expected i/n with i from 1 to n"):
        Shard.parse(text)


@pytest.mark.parametrize(
    ("variables", "shard"),
    [
        ({}, "1/1"),
        ({"ID": "0", "COUNT": "4"}, "1/4"),
        ({"ID": "4", "COUNT": "4", "MIN": "1", "MAX": "4"}, "4/4"),
        ({"ID": "20", "COUNT": "3", "MIN": "10", "STEP": "5"}, "3/3"),
    ],
)
def test_slurm_says_which_shard(variables: dict[str, str], shard: str) -> None:
    assert str(Shard.of_environment({f"SLURM_ARRAY_TASK_{k}": v for k, v in variables.items()})) == shard


@pytest.mark.parametrize(
    ("variables", "said"),
    [
        ({"ID": "4", "COUNT": "4"}, "expected one of 4 tasks from 0 in steps of 1, got 4"),
        ({"ID": "9", "COUNT": "3", "MIN": "1"}, "for an array with gaps"),
        ({"ID": "1"}, "SLURM_ARRAY_TASK_COUNT: expected a whole number"),
        ({"ID": "x", "COUNT": "2"}, "SLURM_ARRAY_TASK_ID: expected a whole number, got 'x'"),
    ],
)
def test_slurm_variables_that_say_nothing_are_refused(variables: dict[str, str], said: str) -> None:
    with pytest.raises(CommandError, match=said):
        Shard.of_environment({f"SLURM_ARRAY_TASK_{k}": v for k, v in variables.items()})


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--shard", "3/2"], "shard: expected i/n"),
        (["--objects", "cup"], "Object 'cup' is not in the built-in objects"),
        (["--objects", "missing/cup.obj"], "missing/cup.obj: no such file"),
        (["--objects", "cylinder:r=0"], "cylinder"),
        (["--hands", "robonaut"], "robonaut"),
        (["--fingers", "pinkie"], "Finger 'pinkie' is not in hand 'robonaut2'"),
        (["--friction", "1", "2", "3"], "--friction: expected one number, or two"),
        (["--workers", "-1"], "workers: expected a whole number of at least 0"),
        (["--memory", "0"], "memory: expected a number above 0"),
        (["--job", "missing.toml"], "missing.toml: no such file"),
        (["--merge", "x"], "--merge: merges a folder as it is"),
    ],
)
def test_bad_options_write_nothing(
    options: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    given = {"--hands": "robonaut2", "--objects": "mug", "--count": "1", "--out": "out"}
    rest = [word for name, value in given.items() if name not in options for word in (name, value)]
    assert main(["generate", *rest, *options]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert "Traceback" not in error
    assert list(tmp_path.iterdir()) == []


def test_slurm_names_the_shard_of_the_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in (("ID", "7"), ("MIN", "1"), ("COUNT", "4")):
        monkeypatch.setenv(f"SLURM_ARRAY_TASK_{name}", value)
    assert main(["generate", "--hands", "robonaut2", "--objects", "mug", "--out", str(tmp_path / "x")]) == 2
    assert "SLURM_ARRAY_TASK_ID: expected one of 4 tasks" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize(("folder", "said"), [("gone", "no such folder"), ("", "holds no dataset")])
def test_only_datasets_are_merged(folder: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["generate", "--merge", str(tmp_path / folder)]) == 2
    assert said in capsys.readouterr().err


def test_choices_of_the_commands_are_the_values_of_the_enumerations() -> None:
    assert set(generate.Kind.__args__) == set(GraspKind)
    assert set(exchange.AnyFormat.__args__) == set(GraspFormat) | set(DatasetFormat)
