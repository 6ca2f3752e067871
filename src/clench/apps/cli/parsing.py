"""Turn arguments into a call: the signature and docstring of a command are its options and its help."""

from __future__ import annotations

import contextlib
import functools
import inspect
import io
import math
import re
from collections.abc import Callable, Mapping, Sequence
from types import FunctionType
from typing import Annotated, Any, Final, Union, get_args, get_origin, get_type_hints

from clench.core.exceptions import CommandError

from .argument_check import check_arguments

EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130
#: The option that prints completion scripts, and the known shells.
PRINT_COMPLETION: Final = "--tyro-print-completion"
SHELLS: Final = ("bash", "zsh")
#: The option that may be given several times, as well as once with several values.
_REPEATED: Final = "--obstacle"


def as_range(values: tuple[float, ...], option: str) -> float | tuple[float, float] | None:
    """Return the value of an option of one or two numbers: nothing, a number, or a range (least, largest).

    Raises:
        CommandError: more than two numbers.
    """
    if len(values) > 2:
        raise CommandError(f"{option}: expected one number, or two for a range, got {len(values)}.")
    return None if not values else values[0] if len(values) == 1 else (values[0], values[1])


def as_angle(degrees: float, option: str) -> float:
    """Return the value of an option in degrees as an angle [rad].

    Raises:
        CommandError: the angle is not above 0 and up to 180.
    """
    if not 0.0 < degrees <= 180.0:
        raise CommandError(f"{option}: expected degrees above 0 and up to 180, got {degrees:g}.")
    return math.radians(degrees)


def parse_call(program: str, command: Callable[..., int], arguments: Sequence[str]) -> Callable[[], int]:
    """Return the call that the arguments ask for; after `--help`, one that returns 0.

    Args:
        program: start of the usage line. command: function whose parameters are the options.
        arguments: those after the program's name.

    Raises:
        CommandError: a wrong argument.
    """
    gathered = _gathered(arguments)
    check_arguments(program, command, gathered)
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
            return tyro.cli(call, prog=program, args=gathered, config=options_style())
    except SystemExit as finished:
        code = finished.code if isinstance(finished.code, int) else EXIT_BAD_INPUT
        if code:
            raise CommandError(f"{program}: {_sentence(box.getvalue())} See {program} --help.") from None
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
    """Return the text of a box on one line, for arguments that the parser refuses and `check_arguments` accepts."""
    text = " ".join(re.sub(r"[^\x20-\x7e]|--{2,}", " ", box).split())
    return text or "Expected other arguments."
