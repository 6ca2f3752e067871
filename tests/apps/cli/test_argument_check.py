"""Every option of every command: a wrong type, a wrong choice, an unknown name, a missing and a repeated value."""

from __future__ import annotations

import typing
from collections.abc import Callable
from pathlib import Path

import pytest

from clench.apps.cli.argument_check import _options, check_arguments
from clench.apps.cli.command_table import COMMANDS
from clench.apps.cli.parsing import parse_call
from clench.core.exceptions import CommandError

#: Every option of every command but `bench`, which has commands of its own.
OPTIONS = [
    pytest.param(command, option, id=f"{name} {option.name}")
    for name, command in COMMANDS.items()
    if name != "bench"
    for option in _options(command)
]


def refusal(command: Callable[..., int], *arguments: str) -> str:
    with pytest.raises(CommandError) as caught:
        check_arguments("clench x", command, arguments)
    said = str(caught.value)
    assert said.startswith("clench x: ")
    assert said.endswith(" See clench x --help.")
    return said.removeprefix("clench x: ").removesuffix(" See clench x --help.")


def test_the_options_are_those_of_the_commands() -> None:
    assert len(OPTIONS) > 150


@pytest.mark.parametrize(("command", "option"), OPTIONS)
def test_a_value_that_is_missing_wrong_or_given_twice_names_its_option(command: Callable[..., int], option) -> None:
    name, choices = option.name, option.choices
    if option.placed:
        return
    assert refusal(command, f"{name}x", "1").startswith(f"'{name}x' is no option of this command.")
    if option.kind is bool:
        assert refusal(command, f"{name}=1") == f"{name}: expected no value, got '1'."
        return
    if option.count is not None:
        assert refusal(command, name).startswith(f"{name}: expected ")
        assert refusal(command, name).endswith("got nothing.")
    wrong = ["wrong"] * (option.count or 1)
    if option.kind in (int, float) or choices:
        said = refusal(command, name, *wrong)
        expected = (
            f"one of {', '.join(choices)}" if choices else {int: "a whole number", float: "a number"}[option.kind]
        )
        assert said.startswith(f"{name}: expected {expected}, got 'wrong'.")
    right = [choices[0] if choices else "1"] * (option.count or 1)
    assert refusal(command, name, *right, name, *right).startswith(f"{name} is given more than once; give it once")


@pytest.mark.parametrize("name", [name for name in COMMANDS if name != "bench"])
def test_what_the_check_accepts_the_parser_accepts(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    arguments: list[str] = []
    for option in _options(COMMANDS[name]):
        value = option.choices[0] if option.choices else "1"
        values = [] if option.kind is bool else [value] * (option.count or 2)
        arguments = [*values, *arguments] if option.placed else [*arguments, option.name, *values]
    # The parser would end the test with its own refusal.
    assert callable(parse_call(f"clench {name}", COMMANDS[name], arguments))


def command(
    files: tuple[Path, ...], /, *, out: Path, many: tuple[float, ...] = (), pair: tuple[float, float] = (0.0, 0.0)
) -> int:
    """Do nothing."""
    return 0


def single(file: Path, /, *, color: typing.Literal["red", "green"] = "red", loud: bool = True) -> int:
    """Do nothing."""
    return 0


@pytest.mark.parametrize(
    ("called", "arguments", "said"),
    [
        (command, ["--out", "a", "--many", "1", "x"], "--many: expected a number, got 'x'."),
        (command, ["--pair", "1"], "--pair: expected 2 numbers, got 1."),
        (command, ["--pair", "-1", "--out"], "--pair: expected 2 numbers, got 1."),
        (command, ["f", "--many", "1", "--many", "2"], "once and put all values behind it."),
        (command, [], "expected FILES and --out, which are missing."),
        (command, ["-o", "a"], "'-o' is no option of this command."),
        (single, ["a", "b"], "'b' is one value too many: this command takes one FILE."),
        (single, ["--", "-a", "b"], "'b' is one value too many: this command takes one FILE."),
        (single, ["a", "--color", "gren"], "expected one of red, green, got 'gren'. Did you mean 'green'?"),
        (single, ["a", "--loud"], "'--loud' is no option of this command. Did you mean '--no-loud'?"),
    ],
)
def test_arguments_that_do_not_fit(called: Callable[..., int], arguments: list[str], said: str) -> None:
    assert refusal(called, *arguments).endswith(said)


@pytest.mark.parametrize(
    ("called", "arguments"),
    [
        (command, ["f", "g", "--out=a", "--many=1", "-2", "1e3", "--pair", "-1", "-.5"]),
        (command, ["--out", "a", "--many", "--", "f", "-g"]),
        (single, ["-", "--color=green", "--no-loud"]),
        (single, ["--", "--file"]),
        (single, ["--colour", "blue", "--help"]),
    ],
)
def test_arguments_that_fit(called: Callable[..., int], arguments: list[str]) -> None:
    check_arguments("clench x", called, arguments)


def test_a_value_without_an_option_is_told_where_it_belongs() -> None:
    said = "'robonaut2' follows no option; write every value behind its option, as in --hand robonaut2."
    assert refusal(COMMANDS["plan"], "robonaut2", "mug") == said
