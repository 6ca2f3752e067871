"""`clench bench commands`: whole processes, whose answers are checked before anything is timed."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from benchmarks.bench_commands import main
from benchmarks.bench_options import Case
from benchmarks.users import command_times
from clench.core.exceptions import CommandError


def few(case: Case, file: Path, seed: int) -> dict[str, list[str]]:
    return {"help": ["--help"], "plan": ["plan", "--help"]}


def test_commands_are_timed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(command_times, "_commands", few)
    assert main(["commands", "--passes", "1", "--other", sys.executable, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["errors"] == []
    for key in ("help", "plan", "other_help", "other_plan"):
        assert found[f"{key}_processor_s"] > 0.0
        assert found[f"{key}_s"] > 0.0
    assert found["help_over_other"] > 0.0


def test_a_failed_command_is_not_timed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(command_times, "_commands", lambda *_: {"hand": ["hand", "no such hand"]})
    assert main(["commands", "--passes", "1"]) == 1
    captured = capsys.readouterr()
    assert "hand: ended with exit code 2" in captured.err
    assert "hand_processor_s" not in captured.out


def test_what_another_version_lacks_is_left_out(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real = command_times.run

    def run(arguments, place, more=None):
        return command_times.Ran(2, "", 0.1, 0.1) if arguments[0] == "other" else real(arguments, place, more)

    monkeypatch.setattr(command_times, "run", run)
    monkeypatch.setattr(command_times, "_commands", few)
    own = command_times.program_of(sys.executable)
    monkeypatch.setattr(command_times, "program_of", lambda python: own if python == sys.executable else "other")
    assert main(["commands", "--passes", "1", "--other", "old", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["other_plan_refused"] is True
    assert "plan_over_other" not in found


@pytest.mark.parametrize("output", ["", "no json", "{}", '{"schema": "clench.plan/1", "joint_angles": {"a": 1}}'])
def test_the_check_of_a_solution_sees_others(output: str) -> None:
    assert not command_times._is_solution(output)
    assert command_times._is_solution('{"schema": "clench.solution/1", "joint_angles": {"a": 1}}')


def test_the_command_file_has_a_grasp(tmp_path: Path) -> None:
    commands = command_times._commands(Case("robonaut2", "ball"), tmp_path / "c.json", 0)
    ran = command_times.run([command_times.program_of(sys.executable), *commands["solve_json"]], tmp_path)
    assert ran.code == 0
    assert json.loads(ran.output)["status"] == "grasp"
    assert ran.processor > 0.0


def test_an_environment_without_the_program_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CommandError, match="expected the program 'clench' beside it"):
        command_times.program_of(str(tmp_path / "python"))
