"""The benchmarks come with a checkout; the package alone says so, and holds none of them."""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PROGRAM = "import sys; import benchmarks; from clench.apps.cli.main import main; sys.exit(main(sys.argv[1:]))"


@pytest.fixture
def folder(tmp_path):
    """A folder with another package of the same name, which is not to be taken for the benchmarks."""
    tmp_path.joinpath("benchmarks").mkdir()
    tmp_path.joinpath("benchmarks", "__init__.py").touch()
    return tmp_path


def bench(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Run a benchmark in a folder, whose packages come first."""
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    call = [sys.executable, "-c", PROGRAM, "bench", *options]
    return subprocess.run(call, cwd=folder, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("options", [("solve", "--poses", "1"), ("--help",), ()])
def test_the_package_alone_says_in_one_sentence_that_benchmarks_come_with_a_checkout(folder, options):
    # The wheel holds these files and no others, as the next test says.
    shutil.copytree(ROOT / "src" / "clench", folder / "clench", ignore=shutil.ignore_patterns("__pycache__"))
    run = bench(folder, *options)
    assert (run.returncode, run.stdout) == (2, "")
    (sentence,) = run.stderr.splitlines()
    assert sentence.startswith("clench: error: the benchmarks come with a checkout of clench, and this package is")
    assert str(folder / "clench") in sentence


def test_the_wheel_holds_the_package_and_nothing_else():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert project["tool"]["hatch"]["build"]["targets"] == {"wheel": {"packages": ["src/clench"]}}
    extras = project["project"]["optional-dependencies"].values()
    needed = [each for group in (project["project"]["dependencies"], *extras) for each in group]
    assert [each for each in needed if "fcl" in each] == []


def test_a_checkout_finds_its_benchmarks_from_any_folder(folder):
    run = bench(folder, "--help")
    assert (run.returncode, run.stderr) == (0, "")
    assert run.stdout.startswith("usage: clench bench NAME")
