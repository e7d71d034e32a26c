"""What every effect owes: a neutral value that is the plain drive, one code for all uses, a whole state."""

from __future__ import annotations

import re

import numpy as np
import pytest
from effect_cases import excitation, joint, neutral, run, typical

from cablecomp.effects import catalogue, with_effects
from cablecomp.observer import Observer
from cablecomp.signals import Sample

COVARIATES = {
    "time", "load", "load_direction", "load_rate", "dwell", "reversal", "motor_angle", "joint_angle",
    "velocity", "acceleration", "temperature", "other",
}  # fmt: skip
ROWS = {
    "routing_friction", "viscous_slip", "pretension_relaxation", "thermal_pretension", "bearing_friction",
    "series_compliance", "termination_backlash", "nonlinear_cable", "strand_friction",
    "pressure_dependent_friction", "position_dependent_friction", "pulley_runout", "clock_skew",
    "inertial_load", "gravity_load", "clamp_slip", "strand_break", "crosstalk",
}  # fmt: skip
UNITS = {
    "_s": "s",
    "_rad": "rad", "_Nm": "N m", "_N": "N", "_m": "m", "_degC": "degC", "_per_K": "1/K",
    "_kgm2": "kg m2", "_rad_s": "rad/s",
}  # fmt: skip
JOINTS = ("snow-closed-rig", "snow-open-rig", "two-stage-parallel", "two-stage-series")
EFFECTS = sorted(ROWS)


def test_the_catalogue_has_every_row() -> None:
    assert set(catalogue()) >= ROWS


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_states_itself(name: str) -> None:
    effect = catalogue()[name]
    assert effect.id == name
    assert effect.statement.endswith(".")
    assert effect.equation
    assert effect.source
    assert effect.acts_through
    assert set(effect.acts_through) <= COVARIATES
    names = [p.name for p in effect.parameters]
    assert len(set(names)) == len(names)
    assert any(not p.shape for p in effect.parameters)


@pytest.mark.parametrize("name", EFFECTS)
def test_ranges_are_usable_on_every_joint(name: str) -> None:
    for config in (joint(n) for n in (*JOINTS, "capstan-arm", "tendon-finger")):
        for parameter in catalogue()[name].parameters:
            low, high = parameter.bounds(config)
            assert np.isfinite([low, high]).all()
            assert low < high
            assert not parameter.log or low > 0.0
            assert parameter.minimum <= low
            assert high <= parameter.maximum
            suffix = next(
                (u for u in sorted(UNITS, key=len, reverse=True) if parameter.name.endswith(u)), None
            )
            if suffix and (suffix == "_per_K" or "_per_" not in parameter.name):
                assert parameter.unit == UNITS[suffix]


@pytest.mark.parametrize("moving", [False, True], ids=["locked", "moving"])
@pytest.mark.parametrize("name", EFFECTS)
def test_the_neutral_value_is_the_plain_drive(name: str, moving: bool) -> None:
    for config in (joint(n) for n in JOINTS):
        columns = excitation(config, 300, moving)
        plain, off = run(config, columns), run(config, columns, (name, neutral(name)))
        for key in ("deflection_rad", "tension_h_N", "tension_l_N"):
            scale = np.nanmax(np.abs(plain[key]), initial=1e-300)
            assert np.allclose(off[key], plain[key], rtol=0.0, atol=1e-12 * scale, equal_nan=True)


@pytest.mark.parametrize("name", EFFECTS)
def test_the_effect_acts(name: str) -> None:
    config = joint()
    columns = excitation(config)
    plain = run(config, columns)["deflection_rad"]
    changed = run(config, columns, (name, typical(name, config)))["deflection_rad"]
    assert np.isfinite(changed).all()
    assert np.ptp(changed - plain) > 1e-5 * np.ptp(plain)


@pytest.mark.parametrize("name", EFFECTS)
def test_single_steps_equal_the_block_and_a_snapshot_loses_nothing(name: str) -> None:
    config = joint()
    columns = excitation(config, 240)
    config = with_effects(config, [(name, typical(name, config))])
    block = Observer(config).run(columns)["joint_position_rad"]
    channels = [columns[c] for c in ("time_s", "motor_position_rad", "joint_torque_Nm", "temperature_degC")]
    others = [columns["other_neighbour_Nm"]] if catalogue()[name].texts else []
    observer, steps = Observer(config), []
    for k, (time, motor, load, warm) in enumerate(zip(*channels, strict=True)):
        sample = Sample(time, motor, load, temperature_degC=warm, other=tuple(o[k] for o in others))
        if k % 50 == 7:  # a prediction leaves no trace
            observer.peek(sample._replace(joint_torque_Nm=0.3 * load + 0.1))
        if k == 120:  # neither does a power cycle
            data = observer.snapshot()
            observer = Observer(config)
            observer.restore(data)
        steps.append(observer.step(sample).joint_position_rad)
    assert np.array_equal(steps, block)


@pytest.mark.parametrize("name", EFFECTS)
def test_the_model_does_not_depend_on_how_often_it_is_asked(name: str) -> None:
    config = joint("snow-open-rig")
    columns = excitation(config, 200)
    values = typical(name, config)
    first, second = (run(config, columns, (name, values))["joint_position_rad"] for _ in range(2))
    assert np.array_equal(first, second)


@pytest.mark.parametrize("name", [e for e in EFFECTS if e != "clock_skew"])
def test_inverse_finds_the_load(name: str) -> None:
    """Prescribed deflection -> load, from the same state: the reading that a load gives leads back to it.

    Not with a late joint encoder: its reading does not depend on the present load.
    """
    config = joint()
    columns = excitation(config, 120, moving=False)
    config = with_effects(config, [(name, typical(name, config))])
    observer = Observer(config)
    observer.run({key: value[:90] for key, value in columns.items()})
    other = (float(columns["other_neighbour_Nm"][95]),) if catalogue()[name].texts else ()
    sample = Sample(
        float(columns["time_s"][90]),
        0.0,
        float(columns["joint_torque_Nm"][92]),
        temperature_degC=21.0,
        other=other,
    )
    reading = observer.peek(sample).joint_position_rad
    found = observer.inverse(sample._replace(joint_position_rad=reading, joint_torque_Nm=float("nan")))
    assert found.joint_position_rad == pytest.approx(reading, abs=1e-10)


def test_statements_are_plain_words() -> None:
    for name in EFFECTS:
        assert not re.search(r"[=^]|\bX_", catalogue()[name].statement)
