"""Check arguments against the signature of a command, and name a mistake in one sentence.

The option parser converts the arguments afterwards. Its own messages are boxes of text in the words of Python.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
import types
import typing
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from clench.core.exceptions import CommandError, guessed

#: An argument that is an option and no value: not a negative number, and not a lone dash.
_OPTION: Final = re.compile(r"--?[A-Za-z]")
#: Behind it, every argument is a value without an option.
_END: Final = "--"
_EXPECTED: Final = {int: "a whole number", float: "a number", Path: "a path"}


@dataclass(frozen=True)
class Option:
    """What an option takes.

    Args:
        name: as it is written, or a word for the place of a value without an option.
        kind: type of one value. count: number of values, None: any.
        required: it has no default. placed: it is a value without an option.
    """

    name: str
    kind: Any
    count: int | None
    required: bool
    placed: bool

    @property
    def choices(self) -> list[str]:
        """The values to choose from; empty if there are more than can be listed."""
        return [str(c) for c in typing.get_args(self.kind)] if typing.get_origin(self.kind) is typing.Literal else []

    @property
    def expected(self) -> str:
        """The kind of one value, for a message."""
        return f"one of {', '.join(self.choices)}" if self.choices else _EXPECTED.get(self.kind, "a value")

    def check(self, value: str) -> None:
        """Refuse a value of another kind.

        Raises:
            CommandError: it names the option, the value, and the expected value.
        """
        if self.choices and value not in self.choices:
            raise CommandError(f"{self.name}: expected {self.expected}, got '{value}'.{guessed(value, self.choices)}")
        if self.kind in (int, float):
            try:
                self.kind(value)
            except ValueError:
                raise CommandError(f"{self.name}: expected {self.expected}, got '{value}'.") from None


def check_arguments(program: str, command: Callable[..., int], arguments: Sequence[str]) -> None:
    """Refuse arguments that do not fit the signature of a command.

    Args:
        program: start of the usage line. command: function whose parameters are the options.
        arguments: those after the program's name.

    Raises:
        CommandError: an unknown option, a missing, wrong or superfluous value, an option given twice, or one missing.
    """
    if not {"-h", "--help"}.isdisjoint(arguments):
        return
    options = list(_options(command))
    try:
        given = _walk(deque(arguments), options)
        missing = [option.name for option in options if option.required and option.name not in given]
        if missing:
            raise CommandError(
                f"expected {' and '.join(missing)}, which {'is' if len(missing) == 1 else 'are'} missing."
            )
    except CommandError as error:
        raise CommandError(f"{program}: {error} See {program} --help.") from None


def _walk(waiting: deque[str], options: Sequence[Option]) -> set[str]:
    """Check every argument in turn; return the names of the options that were given."""
    named = {option.name: option for option in options if not option.placed}
    given: set[str] = set()
    while waiting:
        word = waiting.popleft()
        if word == _END:
            given.update(_take_place(each, options, given) for each in waiting)
            break
        if not _OPTION.match(word):
            given.add(_take_place(word, options, given))
            continue
        name, attached, value = word.partition("=")
        option = named.get(name.replace("_", "-"))
        if option is None:
            raise CommandError(f"'{name}' is no option of this command.{guessed(name, named)}")
        if option.kind is bool:
            if attached:
                raise CommandError(f"{name}: expected no value, got '{value}'.")
        elif option.name in given:
            again = "" if option.count == 1 else " and put all values behind it"
            raise CommandError(f"{name} is given more than once; give it once{again}.")
        else:
            _take_values(option, [value] if attached else [], waiting)
        given.add(option.name)
    return given


def _take_place(word: str, options: Sequence[Option], given: set[str]) -> str:
    """Check a value without an option; return the name of its place."""
    places = [option for option in options if option.placed]
    free = [place for place in places if place.count is None or place.name not in given]
    if free:
        free[0].check(word)
        return free[0].name
    if places:
        raise CommandError(f"'{word}' is one value too many: this command takes one {places[0].name}.")
    first = next((option for option in options if option.required), options[0])
    raise CommandError(f"'{word}' follows no option; write every value behind its option, as in {first.name} {word}.")


def _take_values(option: Option, values: list[str], waiting: deque[str]) -> None:
    """Move the values of an option from the arguments that are waiting, and check them."""
    while waiting and len(values) != option.count and waiting[0] != _END and not _OPTION.match(waiting[0]):
        values.append(waiting.popleft())
    for value in values:
        option.check(value)
    if option.count is not None and len(values) < option.count:
        expected = option.expected if option.count == 1 else f"{option.count} numbers"
        raise CommandError(f"{option.name}: expected {expected}, got {len(values) or 'nothing'}.")


def _options(command: Callable[..., int]) -> Iterator[Option]:
    """Yield the options of a command; the fields of a data class are options of their own."""
    hints = typing.get_type_hints(command)
    for name, parameter in inspect.signature(command).parameters.items():
        default = parameter.default
        if dataclasses.is_dataclass(hints[name]):
            fields = typing.get_type_hints(hints[name])
            for field in dataclasses.fields(hints[name]):
                yield _option(field.name, fields[field.name], getattr(default, field.name, field.default), False)
        else:
            absent = default is inspect.Parameter.empty
            yield _option(name, hints[name], default, absent, parameter.kind is inspect.Parameter.POSITIONAL_ONLY)


def _option(name: str, hint: Any, default: Any, required: bool, placed: bool = False) -> Option:
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        hint = next(part for part in typing.get_args(hint) if part is not type(None))
    kind: Any = hint
    count: int | None = 1
    if typing.get_origin(hint) is tuple:
        kind, *more = typing.get_args(hint)
        count = None if Ellipsis in more else 1 + len(more)
    if placed:
        return Option(name.upper(), kind, count, required, True)
    flag = f"no-{name}" if kind is bool and default is True else name
    return Option(f"--{flag.replace('_', '-')}", kind, count, required, False)
