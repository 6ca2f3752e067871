"""Shells complete commands, options and choices with what the program prints."""

from __future__ import annotations

import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from clench.apps.cli import parsing
from clench.apps.cli.command_table import COMMANDS
from clench.apps.cli.main import main
from clench.core.exceptions import CommandError

#: Completes the last word as bash does when TAB is pressed.
PRESS_TAB = """
source "$1"; shift
function=$(complete -p clench | sed 's/.*-F \\([^ ]*\\).*/\\1/')
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMP_LINE="$*"; COMP_POINT=${#COMP_LINE}
$function clench "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD - 1]}"
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.mark.skipif(sys.platform == "win32" or shutil.which("bash") is None, reason="needs bash")
def test_bash_completes_commands_options_and_choices(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--tyro-print-completion", "bash"]) == 0
    (tmp_path / "clench").write_text(capsys.readouterr().out)
    # The script asks for python3.
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])

    def completed(*words: str) -> set[str]:
        command = ["bash", "--norc", "-c", PRESS_TAB, "bash", str(tmp_path / "clench"), "clench", *words]
        run = subprocess.run(command, capture_output=True, text=True, check=True, env={**os.environ, "PATH": path})
        return set(run.stdout.splitlines())

    assert completed("") >= set(COMMANDS)
    assert completed("so") == {"solve"}
    assert completed("solve", "--hand") == {"--hand", "--hand-file"}
    assert completed("solve", "--order", "") == {"proximal-first", "together", "fingertip"}
    assert completed("execute", "--actuator", "ros") == {"ros2"}
    assert completed("batch", "--obst") == {"--obstacle"}


def test_zsh_gets_a_script(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--tyro-print-completion", "zsh"]) == 0
    assert capsys.readouterr().out.startswith("#compdef clench\n")


def test_what_only_the_parser_refuses_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parsing, "check_arguments", lambda *_: None)
    with pytest.raises(CommandError, match=r"^clench record: .*--limit.*many.* See clench record --help\.$"):
        parsing.parse_call("clench record", COMMANDS["record"], ["a", "--limit", "many"])


@pytest.mark.parametrize(("degrees", "angle"), [(45.0, math.pi / 4), (180.0, math.pi)])
def test_an_angle_of_an_option_is_in_degrees(degrees: float, angle: float) -> None:
    assert parsing.as_angle(degrees, "--a") == pytest.approx(angle)


@pytest.mark.parametrize("degrees", [0.0, -3.0, math.nan, 181.0])
def test_an_angle_that_is_refused_is_told_in_degrees(degrees: float) -> None:
    with pytest.raises(CommandError, match=f"^--a: expected degrees above 0 and up to 180, got {degrees:g}"):
        parsing.as_angle(degrees, "--a")


@pytest.mark.parametrize(("shells", "given"), [([], "nothing"), (["fish"], "fish"), (["bash", "zsh"], "bash zsh")])
def test_another_shell_is_refused(shells: list[str], given: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--tyro-print-completion", *shells]) == 2
    said = f"clench: error: --tyro-print-completion: expected a shell, one of bash, zsh, got {given}.\n"
    assert capsys.readouterr().err == said
