"""What draws nothing needs no OpenGL, whatever MUJOCO_GL says; what draws says in a sentence why it cannot."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from clench.core.rendering.opengl import load_late

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


def test_a_late_module_loads_when_it_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "late_one.py").write_text("import missing_one\nanswer = 42\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "late_one", raising=False)
    load_late("late_one")
    import late_one

    assert not hasattr(late_one, "__wrapped__")  # what looks at all modules loads none
    assert "answer" not in vars(late_one)
    with pytest.raises(ImportError, match="missing_one"):
        _ = late_one.answer
    monkeypatch.setitem(sys.modules, "missing_one", late_one)
    assert late_one.answer == 42
    assert "__getattr__" not in vars(late_one)
    load_late("late_one")
    assert late_one.answer == 42
    load_late("not_installed_anywhere")
    assert "not_installed_anywhere" not in sys.modules
    monkeypatch.delitem(sys.modules, "late_one")


def test_what_draws_nothing_looks_for_no_screen() -> None:
    # GLFW starts a process to find its library.
    said = "import sys; from clench.core.rendering.opengl import import_mujoco as load; mujoco = load(); "
    said += "print('glfw.library' in sys.modules, hasattr(mujoco, 'GLContext'))"
    assert run(said, "").stdout == "False True\n"
