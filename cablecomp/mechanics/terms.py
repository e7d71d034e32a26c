"""The terms of further physics, run: what they see of the cables, what they add, how exactly their moment is met."""

from __future__ import annotations

import math

from cablecomp.mechanics.drive import Drive, Terms
from cablecomp.mechanics.jit import inner_kernel
from cablecomp.mechanics.pointer import call_term

EPSILON = 2.3e-16
"""Last digit of 1."""


@inner_kernel
def run_terms(d: Drive, terms: Terms) -> None:
    """Let every term add its part to the context."""
    x = d.context
    x.moment = x.moment_slope = x.length_h = x.length_l = 0.0
    x.pretension_h = x.pretension_l = x.stiffness_h = x.stiffness_l = 1.0
    x.reading = x.motor_moment = 0.0
    context = terms.memory[d.size.context_at :]
    for k in range(d.size.terms):
        call = terms.calls[k]
        call_term(
            call.address, context, terms.parameters[call.parameters_at :], terms.memory[call.state_at :]
        )


@inner_kernel
def show_tensions(d: Drive) -> None:
    """Write the tensions at the output pulley into the context."""
    circuit = d.circuits[d.size.circuits - 1]
    d.context.tension_h = d.states[circuit.first[0] + circuit.count - 1].tension
    d.context.tension_l = math.nan
    if circuit.chains == 2:
        d.context.tension_l = d.states[circuit.first[1] + circuit.count - 1].tension


@inner_kernel
def balance(d: Drive, moment: float) -> float:
    """How exactly a moment [N m] on the drum can meet the load less what the terms take: to the last digits of moments
    and angle."""
    x = d.context
    return 1e-12 * (abs(x.load) + abs(moment)) + 1e-15 + 4.0 * EPSILON * abs(x.moment_slope * x.joint)
