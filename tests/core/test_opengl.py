"""What draws nothing needs no OpenGL, whatever MUJOCO_GL says; what draws says in a sentence why it cannot."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

_LOAD = "from clench import Hand; print(len(Hand.load('robonaut2').fingers))"
_FILM = "import clench.apps.cli.inputs.actuators as a; from pathlib import Path; a.make_film(Path('a.gif'), None)"


def run(code: str, drawn_by: str, *, folder: object = None) -> subprocess.CompletedProcess[str]:
    """Run Python code in a process of its own: MuJoCo looks for OpenGL once, when it is imported."""
    environment = {**os.environ, "MUJOCO_GL": drawn_by}
    return subprocess.run(
        [sys.executable, "-c", code], env=environment, cwd=folder, capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize("drawn_by", ["bogus", "disabled", "osmesa"])
def test_a_hand_loads_whatever_is_to_draw(drawn_by: str) -> None:
    assert run(_LOAD, drawn_by).stdout == "5\n"


def test_the_variable_is_left_as_it_was() -> None:
    said = "import os; from clench.core.rendering.opengl import import_mujoco as load; load(); "
    said += "print(os.environ['MUJOCO_GL'])"
    assert run(said, "bogus").stdout == "bogus\n"


@pytest.mark.parametrize(
    ("drawn_by", "sentence"),
    [
        ("bogus", "OpenGL cannot draw here (MUJOCO_GL=bogus cannot be used: invalid value"),
        ("off", "OpenGL cannot draw here (MUJOCO_GL=off switches it off)"),
    ],
)
def test_a_film_says_why_it_cannot_be_drawn(tmp_path: object, drawn_by: str, sentence: str) -> None:
    said = run(_FILM, drawn_by, folder=tmp_path).stderr
    assert sentence in said
    assert "ClenchError" in said.splitlines()[-1]


def test_a_command_that_draws_nothing_does_its_work(tmp_path: object) -> None:
    code = "import sys; from clench.apps.cli.main import main; sys.exit(main(['hand', 'robonaut2', '--json']))"
    shown = run(code, "bogus", folder=tmp_path)
    assert (shown.returncode, shown.stderr) == (0, "")


def test_drawing_leaves_the_environment_as_it_was() -> None:
    said = (
        "import os; before = dict(os.environ); import clench.core.rendering.opengl as gl\n"
        "try: gl.open_context(8, 8).free()\n"
        "except gl.OpenGLError: pass\n"
        "print(dict(os.environ) == before)"
    )
    assert run(said, "").stdout == "True\n"
