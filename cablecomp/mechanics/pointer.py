"""Call a compiled term by its address, so that a new effect never recompiles the kernel."""

from __future__ import annotations

from typing import Any

import numba
from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

TERM_SIGNATURE = types.void(types.voidptr, types.voidptr, types.voidptr)


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


@numba.njit(cache=True)  # type: ignore[untyped-decorator, unused-ignore]
def call_term(address: int, context: Any, parameters: Any, state: Any) -> None:
    """Run the compiled term at `address` on three float64 arrays (context, its parameters, its state)."""
    _call(address, context.ctypes.data, parameters.ctypes.data, state.ctypes.data)
