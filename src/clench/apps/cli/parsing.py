"""Turn arguments into a call: the signature and docstring of a command are its options and its help."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence

from clench.base.errors import CommandError

EXIT_BAD_INPUT = 2


def as_range(values: tuple[float, ...], option: str) -> float | tuple[float, float] | None:
    """Return what an option of one or two numbers says: nothing, a number, or a range (least, largest).

    Raises:
        CommandError: more than two numbers.
    """
    if len(values) > 2:
        raise CommandError(f"{option}: expected one number, or two for a range, got {len(values)}.")
    return None if not values else values[0] if len(values) == 1 else (values[0], values[1])


def parse_call(program: str, command: Callable[..., int], arguments: Sequence[str]) -> Callable[[], int]:
    """Return the call that the arguments ask for; a wrong argument gives exit code 2, `--help` gives 0.

    Args:
        program: what the usage line starts with. command: what is called with the options it names.
        arguments: those after the program's name.
    """
    import tyro

    @functools.wraps(command)
    def call(*values: object, **options: object) -> Callable[[], int]:
        # Deferred, so that the command's own errors are not taken for wrong arguments.
        return functools.partial(command, *values, **options)

    try:
        return tyro.cli(
            call,
            prog=program,
            args=list(arguments),
            config=(tyro.conf.FlagCreatePairsOff, tyro.conf.DisallowNone),
        )
    except SystemExit as finished:
        code = finished.code if isinstance(finished.code, int) else EXIT_BAD_INPUT
        return lambda: code
