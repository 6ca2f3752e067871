"""Read npy files of plain numbers."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import FileError
from .file_limits import ARRAY_BYTES


def read_array(path: str | Path) -> NDArray[Any]:
    """Return the array of an npy file whose values are plain numbers.

    Raises:
        FileError: missing, no regular file, too large, no npy file, not all there, or other values than real numbers.
    """
    if not os.path.isfile(path):
        raise FileError(path, "no such file; expected a NumPy file (.npy).")
    try:
        with open(path, "rb") as file:
            return _array(file, path)
    except FileError:
        raise
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror or error}).") from None
    except Exception as error:  # a damaged header can fail in any way
        raise FileError(path, f"not a NumPy file (.npy) of numbers ({error}).") from None


def _array(file: Any, path: str | Path) -> NDArray[Any]:
    """Read the header, compare it with what the file has, then read the numbers."""
    form, size = np.lib.format, os.fstat(file.fileno()).st_size
    if file.read(4) == b"PK\x03\x04":
        raise FileError(path, "expected one array (.npy), got an archive of several (.npz).")
    file.seek(0)
    version = form.read_magic(file)
    if version not in ((1, 0), (2, 0)):
        raise FileError(path, f"expected an npy file of version 1.0 or 2.0, got {version[0]}.{version[1]}.")
    # A header may say that it is longer than memory; a length that the file does not have is refused first.
    if version == (2, 0) and int.from_bytes(file.peek(4)[:4], "little") > size:
        raise FileError(path, "not a NumPy file (.npy) of numbers (its header is not all there).")
    read = form.read_array_header_1_0 if version == (1, 0) else form.read_array_header_2_0
    shape, fortran, dtype = read(file)
    if dtype.kind not in "iuf":
        raise FileError(path, f"expected an array of real numbers, got one of {dtype.name}.")
    needed, there = math.prod(shape) * dtype.itemsize, size - file.tell()
    if min(shape, default=0) < 0 or needed > there:
        raise FileError(path, f"its array of shape {shape} takes {needed} bytes, but the file has {there} of them.")
    if needed > ARRAY_BYTES:
        raise FileError(path, f"is too large: its array takes {needed} bytes, expected up to {ARRAY_BYTES}.")
    numbers = np.frombuffer(file.read(needed), dtype)
    return numbers.reshape(shape, order="F" if fortran else "C")
