"""Turn arguments into a call: the signature and docstring of a command are its options and its help."""

from __future__ import annotations

import contextlib
import functools
import inspect
import io
import itertools
import re
from collections.abc import Callable, Mapping, Sequence
from types import FunctionType
from typing import Annotated, Any, Final, Union, get_args, get_origin, get_type_hints

from clench.core.exceptions import CommandError

EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130
#: The option that prints completion scripts, and the known shells.
PRINT_COMPLETION: Final = "--tyro-print-completion"
SHELLS: Final = ("bash", "zsh")
#: The option that may be given several times, as well as once with several values.
_REPEATED: Final = "--obstacle"
#: How the parser lists choices, and the option that it takes for a misspelt one.
_CHOICES: Final = re.compile(r"Expected one of \(([^)]*?),?\)")
_LIKELY: Final = re.compile(r"Perhaps you meant:?\W+(--[\w-]+)")
#: Lines of a box that are indented so far are the help of an option.
_HELP_INDENT = 8


def as_range(values: tuple[float, ...], option: str) -> float | tuple[float, float] | None:
    """Return the value of an option of one or two numbers: nothing, a number, or a range (least, largest).

    Raises:
        CommandError: more than two numbers.
    """
    if len(values) > 2:
        raise CommandError(f"{option}: expected one number, or two for a range, got {len(values)}.")
    return None if not values else values[0] if len(values) == 1 else (values[0], values[1])


def parse_call(program: str, command: Callable[..., int], arguments: Sequence[str]) -> Callable[[], int]:
    """Return the call that the arguments ask for; after `--help`, one that returns 0.

    Args:
        program: start of the usage line. command: function whose parameters are the options.
        arguments: those after the program's name.

    Raises:
        CommandError: a wrong argument.
    """
    import tyro

    def call(*values: object, **options: object) -> Callable[[], int]:
        # Deferred, so that the command's own errors are not taken for wrong arguments.
        return functools.partial(command, *values, **options)

    call.__name__, call.__doc__ = command.__name__, command.__doc__
    vars(call)["__signature__"] = signature = inspect.signature(command)
    hints = get_type_hints(command, include_extras=True)
    call.__annotations__ = {
        name: _quickly_checked(kind, signature.parameters.get(name)) for name, kind in hints.items()
    }
    box = io.StringIO()
    try:
        with contextlib.redirect_stderr(box):
            return tyro.cli(call, prog=program, args=_gathered(arguments), config=options_style())
    except SystemExit as finished:
        code = finished.code if isinstance(finished.code, int) else EXIT_BAD_INPUT
        if code:
            raise CommandError(f"{program}: {_sentence(box.getvalue())} Options: {program} --help.") from None
        return lambda: code


def _quickly_checked(kind: Any, parameter: inspect.Parameter | None) -> Any:
    """Return a type for the same values, whose default the parser checks by itself.

    The parser compares a default with a type such as `int | None` or `tuple[str, ...]` by a package that checks types.
    Loading this package takes longer than everything else that the parser does.
    """
    from tyro.constructors import ConstructorRegistry, PrimitiveTypeInfo

    if parameter is not None and parameter.default is None:
        # None goes first: the parser stops at the first type that fits.
        return Union[(None, *get_args(kind))]
    if get_origin(kind) is tuple:
        return Annotated[tuple, ConstructorRegistry.get_primitive_spec(PrimitiveTypeInfo.make(kind, set()))]
    return kind


def print_completion(program: str, commands: Mapping[str, Callable[..., int]], arguments: Sequence[str]) -> int:
    """Print a shell's completion script for commands and options; return the exit code.

    Args:
        program: name of the program. commands: by name. arguments: the option with the name of a shell.

    Raises:
        CommandError: a shell that is not known.
    """
    import tyro

    if list(arguments[1:]) not in [[shell] for shell in SHELLS]:
        given = " ".join(arguments[1:]) or "nothing"
        raise CommandError(f"{arguments[0]}: expected a shell, one of {', '.join(SHELLS)}, got {given}.")
    told = {name: _in_single_lines(command) for name, command in commands.items()}
    try:
        tyro.extras.subcommand_cli_from_dict(
            told, prog=program, args=[PRINT_COMPLETION, arguments[1]], config=options_style()
        )
    except SystemExit as finished:
        return finished.code if isinstance(finished.code, int) else 0
    return 0


def _in_single_lines(command: Callable[..., int]) -> Callable[..., int]:
    """Return a command whose help has every option on one line: bash takes further lines for words to choose from."""
    assert isinstance(command, FunctionType)
    copied = FunctionType(command.__code__, command.__globals__, command.__name__, command.__defaults__)
    copied.__kwdefaults__, copied.__annotations__ = command.__kwdefaults__, command.__annotations__
    copied.__doc__ = re.sub(r"\n {12,}", " ", command.__doc__ or "")
    return copied


def _gathered(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with the values of a repeated option behind one of it."""
    others: list[str] = []
    values: list[str] = []
    into = others
    for argument in arguments:
        if argument == _REPEATED:
            into = values
        elif argument.startswith(f"{_REPEATED}="):
            values.append(argument.partition("=")[2])
        else:
            into = others if argument.startswith("--") else into
            into.append(argument)
    return [*others, _REPEATED, *values] if values or _REPEATED in arguments else others


def options_style() -> tuple[Any, ...]:
    """Return how signatures become options: no `--no-x` for a flag, no text for None, no group before a name."""
    import tyro

    return tyro.conf.FlagCreatePairsOff, tyro.conf.DisallowNone, tyro.conf.OmitArgPrefixes


def _sentence(box: str) -> str:
    """Return the first sentence of a box of text on one line, without its title and the help of options."""
    lines = [line.strip("│").rstrip() for line in box.splitlines() if not line.startswith(("╭", "╰"))]
    rules = [i for i, line in enumerate(lines) if line and set(line.strip()) <= set("─-")]
    # In boxes drawn with plain characters, the title is a line above the first rule.
    start = 0 if box.startswith("╭") or not rules else rules[0] + 1
    first = itertools.takewhile(lambda line: line and not set(line.strip()) <= set("─-"), lines[start:])
    text = " ".join(line.strip() for line in first if not line.startswith(" " * _HELP_INDENT))
    text = _CHOICES.sub(lambda found: f"Expected one of {found[1].replace(chr(39), '')}", text)
    likely = _LIKELY.search(box)
    meant = f" Did you mean '{likely[1]}'?" if likely else ""
    return (text[:1].upper() + text[1:] or "Expected other arguments").rstrip(".") + "." + meant
