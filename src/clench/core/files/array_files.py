"""Read npy files of plain numbers, and npz files of several arrays."""

from __future__ import annotations

import io
import math
import os
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.core.exceptions import FileError

from .file_limits import ARCHIVE_LIST_BYTES, ARRAY_BYTES, JSON_BYTES

#: First bytes of every npy file.
_MAGIC: Final = b"\x93NUMPY"
#: Kinds of values: whole and real numbers; with them true and false, and text.
_NUMBERS: Final = "iuf"
_PLAIN: Final = _NUMBERS + "bU"
#: NumPy keeps a character of text in so many bytes.
_CHARACTER: Final = 4


def read_array(path: str | Path) -> NDArray[Any]:
    """Return the array of an npy file whose values are plain numbers.

    Raises:
        FileError: the file is missing, no regular file, too large, no npy file, incomplete, or has values other than
            real numbers.
    """
    try:
        _check_regular(path, "NumPy file (.npy)")
        with open(path, "rb") as file:
            if file.peek(4)[:4] == b"PK\x03\x04":
                raise FileError(path, "expected one array (.npy), got an archive of several (.npz).")
            if file.peek(len(_MAGIC))[: len(_MAGIC)] != _MAGIC:
                raise FileError(path, "not a NumPy file (.npy) of numbers; it does not begin as NumPy's files do.")
            return _array(file, os.fstat(file.fileno()).st_size, path, _NUMBERS)
    except FileError:
        raise
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror or error}).") from None
    except Exception as error:  # a damaged header can fail in any way
        raise FileError(path, f"not a NumPy file (.npy) of numbers ({error}).") from None


def read_arrays(path: str | Path, names: Iterable[str]) -> dict[str, NDArray[Any]]:
    """Return the arrays of an npz file that have one of these names: numbers, true and false, or text.

    The sizes that the archive and the headers claim are checked before anything is unpacked.

    Raises:
        FileError: the file is missing, no regular file, no npz file, too large, damaged, or has other values in these
            arrays.
    """
    try:
        _check_regular(path, "NumPy archive (.npz)")
        with _Archive(io.FileIO(path)) as file, zipfile.ZipFile(file) as archive:
            file.most = math.inf
            entries = {name: archive.NameToInfo.get(f"{name}.npy") for name in names}
            found = {name: entry for name, entry in entries.items() if entry is not None}
            total = sum(entry.file_size for entry in found.values())
            if total > ARRAY_BYTES:
                raise FileError(path, f"is too large: its arrays take {total} bytes, expected up to {ARRAY_BYTES}.")
            arrays = {}
            for name, entry in found.items():
                with archive.open(entry) as stream:
                    arrays[name] = _array(stream, entry.file_size, f"{path}: {name}", _PLAIN)
            return arrays
    except FileError:
        raise
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror or error}).") from None
    except Exception as error:  # a damaged archive can fail in any way
        reason = str(error) or type(error).__name__
        raise FileError(path, f"not a NumPy archive (.npz) that can be read ({reason}).") from None


def _check_regular(path: str | Path, expected: str) -> None:
    """Refuse irregular files: reading a pipe or a device may never end."""
    if not os.path.isfile(path):
        raise FileError(path, f"no such file; expected a {expected}.")


class _Archive(io.BufferedReader):
    """Read a file, but no list of names that is too long; `most` is the longest read [bytes]."""

    most: float = ARCHIVE_LIST_BYTES

    def read(self, size: int | None = -1, /) -> bytes:
        """Return bytes, as the base class does."""
        if size is not None and size > self.most:
            raise ValueError(f"its list of names has {size} bytes, expected up to {ARCHIVE_LIST_BYTES}")
        return super().read(size)


def _array(file: Any, size: int, source: str | Path, kinds: str) -> NDArray[Any]:
    """Read the header, compare it with the size of the file [bytes], then read the values.

    Args:
        file: npy data, from its beginning. size: of the data. source: names it in messages. kinds: of values.
    """
    form = np.lib.format
    version = form.read_magic(file)
    if version not in ((1, 0), (2, 0)):
        raise FileError(source, f"expected an npy file of version 1.0 or 2.0, got {version[0]}.{version[1]}.")
    # A header may say that it is longer than memory; a length that the file does not have is refused first.
    if version == (2, 0) and int.from_bytes(file.peek(4)[:4], "little") > size:
        raise FileError(source, "not a NumPy file (.npy) of numbers (its header is not all there).")
    read = form.read_array_header_1_0 if version == (1, 0) else form.read_array_header_2_0
    shape, fortran, dtype = read(file)
    if dtype.kind not in kinds:
        expected = "real numbers" if kinds == _NUMBERS else "numbers or text"
        raise FileError(source, f"expected an array of {expected}, got one of {dtype.name}.")
    needed, there = math.prod(shape) * dtype.itemsize, size - file.tell()
    if min(shape, default=0) < 0 or needed > there:
        raise FileError(source, f"its array of shape {shape} takes {needed} bytes, but the file has {there} of them.")
    if needed > ARRAY_BYTES:
        raise FileError(source, f"is too large: its array takes {needed} bytes, expected up to {ARRAY_BYTES}.")
    if dtype.kind == "U" and dtype.itemsize > _CHARACTER * JSON_BYTES:
        raise FileError(source, f"is too large: a text has {dtype.itemsize // _CHARACTER} characters.")
    values = np.frombuffer(file.read(needed), dtype)
    if dtype.kind == "U" and not _is_text(values):
        raise FileError(source, "has text with characters that do not exist.")
    return values.reshape(shape, order="F" if fortran else "C")


def _is_text(values: NDArray[Any]) -> bool:
    """Return whether all characters of an array of text are some that Unicode has; other numbers fail when read."""
    codes = np.frombuffer(values, np.dtype(np.uint32).newbyteorder(values.dtype.byteorder))
    return bool(((codes < 0xD800) | ((codes > 0xDFFF) & (codes < 0x110000))).all())
