"""Records by name lie where the flat arrays say: nothing overlaps, nothing is left over, what is written is seen."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cablecomp.config import load_joint
from cablecomp.effects import extend, term, with_effects
from cablecomp.errors import InputError
from cablecomp.examples import names
from cablecomp.mechanics import records
from cablecomp.mechanics.assemble import Model, assemble

VISCOUS = ("viscous_slip", {"coefficient_Ns_per_m_rad": 50.0})
GUIDED = ("routing_friction", {"mu_angle": 0.2, "arc_length_m": 0.05})


def model(name: str, *effects: tuple[str, dict[str, float]]) -> Model:
    config = with_effects(load_joint(name), effects)
    return assemble(config, extend(config))


@pytest.mark.parametrize("effects", [(), (VISCOUS,), (GUIDED,), (VISCOUS, GUIDED)])
@pytest.mark.parametrize("name", names("joints"))
def test_every_number_of_the_state_has_one_name(
    name: str, effects: tuple[tuple[str, dict[str, float]], ...]
) -> None:
    joint = model(name, *effects)
    memory = np.arange(float(len(joint.memory)))
    d = joint.named(memory, joint.heights)
    parts = [d.states, d.steps, d.guides, d.grids, np.atleast_1d(d.context), np.atleast_1d(d.filter)]
    seen = np.concatenate([*(part.view("f8").ravel() for part in parts), d.profiles.view("f8").ravel()])
    assert len(np.unique(seen)) == len(seen)
    unnamed = np.setdiff1d(memory[: d.size.spare_at], seen)
    head_room = 0 if d.size.grids else 16 * d.size.cables
    assert len(unnamed) == head_room  # no terms here, whose states have names of their own
    assert len(memory) - d.size.spare_at == d.size.steps_at
    assert len(joint.fixed) == d.size.sensor_at + records.floats(records.SENSOR)


def test_what_is_written_by_name_lies_in_the_array() -> None:
    joint = model("snow-closed-rig")
    memory = joint.memory.copy()
    d = joint.named(memory, joint.heights)
    d.states[1].tension = 17.0
    d.context.load = 19.0
    again = joint.named(memory, joint.heights)
    assert (again.states[1].tension, again.context.load) == (17.0, 19.0)
    assert joint.named(joint.memory, joint.heights).states[1].tension == 0.0


@pytest.mark.parametrize("name", names("joints"))
def test_circuits_multiply_to_the_rigid_drive_and_chains_pull_against_each_other(name: str) -> None:
    config = load_joint(name)
    joint = model(name)
    d = joint.named(joint.memory, joint.heights)
    assert math.prod(c.ratio for c in d.circuits) == pytest.approx(config.drive.ratio, rel=1e-15)
    assert sum(c.count * c.chains for c in d.circuits) == len(d.cables)
    for circuit in d.circuits:
        for chain in range(circuit.chains):
            first = circuit.first[chain]
            cables = d.cables[first : first + circuit.count]
            assert set(cables["sign"]) == {1.0 if chain == 0 else -1.0}
            assert math.prod(cables["ratio"]) == pytest.approx(circuit.ratio, rel=1e-15)
            # the output cable's own weight is one turn per radius, and its tension the chain's
            assert cables[-1].weight * cables[-1].radius[records.OUT] == pytest.approx(1.0)
            assert cables[-1].scale == pytest.approx(1.0)


def test_a_term_takes_its_parameters_by_name_and_no_others() -> None:
    @term(parameters=("gain", ("curve", 3)), state=("z", ("past", 5)))
    def follow(c, p, s):  # type: ignore[no-untyped-def]  # the kernel gives them their types
        c.reading += p.gain * p.curve[1] + s.z

    (made,) = follow(gain=2.0, curve=(1.0, 4.0, 9.0))
    assert (made.parameters, made.state_size) == ((2.0, 1.0, 4.0, 9.0), 6)
    for wrong in ({"gain": 2.0}, {"gain": 2.0, "curve": (1.0, 4.0, 9.0), "phase": 0.0}):
        with pytest.raises(InputError, match="term `follow` takes gain, curve, not"):
            follow(**wrong)  # type: ignore[arg-type]  # wrong on purpose
