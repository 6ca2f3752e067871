"""Entry point of the command line: choose the command, turn errors into one sentence and an exit code.

Exit codes: 0 = grasp or partial, and executed if asked (`--strict`: grasp only); 1 = any other answer, or a failed
execution; 2 = bad input; 70 = a mistake in this program.
"""

from __future__ import annotations

import atexit
import functools
import gc
import json
import os
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from clench import __version__
from clench.core.exceptions import ClenchError, UnknownNameError

from .parsing import EXIT_BAD_INPUT, EXIT_INTERRUPTED, PRINT_COMPLETION, parse_call, print_completion

EXIT_INTERNAL = 70
#: Number of new objects that start the first collection, and of collections that start the next wider one. A short
#: command makes 300,000 objects and no garbage.
GARBAGE_THRESHOLDS = (500_000, 20, 100)

#: How long OpenBLAS's threads wait in a loop for more work, as a power of two in processor cycles, unless the
#: environment says so. By itself, each thread waits for 2^26 cycles when it starts and after its work.
BLAS_WAITS = ("OPENBLAS_THREAD_TIMEOUT", "4")

DESCRIPTION = """Close a robot hand around a known object, in closed form, and carry it out.

Exit codes: 0 = grasp or partial, and executed where asked (--strict: grasp only); 1 = any other answer, or a failed
execution; 2 = bad input. Every command takes --json (one document on standard output, for an error {"error": "..."})
and --debug (tracebacks). clench --tyro-print-completion SHELL prints the completion for bash or zsh."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Args:
        argv: the arguments after the program's name; by default those of the process.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    debug = "--debug" in arguments
    arguments = [a for a in arguments if a != "--debug"]
    say = functools.partial(_say, as_json="--json" in arguments)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _warn
            return _run(arguments)
    except ClenchError as error:
        if debug:
            raise
        return say(str(error), EXIT_BAD_INPUT)
    except KeyboardInterrupt:
        return say("interrupted.", EXIT_INTERRUPTED)
    except BrokenPipeError:
        # The reader of our output has closed it (`clench hand H | head`); the buffered rest has nowhere to go.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if debug:
            raise
        what = " ".join(f"{type(error).__name__}: {error}".split())
        return say(f"internal error ({what}); run again with --debug to see where.", EXIT_INTERNAL)


def _run(arguments: list[str]) -> int:
    os.environ.setdefault(*BLAS_WAITS)  # NumPy reads it when it is loaded
    from .command_table import COMMANDS, bench

    # Imported modules stay: garbage collections of them take a twentieth of a short command's time. The last one, at
    # the end of the process, takes a fifth, and frees what the end of the process frees anyway.
    gc.set_threshold(*GARBAGE_THRESHOLDS)
    atexit.unregister(gc.freeze)
    atexit.register(gc.freeze)
    name, *rest = arguments or ["--help"]
    if name == "--version":
        sys.stdout.write(f"clench {__version__}\n")
        return 0
    if name in ("-h", "--help"):
        sys.stdout.write(_overview(COMMANDS))
        return 0
    if name == PRINT_COMPLETION:
        return print_completion("clench", COMMANDS, arguments)
    if name not in COMMANDS:
        raise UnknownNameError("command", name, "clench", COMMANDS)
    if name == "bench":
        return bench(*rest)  # has commands and help of its own
    return parse_call(f"clench {name}", COMMANDS[name], rest)()


def _overview(commands: Mapping[str, Callable[..., int]]) -> str:
    """Return the help of the whole program, written here because the option parser takes longer to load."""
    lines = [f"  {name:<10}{(command.__doc__ or '').splitlines()[0]}" for name, command in commands.items()]
    listed = "\n".join(lines)
    return f"usage: clench COMMAND ...\n\n{DESCRIPTION}\n\ncommands (clench COMMAND --help tells more):\n{listed}\n"


def _warn(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
    """Show a warning as one sentence, without the line of code that it comes from."""
    sys.stderr.write(f"clench: warning: {message}\n")


def _say(sentence: str, code: int, *, as_json: bool) -> int:
    """Print an error on standard error, and as a document on standard output for a program that reads it."""
    if as_json:
        sys.stdout.write(json.dumps({"error": sentence}) + "\n")
        sys.stdout.flush()
    sys.stderr.write(f"clench: error: {sentence}\n")
    return code
