"""Physics beyond the thesis's drive: one file per effect, found by name.

Imports the kernel and what lies below. Start reading at `base.py`, the contract, then any effect.
"""

from cablecomp.effects.base import Change, Effect, Parameter
from cablecomp.effects.catalogue import catalogue, extend, load_effects, register, with_effects
from cablecomp.effects.compiled_term import term

__all__ = [
    "Change",
    "Effect",
    "Parameter",
    "catalogue",
    "extend",
    "load_effects",
    "register",
    "term",
    "with_effects",
]
