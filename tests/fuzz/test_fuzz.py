"""Malformed and extreme inputs: a sample of the command, and what it found once."""

import pytest

from .run import run

SAMPLE = 300


def told(report):
    return "\n".join(f"--first {number}: [{kind}] {text}" for number, kind, text in report.mistakes)


def test_a_sample():
    report = run(SAMPLE, seed=1)
    assert not report.mistakes, told(report)
    answers = sum(count for (_, outcome), count in report.counts.items() if outcome == "answer")
    # Too many refusals would mean that nothing gets past the first look at an input.
    assert answers > SAMPLE / 8, report.table()
    assert len({kind for kind, _ in report.counts}) >= 20


@pytest.mark.long
def test_a_hundred_thousand():
    report = run(100_000, seed=0)
    print(report.table())
    assert not report.mistakes, told(report)
