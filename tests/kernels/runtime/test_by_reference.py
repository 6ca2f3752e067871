"""Tuples lie in memory as compiled code reads them."""

from typing import Any, NamedTuple

import numba
import numpy as np
import pytest
from numba.core.registry import cpu_target

from clench.kernels.runtime.by_reference import Kept, laid_out, type_of


class Flags(NamedTuple):
    first: bool
    second: bool
    third: bool


class Inner(NamedTuple):
    is_on: bool
    rows: Any
    flags: Flags


class Outer(NamedTuple):
    flags: Flags
    count: int
    inner: Inner
    length: float
    last: bool
    planes: Any
    none: Any


VALUE = Outer(
    Flags(True, False, True),
    7,
    Inner(True, np.arange(6.0).reshape(2, 3), Flags(False, True, True)),
    0.25,
    True,
    np.arange(24, dtype=np.int32).reshape(2, 3, 4)[:, ::-1, ::2],
    np.empty((0, 3)),
)


@numba.njit
def read(o):
    flags, inner = o.flags, o.inner
    bits = (flags.first, flags.second, flags.third, inner.is_on, inner.flags.first, inner.flags.second, o.last)
    return bits, o.count, o.length, inner.rows[1, 2], o.planes[1, 0, 1], o.planes.shape, o.none.shape, inner.rows.size


def test_a_kernel_reads_every_field_of_a_kept_tuple() -> None:
    expected = read.py_func(VALUE)
    assert read(Kept(VALUE)) == expected
    assert expected[4] == VALUE.planes[1, 0, 1] == 22


@pytest.mark.parametrize("value", [VALUE, VALUE.inner, VALUE.flags])
def test_a_tuple_takes_as_much_room_as_the_compiler_says(value) -> None:
    context: Any = cpu_target.target_context
    kind = context.get_value_type(numba.typeof(value))
    assert len(laid_out(value)[0]) == context.get_abi_sizeof(kind)
    assert laid_out(value)[1] == context.get_abi_alignment(kind)


def read_only() -> Any:
    rows = np.zeros((2, 3))
    rows.flags.writeable = False
    return rows


@pytest.mark.parametrize(
    "value",
    [
        VALUE,
        VALUE._replace(count=1.5),
        VALUE._replace(planes=read_only()),
        Inner(False, np.zeros((3, 2), order="F"), VALUE.flags),
        (np.zeros(3), 1),
        (np.zeros(3), np.zeros(3)),
        (),
        np.zeros((2, 3)),
        np.zeros((2, 3)).T,
        np.zeros((4, 6))[::2, ::2],
        np.zeros(2, dtype=np.uint8),
        np.zeros(2, dtype=np.int32),
        np.zeros(2, dtype=np.complex128),
        read_only(),
        True,
        2,
        Kept(VALUE),
    ],
)
def test_types_are_those_that_numba_finds(value: Any) -> None:
    assert type_of(value) == numba.typeof(value)
    assert type_of(value) is type_of(value)
