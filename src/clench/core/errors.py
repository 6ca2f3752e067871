"""Exceptions for malformed input: each takes facts, writes one sentence and lists what exists.

"No contact", "blocked" and "out of reach" are answers of the solver, never exceptions.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from .visible_text import visible

#: Longest message; what is longer has a name or a list in it that nobody reads.
_LONGEST = 2000


class ClenchError(ValueError):
    """Say what was wrong with an input, in one sentence (command line: exit code 2).

    Args:
        sentence: one line; what cannot be printed is escaped, and what is too long is cut in its middle.
    """

    def __init__(self, sentence: str) -> None:
        super().__init__(_printable(sentence))


def _printable(text: str) -> str:
    line = visible(" ".join(text.split()))
    half = _LONGEST // 2
    return line if len(line) <= _LONGEST else f"{line[:half]} ... {line[-half:]}"


class FileError(ClenchError):
    """Say that a file is missing, unreadable or malformed.

    Args:
        path: the file as the user named it.
        problem: what is wrong, and what was expected.
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
    """Say that no path of a hand is free, and what the hand would meet."""


class UnknownNameError(ClenchError):
    """Say that a name does not exist, guess what was meant, and list what exists.

    Args:
        kind: what is named, e.g. ``"joint"``.
        name: the name that was given.
        owner: where it was looked for, e.g. ``"hand 'robonaut2'"``.
        names: every name that exists there.
    """

    def __init__(self, kind: str, name: str, owner: str, names: Iterable[str]) -> None:
        known = list(names)
        # A mapping given from Python may have keys of any kind.
        close = difflib.get_close_matches(str(name), known, n=1)
        guess = f" Did you mean '{close[0]}'?" if close else ""
        many = {"criterion": "criteria"}.get(kind, f"{kind}s")
        listed = f" {many.capitalize()}: {', '.join(known)}." if known else f" It has no {many}."
        super().__init__(f"{kind.capitalize()} '{name}' is not in {owner}.{guess}{listed}")
        self.name = name
