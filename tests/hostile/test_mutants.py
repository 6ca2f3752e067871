"""Good files with some bytes or numbers wrong: a sample of the command, and good files as they are."""

import zipfile

import numpy as np
import pytest

from clench.core.exceptions import FileError

from .good_files import KINDS, originals
from .mutants import Report, mutant, run

#: Files of each kind that the sample has.
EACH = 10


def check(report: Report, count: int) -> None:
    assert not report.mistakes, "\n".join(report.mistakes)
    assert sum(report.counts.values()) == count
    assert {kind for kind, _ in report.counts} == set(KINDS)
    # Too many refusals would mean that nothing gets past the first look at a file.
    read = sum(found for (_, outcome), found in report.counts.items() if outcome == "read")
    assert read > count / 10, report.table()


def test_good_files_are_read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for kind, original in originals(tmp_path).items():
        path = original.write(original.data)
        if kind == "thing.3mf":
            with pytest.raises(FileError, match=r"cannot read '\.3mf'; expected one of \.obj, \.stl"):
                original.read(path)
        else:
            original.read(path)


def test_changed_archives_can_still_be_opened(tmp_path):
    batch = originals(tmp_path)["batch.npz"]
    changed = [mutant(np.random.default_rng(seed), batch) for seed in range(40)]
    whole = []
    for data in changed:
        (tmp_path / "changed.npz").write_bytes(data)
        whole.append(zipfile.is_zipfile(tmp_path / "changed.npz"))
    assert sum(whole) > 20
    assert len(set(changed)) > 30


def test_a_sample():
    check(run(EACH * len(KINDS), seed=1), EACH * len(KINDS))


@pytest.mark.long
def test_two_thousand_of_each_kind():
    count = 2000 * len(KINDS)
    report = run(count, seed=0)
    print(report.table())
    check(report, count)
