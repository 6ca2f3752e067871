"""Exceptions for malformed input: each takes facts, writes one sentence and lists what exists.

"No contact", "blocked" and "out of reach" are answers of the solver, never exceptions.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class ClenchError(ValueError):
    """Say what was wrong with an input, in one sentence (command line: exit code 2)."""


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
        close = difflib.get_close_matches(name, known, n=1)
        guess = f" Did you mean '{close[0]}'?" if close else ""
        many = {"criterion": "criteria"}.get(kind, f"{kind}s")
        listed = f" {many.capitalize()}: {', '.join(known)}." if known else f" It has no {many}."
        super().__init__(f"{kind.capitalize()} '{name}' is not in {owner}.{guess}{listed}")
        self.name = name
