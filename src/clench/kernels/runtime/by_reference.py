"""How kernels hand arrays on: a pointer to a tuple of arrays instead of every number of every array.

A hand, an object and the scratch space are hundreds of numbers: handing them over took longer than what many short
functions do. A kernel that calls another one therefore passes the address of a tuple. Python does the same with the
values that it `keeps`.
"""

from __future__ import annotations

import struct
from functools import cached_property
from typing import Any, Final, TypeVar, cast

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    intrinsic,
    lower_cast,
    lower_getattr_generic,
    models,
    overload,
    register_model,
    typeof_impl,
    unbox,
)

Content = TypeVar("Content")
#: Size and alignment of numbers and addresses [bytes].
_WORD: Final = 8
#: Types by what `_key` returns.
_TYPES: Final[dict[Any, Any]] = {}


class ByReference(types.Type):
    """The type of a pointer to a tuple with names."""

    def __init__(self, content: types.NamedTuple) -> None:
        self.content = content
        super().__init__(name=f"ByReference({content.name})")

    @property
    def key(self) -> Any:
        """The key that two equal types share."""
        return self.content

    @cached_property
    def _hash(self) -> int:
        return super().__hash__()

    def __hash__(self) -> int:
        """Be found in sets without asking every array of the tuple: every call of a kernel does so."""
        return self._hash

    def __getstate__(self) -> dict[str, Any]:
        """Be kept on disk without the hash, which is another one in every process."""
        return {name: value for name, value in self.__dict__.items() if name != "_hash"}


@register_model(ByReference)
class ByReferenceModel(models.PrimitiveModel):
    """A pointer to the tuple as kernels hold it."""

    def __init__(self, manager: Any, by_reference: ByReference) -> None:
        content = manager.lookup(by_reference.content).get_value_type()
        super().__init__(manager, by_reference, content.as_pointer())


def by_reference(kind: Any) -> Any:
    """Return the type by which a kernel hands a value on: a pointer for tuples that have arrays."""
    if isinstance(kind, types.NamedTuple) and any(isinstance(t, types.Array | types.NamedTuple) for t in kind.types):
        return ByReference(kind)
    return types.unliteral(kind)


def handed_on(kind: Any) -> Any:
    """Return the type by which a kernel hands an argument on: see `by_reference`; whole numbers have 64 bits."""
    kind = by_reference(kind)
    return types.int64 if isinstance(kind, types.Integer) and kind is not types.uint64 else kind


@infer_getattr
class ByReferenceAttribute(AttributeTemplate):
    """The fields of the tuple; a tuple inside is handed on, too."""

    key = ByReference

    def generic_resolve(self, pointer: ByReference, name: str) -> Any:
        """Return the type of a field, or None where there is none."""
        fields = pointer.content.fields
        return by_reference(pointer.content.types[fields.index(name)]) if name in fields else None


@lower_getattr_generic(ByReference)
def read_field(context: Any, builder: ir.IRBuilder, pointer: ByReference, value: Any, name: str) -> Any:
    """Read a field, or point to it."""
    index = pointer.content.fields.index(name)
    kind, place = pointer.content.types[index], cgutils.gep_inbounds(builder, value, 0, index)
    if kind is not by_reference(kind) and isinstance(by_reference(kind), ByReference):
        return place
    return impl_ret_borrowed(context, builder, kind, builder.load(place))


@lower_cast(types.NamedTuple, ByReference)
def pass_on(context: Any, builder: ir.IRBuilder, given: Any, wanted: Any, value: Any) -> Any:
    """Put a tuple where it can be pointed to, for as long as the calling kernel runs."""
    return cgutils.alloca_once_value(builder, value)


def by_value(pointed: Any) -> Any:
    """Return a tuple that was handed on as a value, to be a field of another one; without compiling it is one."""
    return pointed


@overload(by_value)
def by_value_of(pointed: Any) -> Any:
    """Return how kernels do it."""
    if isinstance(pointed, ByReference):

        def read(pointed: Any) -> Any:
            return read_value(pointed)

        return read

    def keep(pointed: Any) -> Any:
        return pointed

    return keep


@intrinsic
def read_value(context: Any, pointed: ByReference) -> Any:
    """Read a tuple."""

    def read(context: Any, builder: ir.IRBuilder, signature: Any, given: Any) -> Any:
        return impl_ret_borrowed(context, builder, signature.return_type, builder.load(given[0]))

    return pointed.content(pointed), read


class Kept:
    """A tuple of arrays where kernels find it by one pointer; the arrays live as long as this does."""

    def __init__(self, content: Any) -> None:
        self.content = content
        self.kind = ByReference(type_of(content))
        self._room = np.frombuffer(laid_out(content)[0], dtype=np.uint8)
        self.address = self._room.__array_interface__["data"][0]


def type_of(value: Any) -> Any:
    """Return what `numba.typeof` returns; the types of arrays and tuples are made once.

    For the first array, Numba loads NumPy's masked arrays. For every tuple, it asks each array in it for its type.
    """
    key = _key(value)
    if key not in _TYPES:
        _TYPES[key] = _new_type(value)
    return _TYPES[key]


def _new_type(value: Any) -> Any:
    if _is_array(value):
        layout: Any = "C" if value.flags.c_contiguous else "F" if value.flags.f_contiguous else "A"
        return types.Array(numba.from_dtype(value.dtype), value.ndim, layout, readonly=not value.flags.writeable)
    if isinstance(value, tuple):
        return types.BaseTuple.from_types([type_of(part) for part in value], type(value))
    return numba.typeof(value)


def _key(value: Any) -> Any:
    """Return what tells the type of a value."""
    if _is_array(value):
        flags = value.flags
        return value.dtype.str, value.ndim, flags.c_contiguous, flags.f_contiguous, flags.writeable
    return (type(value), *map(_key, value)) if isinstance(value, tuple) else numba.typeof(value)


def _is_array(value: Any) -> bool:
    return type(value) is np.ndarray and value.dtype.kind in "biuf"


def kept(content: Content) -> Content:
    """Return a tuple so that a kernel called with it reads no more than a pointer; without compiling it is itself."""
    config: Any = numba.config
    return content if config.DISABLE_JIT else cast(Content, Kept(content))


def laid_out(value: Any) -> tuple[bytes, int]:
    """Return a value as compiled code has it in memory, and its alignment [bytes].

    Arrays name no owner, so kernels that count references leave them alone.

    Args:
        value: array, number, or tuple of values.
    """
    if isinstance(value, np.ndarray):
        address = value.__array_interface__["data"][0]
        words = (0, 0, value.size, value.itemsize, address, *value.shape, *value.strides)
        return struct.pack(f"{len(words)}q", *words), _WORD
    if isinstance(value, tuple):
        room, most = b"", 1
        for part in value:
            content, alignment = laid_out(part)
            room += bytes(-len(room) % alignment) + content
            most = max(most, alignment)
        return room + bytes(-len(room) % most), most
    if isinstance(value, bool | np.bool_):
        return struct.pack("?", value), 1
    return struct.pack("d" if isinstance(value, float) else "q", value), _WORD


@typeof_impl.register(Kept)
def type_of_kept(value: Kept, context: Any) -> ByReference:
    """Return what kernels take it for."""
    return value.kind


@unbox(ByReference)
def point_to(kind: ByReference, value: Any, c: Any) -> Any:
    """Return the pointer to a tuple that is kept."""
    number = c.pyapi.object_getattr_string(value, "address")
    address = c.pyapi.long_as_longlong(number)
    c.pyapi.decref(number)
    return NativeValue(c.builder.inttoptr(address, c.context.get_value_type(kind)))
