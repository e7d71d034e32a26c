"""Call compiled code by its address: a new effect never recompiles the kernel, and no caller compiles it again."""

from __future__ import annotations

from typing import Any

import numba
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from cablecomp.mechanics.jit import njit


@intrinsic  # type: ignore[untyped-decorator]  # numba is not typed
def _call(typing: Any, address: Any, data: Any, parameters: Any, state: Any) -> Any:
    signature = types.void(types.int64, types.int64, types.int64, types.int64)

    def generate(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        pointer = ir.PointerType(ir.IntType(64))
        function = ir.FunctionType(ir.VoidType(), [pointer, pointer, pointer])
        target = builder.inttoptr(args[0], function.as_pointer())
        builder.call(target, [builder.inttoptr(a, pointer) for a in args[1:]])
        return context.get_dummy_value()

    return signature, generate


@njit
def call_term(address: int, context: Any, parameters: Any, state: Any) -> None:
    """Run the compiled term at `address` on three float64 arrays (context, its parameters, its state)."""
    _call(address, context.ctypes.data, parameters.ctypes.data, state.ctypes.data)


def _pointer_to(kind: Any) -> Any:
    """A function (address) for compiled code that makes a pointer of it, for `numba.carray`."""
    pointer = types.CPointer(kind)

    def at(_typing: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            return builder.inttoptr(args[0], context.get_value_type(pointer))

        return pointer(types.int64), generate

    return intrinsic(at)


floats_at = _pointer_to(types.float64)
ints_at = _pointer_to(types.int64)


def _caller(result: Any) -> Any:
    """A function (address, arguments) for compiled code that runs a kernel of this result by its address.

    The arguments are a tuple, tuples in it are handed on member by member. An ordinary call would link the callee's
    code into the caller's and compile all of it once more.
    """

    def call(_typing: Any, address: Any, arguments: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            kinds, values = zip(*_members(builder, arguments, args[1]), strict=True)
            convention = context.call_conv
            function = convention.get_function_type(result, kinds)
            target = builder.inttoptr(args[0], function.as_pointer())
            status, value = convention.call_function(builder, target, result, kinds, values)
            with cgutils.if_unlikely(builder, status.is_error):
                convention.return_status_propagate(builder, status)
            return value

        return result(address, arguments), generate

    return intrinsic(call)


def _members(builder: Any, kind: Any, value: Any) -> Any:
    """Types and values of a tuple's members, those of tuples in it included."""
    if not isinstance(kind, types.BaseTuple):
        yield types.unliteral(kind), value
        return
    for member, part in zip(kind.types, cgutils.unpack_tuple(builder, value), strict=True):
        yield from _members(builder, member, part)


call_step_rows = _caller(types.UniTuple(types.int64, 2))
call_bounds_step = _caller(types.UniTuple(types.float64, 2))


def kernel_address(kernel: Any, *arguments: Any) -> int:
    """Address of a kernel's machine code for arguments of these types, compiled or read from the cache if need be."""
    kinds = tuple(numba.typeof(argument) for argument in arguments)
    kernel.compile(kinds)
    compiled = kernel.overloads[kinds]
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


def term_address(function: Any, *records: Any) -> int:
    """Address of a compiled function's machine code as C calls it, for pointers to records of these dtypes; compiled or
    read from the cache if need be."""
    kinds = tuple(numba.from_dtype(record) for record in records)
    function.compile(kinds)
    compiled = function.overloads[kinds]
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_cfunc_wrapper_name))
