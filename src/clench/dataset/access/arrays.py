"""Columns of a dataset as NumPy arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.core.exceptions import ClenchError
from clench.core.files.file_limits import ARRAY_BYTES
from clench.dataset.storage.columns import COLUMNS

if TYPE_CHECKING:
    import pyarrow

Array = NDArray[Any]
#: Code of an unknown truth value beside 0 and 1.
UNKNOWN: Final = -1


def to_arrays(table: pyarrow.Table) -> dict[str, Array]:
    """Return the columns of a table; rows come first.

    Numbers that are null are NaN. Lists are padded with NaN to the longest of the table. A truth value that may be null
    is 1, 0, or -1 for null. Text is an array of objects, and lists of text are lists.

    Args:
        table: some columns of a dataset.

    Raises:
        ClenchError: a list is so long that the padded array would not fit into memory.
    """
    return {name: _array(table.column(name).combine_chunks(), COLUMNS[name].type) for name in table.column_names}


def spans(column: pyarrow.Array, kind: str) -> tuple[Array, Array]:
    """Return the elements of all lists of a column one after another, and where each list begins, shape (N + 1,).

    A list that is null is empty.

    Args:
        column: a column of lists. kind: its type in `COLUMNS`.
    """
    lengths = _lengths(column)
    return _elements(column, kind), np.concatenate([[0], np.cumsum(lengths)])


def _array(column: pyarrow.Array, kind: str) -> Array:
    import pyarrow as pa
    import pyarrow.compute as pc

    if kind in ("text", "texts"):
        found = np.empty(len(column), dtype=object)
        found[:] = column.to_pylist()
        return found
    if kind == "truth":
        if not column.null_count:
            return np.asarray(column.to_numpy(zero_copy_only=False))
        return np.asarray(pc.fill_null(column.cast(pa.int8()), UNKNOWN).to_numpy(zero_copy_only=False))
    if kind == "number":
        return np.asarray(pc.fill_null(column, float("nan")).to_numpy(zero_copy_only=False))
    if kind == "whole":
        return np.asarray(column.to_numpy(zero_copy_only=False))
    if kind == "pose":
        return np.asarray(column.flatten().to_numpy(zero_copy_only=False)).reshape(-1, 7)
    lengths, elements = _lengths(column), _elements(column, kind)
    longest = int(lengths.max(initial=0))
    if 8 * 3 * len(column) * longest > ARRAY_BYTES:
        raise ClenchError(f"A list of {longest} elements is too long for a batch of {len(column)} rows.")
    padded = np.full((len(column), longest, *elements.shape[1:]), np.nan)
    padded[np.arange(padded.shape[1]) < lengths[:, None]] = elements
    return padded


def _lengths(column: pyarrow.Array) -> NDArray[np.int64]:
    import pyarrow.compute as pc

    lengths = pc.fill_null(pc.list_value_length(column), 0)
    return np.asarray(lengths.to_numpy(zero_copy_only=False), dtype=np.int64)


def _elements(column: pyarrow.Array, kind: str) -> Array:
    flat = column.flatten()
    if kind == "texts":
        found = np.empty(len(flat), dtype=object)
        found[:] = flat.to_pylist()
        return found
    if kind == "points":
        return np.asarray(flat.flatten().to_numpy(zero_copy_only=False)).reshape(-1, 3)
    return np.asarray(flat.to_numpy(zero_copy_only=False))
