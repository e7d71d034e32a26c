"""Records that lie in a flat array: found where they are, in Python by a view, in compiled code by an address.

Compiled, numpy's slices, views and shapes are a function each for every kind of record, and were a fifth of what there
is to compile.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import impl_ret_borrowed, lower_builtin
from numba.extending import type_callable
from numba.np.arrayobj import make_array, populate_array

from cablecomp.mechanics.records import floats


def records(array: Any, at: int, shape: tuple[int, ...], kind: np.dtype[Any]) -> Any:
    """Array of this shape of records `kind`, which lie in a flat array of 8-byte numbers from place `at` on; writing to
    them writes there. Compiled code looks at no bounds."""
    return array[at : at + math.prod(shape) * floats(kind)].view(kind).reshape(shape)


@type_callable(records)  # type: ignore[untyped-decorator]  # numba is not typed
def _typed(context: Any) -> Any:
    def typer(array: Any, at: Any, shape: Any, kind: Any) -> Any:
        flat = isinstance(array, types.Array) and array.ndim == 1 and array.layout == "C"
        if flat and isinstance(shape, types.UniTuple) and isinstance(kind, types.DType):
            return types.Array(kind.dtype, len(shape), "C")
        return None

    return typer


# numba is not typed here either
@lower_builtin(records, types.Array, types.Integer, types.UniTuple, types.DType)  # type: ignore[untyped-decorator]
def _lowered(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    source_type, at_type, shape_type, _ = signature.args
    result_type = signature.return_type
    source = make_array(source_type)(context, builder, arguments[0])
    at = context.cast(builder, arguments[1], at_type, types.intp)
    shape = cgutils.unpack_tuple(
        builder, context.cast(builder, arguments[2], shape_type, _places(shape_type))
    )
    record = context.get_data_type(result_type.dtype)
    size = context.get_constant(types.intp, context.get_abi_sizeof(record))
    strides = [size]
    for count in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], count))
    result = make_array(result_type)(context, builder)
    pointer = builder.bitcast(builder.gep(source.data, [at]), ir.PointerType(record))
    populate_array(result, data=pointer, shape=shape, strides=strides, itemsize=size, meminfo=None)
    return impl_ret_borrowed(context, builder, result_type, result._getvalue())


def _places(shape: Any) -> Any:
    return types.UniTuple(types.intp, len(shape))
