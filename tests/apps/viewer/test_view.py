"""`clench view` from the command line."""

from __future__ import annotations

import socket
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest

from clench.apps.cli.main import main


def say(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(["view", *arguments]) == 2
    return capsys.readouterr().err


def test_without_viser_the_command_says_how_to_install_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == "viser" else find_spec(name))
    assert say(capsys) == (
        "clench: error: clench view needs viser: pip install 'clench[viewer]' "
        "(in a checkout: uv sync --no-dev --inexact --extra viewer).\n"
    )


def test_bad_input_is_one_sentence(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert "no such file" in say(capsys, str(tmp_path / "none.json"))
    assert "nohand" in say(capsys, "--hand", "nohand")
    assert "--mass" in say(capsys, "--mass", "1", "2", "3")
    assert "seed: expected a whole number of at least 0, got -1" in say(capsys, "--seed", "-1")
    assert "gravity: expected a direction" in say(capsys, "--gravity", "0", "0", "0")
    assert "--port is given more than once" in say(capsys, "--port", "0", "--port", "1")
    assert "leave out --command" in say(capsys, str(tmp_path / "a.json"), "--command", "c.json")


def test_a_port_in_use_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("localhost", 0)) as taken:
        port = taken.getsockname()[1]
        said = say(capsys, "--port", str(port), "--without-browser")
    assert f"--port {port}: nothing can listen there on localhost" in said
    assert said.count("\n") == 1


@contextmanager
def viewer(*arguments: str) -> Iterator[str]:
    """Run the command without a display, and give the address that it prints."""
    call = [sys.executable, "-m", "clench", "view", "--port", "0", "--without-browser", *arguments]
    if find_spec("clench.__main__") is None:
        call[1:3] = ["-c", "import sys; from clench.apps.cli.main import main; sys.exit(main())"]
    with subprocess.Popen(call, stdout=subprocess.PIPE, text=True, env=None) as process:
        try:
            assert process.stdout is not None
            line = process.stdout.readline()
            assert "http://" in line, line
            yield line.split()[2]
        finally:
            process.terminate()
            process.wait(10.0)


def test_the_page_is_there_and_nothing_else_of_the_disk() -> None:
    with viewer() as url:
        with urllib.request.urlopen(url, timeout=20.0) as page:
            assert b"<html" in page.read()
        for path in ("etc/passwd", "../../../../../../../../etc/passwd", "%2e%2e/%2e%2e/%2e%2e/etc/passwd"):
            with pytest.raises(urllib.error.HTTPError) as refused:
                urllib.request.urlopen(f"{url}/{path}", timeout=20.0)
            assert refused.value.code == 404


def test_another_address_needs_the_token_that_is_printed() -> None:
    with viewer("--host", "127.0.0.2") as url:
        assert "/?token=" in url
        bare = url.split("?")[0]
        with pytest.raises(urllib.error.HTTPError) as refused:
            urllib.request.urlopen(bare, timeout=20.0)
        assert refused.value.code == 403
        opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
        with opener.open(url, timeout=20.0) as page:
            assert b"<html" in page.read()
