"""Exceptions for malformed input: each takes facts, writes one sentence and lists the existing names.

"No contact", "blocked" and "out of reach" are answers of the solver, never exceptions.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from .showing.visible_text import visible

#: Longest message; a longer text contains a name or a list that nobody reads.
_LONGEST = 2000


class ClenchError(ValueError):
    """Report an error of the input in one sentence (command line: exit code 2).

    Args:
        sentence: one line; unprintable characters are escaped, and a long line is cut in its middle.
    """

    def __init__(self, sentence: str) -> None:
        super().__init__(_printable(sentence))


def _printable(text: str) -> str:
    line = visible(" ".join(text.split()))
    half = _LONGEST // 2
    return line if len(line) <= _LONGEST else f"{line[:half]} ... {line[-half:]}"


def guessed(name: object, names: Iterable[str]) -> str:
    """Return the question whether the nearest of some names was meant, with a space before it; empty without one."""
    # A mapping given from Python may have keys of any kind.
    close = difflib.get_close_matches(str(name), list(names), n=1)
    return f" Did you mean '{close[0]}'?" if close else ""


class FileError(ClenchError):
    """Say that a file is missing, unreadable or malformed.

    Args:
        path: the file as the user named it.
        problem: the error, and the expected content.
    """

    def __init__(self, path: object, problem: str) -> None:
        super().__init__(f"{path}: {problem}")
        self.path = str(path)


class HandError(ClenchError):
    """Say that a hand model is malformed or uses an unsupported feature."""


class ObjectError(ClenchError):
    """Say that an object's geometry is malformed."""


class CommandError(ClenchError):
    """Say that a grasp command is malformed, with the path of the key."""


class MotionError(ClenchError):
    """Report that no path of a hand is free, and name the obstruction."""


class UnknownNameError(ClenchError):
    """Report an unknown name, guess the intended one, and list the existing ones.

    Args:
        kind: kind of the name, e.g. ``"joint"``.
        name: the name that was given.
        owner: the place of the search, e.g. ``"hand 'robonaut2'"``.
        names: every name that exists there.
    """

    def __init__(self, kind: str, name: str, owner: str, names: Iterable[str]) -> None:
        known = list(names)
        guess = guessed(name, known)
        many = {"criterion": "criteria"}.get(kind, f"{kind}s")
        listed = f" {many.capitalize()}: {', '.join(known)}." if known else f" It has no {many}."
        super().__init__(f"{kind.capitalize()} '{name}' is not in {owner}.{guess}{listed}")
        self.name = name
