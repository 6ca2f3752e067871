"""How kernels hand arrays on: a pointer to a tuple of arrays instead of every number of every array.

A hand, an object and the scratch space are hundreds of numbers: handing them over took longer than what many short
functions do. So a kernel that calls another one hands over where a tuple is.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    infer_getattr,
    intrinsic,
    lower_cast,
    lower_getattr_generic,
    models,
    overload,
    register_model,
)


class Handed(types.Type):
    """The type of a pointer to a tuple with names."""

    def __init__(self, content: types.NamedTuple) -> None:
        self.content = content
        super().__init__(name=f"Handed({content.name})")

    @property
    def key(self) -> Any:
        """What two equal types have in common."""
        return self.content


@register_model(Handed)
class HandedModel(models.PrimitiveModel):
    """A pointer to the tuple as kernels hold it."""

    def __init__(self, manager: Any, handed: Handed) -> None:
        content = manager.lookup(handed.content).get_value_type()
        super().__init__(manager, handed, content.as_pointer())


def handed(kind: Any) -> Any:
    """Return the type by which a kernel hands a value on: a pointer for tuples that have arrays."""
    if isinstance(kind, types.NamedTuple) and any(isinstance(t, types.Array | types.NamedTuple) for t in kind.types):
        return Handed(kind)
    return types.unliteral(kind)


@infer_getattr
class HandedAttribute(AttributeTemplate):
    """The fields of the tuple; a tuple inside is handed on, too."""

    key = Handed

    def generic_resolve(self, pointer: Handed, name: str) -> Any:
        """Return the type of a field, or None where there is none."""
        fields = pointer.content.fields
        return handed(pointer.content.types[fields.index(name)]) if name in fields else None


@lower_getattr_generic(Handed)
def read_field(context: Any, builder: ir.IRBuilder, pointer: Handed, value: Any, name: str) -> Any:
    """Read a field, or point to it."""
    index = pointer.content.fields.index(name)
    kind, place = pointer.content.types[index], cgutils.gep_inbounds(builder, value, 0, index)
    if kind is not handed(kind) and isinstance(handed(kind), Handed):
        return place
    return impl_ret_borrowed(context, builder, kind, builder.load(place))


@lower_cast(types.NamedTuple, Handed)
def hand_on(context: Any, builder: ir.IRBuilder, given: Any, wanted: Any, value: Any) -> Any:
    """Put a tuple where it can be pointed to, for as long as the calling kernel runs."""
    return cgutils.alloca_once_value(builder, value)


def whole(pointed: Any) -> Any:
    """Return a tuple that was handed on as a value, to be a field of another one; without compiling it is one."""
    return pointed


@overload(whole)
def whole_of(pointed: Any) -> Any:
    """Return how kernels do it."""
    if isinstance(pointed, Handed):

        def read(pointed: Any) -> Any:
            return read_whole(pointed)

        return read

    def keep(pointed: Any) -> Any:
        return pointed

    return keep


@intrinsic
def read_whole(context: Any, pointed: Handed) -> Any:
    """Read a tuple."""

    def read(context: Any, builder: ir.IRBuilder, signature: Any, given: Any) -> Any:
        return impl_ret_borrowed(context, builder, signature.return_type, builder.load(given[0]))

    return pointed.content(pointed), read
