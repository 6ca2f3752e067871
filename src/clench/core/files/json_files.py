"""Read and write JSON files: complete or absent, and never with NaN."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

import msgspec

from clench.core.exceptions import ClenchError, FileError

from .file_bytes import read_file
from .file_limits import JSON_BYTES
from .nesting import TOO_DEEP, is_too_deep

#: Bytes of a file of another kind that a message may show.
_SHOWN = 24


def non_finite_path(value: Any) -> str | None:
    """Return the path of the first number that is NaN or infinite, or None; lists may be nested however deep."""
    waiting: list[tuple[Any, str]] = [(value, "")]
    while waiting:
        part, key = waiting.pop()
        if isinstance(part, float) and not math.isfinite(part):
            return key
        if isinstance(part, dict):
            waiting.extend((v, f"{key}.{k}" if key else str(k)) for k, v in reversed(part.items()))
        elif isinstance(part, list):
            waiting.extend((v, f"{key}[{i}]") for i, v in reversed([*enumerate(part)]))
    return None


def encode_document(document: dict[str, Any], name: str) -> bytes:
    """Return any document of plain values as one line of UTF-8 JSON, refusing NaN and infinity.

    Raises:
        ClenchError: a number is not finite; the message names its key.
    """
    try:
        return json.dumps(document, allow_nan=False, ensure_ascii=False).encode()
    except ValueError:
        where = f"{name}.{non_finite_path(document)}"
        raise ClenchError(f"{where}: is not a finite number and cannot be written.") from None


def read_json(path: str | Path, kind: str = "a document") -> Any:
    """Read a JSON file.

    Args:
        path: the file. kind: the expected content, for messages about files of another kind.

    Raises:
        FileError: missing, unreadable, too large, or not JSON.
    """
    return parse_json(read_file(path, JSON_BYTES), path, kind)


def parse_json(data: bytes, source: str | Path, kind: str = "a document") -> Any:
    """Return parsed JSON.

    Args:
        data: the text. source: names it in messages. kind: see `read_json`.

    Raises:
        FileError: not JSON, or nested too deeply.
    """
    try:
        value = msgspec.json.decode(data)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise FileError(source, not_json(data, kind, str(error))) from None
    except RecursionError:
        raise FileError(source, f"not JSON that can be read: {TOO_DEEP}.") from None
    if is_too_deep(value):
        raise FileError(source, f"not JSON that can be read: {TOO_DEEP}.")
    return value


def not_json(data: bytes, kind: str, why: str) -> str:
    """Return the mistake of a file that is not JSON: another kind of file, or the place of the mistake.

    Args:
        data: its content. kind: the expected content. why: the parser's reason.
    """
    start = data.lstrip()[:1]
    if start in (b"{", b"["):
        return f"not JSON ({why})."
    try:
        first = data[:_SHOWN].decode().strip().partition("\n")[0]
        other = f"text that begins with '{first}'" if first else "an empty file"
    except UnicodeDecodeError:
        other = "bytes that are no text"
    return f"not JSON: expected {kind}, got {other}."


def write_json(path: str | Path, document: dict[str, Any], name: str) -> None:
    """Write a document, indented, atomically.

    Raises:
        ClenchError: a number is not finite. FileError: the file cannot be written.
    """
    write_atomically(path, msgspec.json.format(encode_document(document, name), indent=2) + b"\n")


def check_writable(path: str | Path) -> None:
    """Refuse a file that cannot be written, before the work is done whose result it shall hold; leave nothing behind.

    Raises:
        FileError: it is a folder, a pipe or a device, its folder is missing, or nothing can be written there.
    """
    target = Path(path)
    try:
        if target.is_dir():
            raise FileError(path, "cannot be written (it is a folder).")
        if target.exists() and not target.is_file():
            raise FileError(path, "cannot be written (it is a pipe or a device, expected a file).")
        if not target.parent.is_dir():
            raise FileError(path, f"cannot be written (no folder '{target.parent}').")
        descriptor, temporary = _temporary(target)
        os.close(descriptor)
        temporary.unlink()
    except FileError:
        raise
    except ValueError as error:
        raise FileError(path, f"is no path of a file ({error}).") from None
    except OSError as error:
        raise FileError(path, f"cannot be written ({error.strerror or error}).") from None


def check_folder(path: str | Path) -> None:
    """Refuse a folder that files cannot be written to, before the work is done; a missing one is not made yet.

    Raises:
        FileError: it is a file, or nothing can be written in it, or in the folder that it would be made in.
    """
    folder = Path(path)
    if "\0" in str(folder):
        raise FileError(path, "is no path of a folder (embedded null byte).")
    try:
        there = next(each for each in (folder, *folder.absolute().parents) if each.exists())
        if not there.is_dir():
            raise FileError(path, f"cannot be made a folder ('{there}' is a file).")
        descriptor, temporary = _temporary(there / "clench")
        os.close(descriptor)
        temporary.unlink()
    except OSError as error:
        raise FileError(path, f"cannot be written to ({error.strerror or error}).") from None


def write_atomically(path: str | Path, content: bytes) -> None:
    """Write a file through a temporary one beside it, so that readers see the old or the new, never a part.

    Raises:
        FileError: the file cannot be written.
    """
    target = Path(path)
    temporary: Path | None = None
    try:
        descriptor, temporary = _temporary(target)
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(target)
    except ValueError as error:
        raise FileError(path, f"is no path of a file ({error}).") from None
    except OSError as error:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
        raise FileError(path, f"cannot be written ({error.strerror or error}).") from None


def _temporary(target: Path) -> tuple[int, Path]:
    """Make a new file beside a file to come; return its descriptor and path.

    The system takes off the permissions that the umask names: to ask for the umask would change it for other threads.
    """
    temporary = target.with_name(f".{target.name}.{os.urandom(4).hex()}.part")
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)
    return os.open(temporary, flags, 0o666), temporary
