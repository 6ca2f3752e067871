"""Read npy files with one pickled dictionary of arrays; nothing that the file names is called, made or cast.

A pickle is a program. Here it runs on a machine that knows lists, dictionaries, text and numbers. Inert stand-ins
replace NumPy's own functions and types. They keep their arguments, and make arrays only of plain numbers whose bytes
are all present. All other names and instructions are refused.
"""

from __future__ import annotations

import io
import math
import pickle
import re
from typing import Any, ClassVar, Final

import numpy as np

from clench.core.exceptions import FileError
from clench.core.files.file_limits import DOCUMENT_DEPTH, DOCUMENT_VALUES

#: Plain numbers: letter and bytes.
_NUMERIC: Final = re.compile(r"([<>=|]?)(f[248]|[iu][1248]|b1)")
_LARGEST_HEADER: Final = 10_000


class NotNumbers:
    """Stand for an array that is no plain numbers (text, dates, records), of which nothing is read."""


class _Dtype:
    """Stand for `numpy.dtype`: the code, and the order of bytes that its state adds."""

    def __init__(self, code: Any, *_: Any) -> None:
        self.code, self.order = code if isinstance(code, str) else "", ""

    def set_state(self, state: Any) -> None:
        if not isinstance(state, tuple) or len(state) < 2 or state[1] not in ("<", ">", "=", "|"):
            raise pickle.UnpicklingError("a type of numbers has a malformed state")
        self.order = state[1]

    def plain(self) -> np.dtype[Any] | None:
        """Return the type if it is a type of plain numbers."""
        found = _NUMERIC.fullmatch(self.code)
        return np.dtype((self.order or found[1]) + found[2]) if found else None


class _Array:
    """Stand for an array or a scalar: its shape, type and bytes, or the items of an array of objects."""

    def __init__(self, shape: Any = (), dtype: Any = None, data: Any = b"", fortran: bool = False) -> None:
        self.shape, self.dtype, self.data, self.fortran = shape, dtype, data, fortran

    def set_state(self, state: Any) -> None:
        if not isinstance(state, tuple) or len(state) != 5:
            raise pickle.UnpicklingError("an array has a malformed state")
        _, self.shape, self.dtype, self.fortran, self.data = state

    def content(self) -> Any:
        """Return an array of numbers, the items of an array of objects, or `NotNumbers`."""
        shape, dtype = self.shape, self.dtype
        if not isinstance(dtype, _Dtype) or not isinstance(shape, tuple) or not all(type(n) is int for n in shape):
            raise pickle.UnpicklingError("an array has no shape or no type")
        if isinstance(self.data, list):
            return self.data[0] if shape == () and len(self.data) == 1 else self.data
        plain = dtype.plain()
        if plain is None:
            return NotNumbers()
        size = math.prod(shape) * plain.itemsize
        if min(shape, default=0) < 0 or not isinstance(self.data, bytes | bytearray) or len(self.data) != size:
            raise pickle.UnpicklingError(f"an array of shape {shape} does not have its {size} bytes")
        numbers = np.frombuffer(self.data, plain)
        return numbers.reshape(shape, order="F" if self.fortran else "C") if shape else numbers[0]


def _reconstruct(*_: Any) -> _Array:
    return _Array()


def _frombuffer(data: Any, dtype: Any, shape: Any, order: Any) -> _Array:
    return _Array(shape, dtype, data, order == "F")


def _scalar(dtype: Any, data: Any = b"") -> _Array:
    return _Array((), dtype, data)


def _never(*_: Any) -> None:
    """Stand for `numpy.ndarray`, which files name as an argument only."""
    raise pickle.UnpicklingError("the pickle calls 'numpy.ndarray', which no grasp needs")


_STAND_INS: Final = {
    **{(f"numpy.{core}.multiarray", "_reconstruct"): _reconstruct for core in ("core", "_core")},
    **{(f"numpy.{core}.multiarray", "scalar"): _scalar for core in ("core", "_core")},
    **{(f"numpy.{core}.numeric", "_frombuffer"): _frombuffer for core in ("core", "_core")},
    ("numpy", "ndarray"): _never,
    ("numpy", "dtype"): _Dtype,
}
#: Instructions that make objects, ask for others, or refer outside of the file.
_REFUSED: Final = (
    *(pickle.INST, pickle.OBJ, pickle.NEWOBJ, pickle.NEWOBJ_EX, pickle.PERSID, pickle.BINPERSID, pickle.EXT1),
    *(pickle.EXT2, pickle.EXT4, pickle.NEXT_BUFFER, pickle.READONLY_BUFFER),
)


# The unpickler in Python, not that in C: its memo is a dictionary, so that a file cannot ask for one of gigabytes.
class _Inert(pickle._Unpickler):
    dispatch: ClassVar = dict(pickle._Unpickler.dispatch)

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in _STAND_INS:
            raise pickle.UnpicklingError(f"the pickle asks for '{module}.{name}', which no grasp needs")
        return _STAND_INS[module, name]

    def _refuse(self: Any) -> None:
        raise pickle.UnpicklingError("the pickle makes objects, which no grasp needs")

    def _build(self: Any) -> None:
        """Give a stand-in its state; the unpickler's own way would set attributes of anything."""
        state = self.stack.pop()
        made = self.stack[-1]
        if not isinstance(made, _Array | _Dtype):
            self._refuse()
        made.set_state(state)

    dispatch[pickle.BUILD[0]] = _build
    dispatch.update(dict.fromkeys((code[0] for code in _REFUSED), _refuse))


def read_pickled_arrays(content: bytes, source: str) -> dict[str, Any]:
    """Return the dictionary that an npy file holds.

    Args:
        content: of the file. source: names it in messages.

    Returns:
        Lists, dictionaries, text, numbers, and arrays of numbers; `NotNumbers` in the place of all other arrays.

    Raises:
        FileError: no npy file, no dictionary, or a pickle that is damaged or contains more than arrays.
    """
    stream = io.BytesIO(content)
    try:
        version = np.lib.format.read_magic(stream)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = read(stream, max_header_size=_LARGEST_HEADER)
    except Exception as error:  # a damaged header can fail in any way
        raise FileError(source, f"not an npy file ({error}).") from None
    if shape != () or not dtype.hasobject:
        raise FileError(source, f"expected one pickled dictionary, got an array of shape {shape}.")
    try:
        loaded = _plain(_Inert(stream).load(), DOCUMENT_DEPTH, [DOCUMENT_VALUES])
    except pickle.UnpicklingError as error:
        raise FileError(source, f"is refused: {error}.") from None
    except Exception as error:  # a damaged pickle can fail in any way
        raise FileError(source, f"the pickle is damaged ({type(error).__name__}: {error}).") from None
    if not isinstance(loaded, dict):
        raise FileError(source, f"expected a dictionary, got {type(loaded).__name__}.")
    return loaded


def _plain(value: Any, depth: int, left: list[int]) -> Any:
    """Return a copy without stand-ins; a value that the pickle names many times counts as many."""
    left[0] -= 1
    if depth < 0 or left[0] < 0:
        raise pickle.UnpicklingError(
            f"it has more than {DOCUMENT_VALUES} values, or more than {DOCUMENT_DEPTH} lists inside each other"
        )
    if isinstance(value, _Array):
        content = value.content()
        return content if isinstance(content, np.ndarray | np.generic) else _plain(content, depth - 1, left)
    if isinstance(value, dict):
        return {key: _plain(item, depth - 1, left) for key, item in value.items() if isinstance(key, str)}
    if isinstance(value, list | tuple):
        return [_plain(item, depth - 1, left) for item in value]
    return value if value is None or isinstance(value, str | bool | int | float | NotNumbers) else NotNumbers()
