"""An effect's small function of three records, compiled to machine code that the kernel calls by its address."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from cablecomp.errors import InputError
from cablecomp.mechanics.change import Term
from cablecomp.mechanics.jit import njit
from cablecomp.mechanics.pointer import term_address
from cablecomp.mechanics.records import CONTEXT

TermFunction = Callable[[Any, Any, Any], None]
Names = Sequence[str | tuple[str, int]]
"""Names of numbers; a name with a length is an array."""

_COMPILING = threading.Lock()
"""Of threads that ask for an effect's term at a time, one compiles it: its code lives as long as what it kept of it."""


class CompiledTerm:
    """A term function compiled to machine code when it is first used."""

    def __init__(self, function: TermFunction, parameters: Names, state: Names, rings: Names) -> None:
        self._function = function
        self._parameters = _record(parameters)
        self._state = _record((*state, *rings))
        self._state_size = self._state.itemsize // 8 if state or rings else 0
        self._ring_size = _record(rings).itemsize // 8 if rings else 0
        self._address: int | None = None
        self._entry: Any = None

    @property
    def address(self) -> int:
        """Address of the machine code (compiled or read from the cache on first use)."""
        with _COMPILING:
            if self._address is None:
                self._entry = njit(self._function)
                self._address = term_address(self._entry, CONTEXT, self._parameters, self._state)
            return self._address

    def __call__(self, **values: float | Sequence[float]) -> tuple[Term, ...]:
        """The term with these values of its parameters, as the `terms` of a `Change`; raises InputError for
        other names."""
        names = [name for name in self._parameters.names or () if name != NOTHING]
        if set(values) != set(names):
            raise InputError(
                f"term `{self._function.__name__}` takes {', '.join(names)}, not {', '.join(values)}"
            )
        record = np.zeros(1, self._parameters)
        for name, value in values.items():
            record[name] = value
        return (
            Term(self.address, tuple(record.view(np.float64).tolist()), self._state_size, self._ring_size),
        )


NOTHING = "nothing"  # the field of a record without any: a record cannot be empty


def _record(names: Names) -> np.dtype[Any]:
    fields = [(name, "f8") if isinstance(name, str) else (name[0], "f8", (name[1],)) for name in names]
    return np.dtype(fields or [(NOTHING, "f8")])


def term(parameters: Names, state: Names = (), rings: Names = ()) -> Callable[[TermFunction], CompiledTerm]:
    """Make a function f(c, p, s) a term: c context (`mechanics.records.CONTEXT`), p its parameters, s its own
    state, by name.

    A name with a length, `("readings", 256)`, is an array. The function must add to the context only, and
    change `s` only when `c.commit` is set: the solver calls it several times a step. State starts at zero.

    `rings` are arrays of the state that a refused sample does not put back, so that long ones cost a step nothing:
    the function may write them only where nothing in `state`, as it was before that step, has it read again.
    """
    return lambda function: CompiledTerm(function, parameters, state, rings)
