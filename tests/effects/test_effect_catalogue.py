"""Effects in a configuration: found by name, checked key by key, put together in a fixed order."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from effect_cases import excitation, joint, neighbour_Nm, neutral, run, typical

from cablecomp.config import EffectEntry
from cablecomp.effects import catalogue, extend, with_effects
from cablecomp.effects.catalogue import acts_through, is_bounded, other_channels
from cablecomp.errors import InputError

BEARING = {"torque_Nm": 0.1, "load_coefficient": 0.01, "presliding_rad": 1e-4}
LEAK = {"channel": "other_neighbour_Nm", "load_coefficient": 0.2}


def refusal(*effects: tuple[str, dict[str, Any]]) -> str:
    with pytest.raises(InputError) as caught:
        extend(with_effects(joint(), effects))
    text = str(caught.value)
    assert "\n" not in text
    return text


def test_an_unknown_id_is_answered_with_the_nearest() -> None:
    assert "did you mean `bearing_friction`" in refusal(("bearing_frction", BEARING))
    assert "known are" in refusal(("zzz", {}))


def test_an_unknown_or_missing_key_is_named() -> None:
    assert "unknown key `effect.torque`" in refusal(("bearing_friction", {**BEARING, "torque": 1.0}))
    assert "lacks key `torque_Nm`" in refusal(
        ("bearing_friction", {k: v for k, v in BEARING.items() if k != "torque_Nm"})
    )


def test_what_a_law_needs_beside_its_amount_is_named() -> None:
    weight = {"moment_Nm": 0.1, "phase_rad": 0.0, "tilt_rad_per_unit": 0.5}
    assert "lacks key `channel`, what turns the joint's base" in refusal(("gravity_load", weight))
    assert "lacks key `holds_l_N`, the tension" in refusal(("clamp_slip", {"creep_l_m_per_Ns": 1e-6}))
    stiff_again = {"stiffening": 0.5, "again": 2.0}
    assert "has `again` and no `knee`" in refusal(("nonlinear_cable", stiff_again))
    extend(with_effects(joint(), [("nonlinear_cable", {**stiff_again, "knee": 0.8})]))


@pytest.mark.parametrize(
    ("effect", "given", "accepted"),
    [
        ("strand_break", {"fraction": -0.2, "time_s": 1.0}, "`effect.fraction` is -0.2.*0 to 0.95"),
        ("clamp_slip", {"slip_m": -1e-4, "time_s": 1.0}, "`effect.slip_m` is -0.0001.*0 to 0.1"),
        ("clamp_slip", {"creep_l_m_per_Ns": 1e-6, "holds_l_N": 9.0}, "creep_l_m_per_Ns` is 1e-06.* 0 "),
    ],
)
def test_an_open_circuit_has_no_cable_l_to_which_something_happens(
    effect: str, given: dict[str, Any], accepted: str
) -> None:
    """In a closed circuit the same is taken."""
    extend(with_effects(joint(), [(effect, given)]))
    with pytest.raises(InputError, match=rf"{accepted}.*is accepted"):
        extend(with_effects(joint("snow-open-rig"), [(effect, given)]))


def test_an_effect_has_to_say_how_much_even_where_each_of_its_amounts_may_be_left_out() -> None:
    """A groove may be rough on either drum alone, so neither amplitude is asked for by itself."""
    text = refusal(("position_dependent_friction", {"phase_rad": 0.5}))
    assert "says not how much; add `amplitude` or `input_amplitude`" in text
    extend(with_effects(joint(), [("position_dependent_friction", {"input_amplitude": 0.1})]))


@pytest.mark.parametrize("value", [float("nan"), float("inf"), "much", True, None, [1.0]])
def test_only_finite_numbers_are_taken(value: object) -> None:
    text = refusal(("bearing_friction", {**BEARING, "torque_Nm": value}))
    assert "`effect.torque_Nm`" in text
    assert "finite number" in text


@pytest.mark.parametrize(
    ("name", "key", "value"),
    [
        ("bearing_friction", "torque_Nm", -1e-6),
        ("bearing_friction", "presliding_rad", 0.0),
        ("pretension_relaxation", "time_constant_s", 0.0),
        ("pretension_relaxation", "fraction", 0.9),
        ("nonlinear_cable", "stiffening", 1.2),
        ("strand_friction", "yield_N", 0.0),
        ("strand_break", "fraction", 1.0),
        ("position_dependent_friction", "amplitude", -1.0),
        ("pressure_dependent_friction", "exponent", 1.0),
        ("pulley_runout", "eccentricity_m", 0.5),
        ("inertial_load", "inertia_kgm2", -1.0),
        ("series_compliance", "compliance_rad_per_Nm", -1.0),
        ("termination_backlash", "gap_rad", -0.1),
        ("clock_skew", "delay_s", 3.0),
    ],
)
def test_values_that_a_law_cannot_take_are_refused(name: str, key: str, value: float) -> None:
    text = refusal((name, {**typical(name, joint()), key: value}))
    assert f"`effect.{key}` is {value!r}" in text
    assert "is accepted" in text


def test_the_channel_of_crosstalk_must_be_a_further_channel() -> None:
    assert "`other_<name>` is accepted" in refusal(("crosstalk", {**LEAK, "channel": "motor_current_A"}))
    assert "`other_<name>` is accepted" in refusal(("crosstalk", {**LEAK, "channel": 7}))
    assert "lacks key `channel`" in refusal(("crosstalk", {"load_coefficient": 0.1}))
    many = [("crosstalk", {**LEAK, "channel": f"other_{k}"}) for k in range(5)]
    assert "one channel too many" in refusal(*many)


def test_two_strand_frictions_make_no_sense() -> None:
    strand = ("strand_friction", {"fraction": 0.1, "yield_N": 1.0})
    assert "given twice" in refusal(strand, strand)


def test_with_effects_changes_the_effects_alone() -> None:
    config = joint()
    rich = with_effects(config, [("bearing_friction", BEARING), ("crosstalk", LEAK)])
    assert config.effect == ()
    assert [e.id for e in rich.effect] == ["bearing_friction", "crosstalk"]
    assert rich.effect[0].parameters == BEARING
    assert rich.drive is config.drive
    assert rich.effect[0] == EffectEntry.model_validate({"id": "bearing_friction", **BEARING})
    assert with_effects(rich, []) == config
    assert other_channels(rich) == ["other_neighbour_Nm"]


def test_the_order_in_the_configuration_does_not_matter() -> None:
    config = joint()
    columns = excitation(config, 300)
    names = (
        "clock_skew",
        "pulley_runout",
        "termination_backlash",
        "bearing_friction",
        "crosstalk",
        "gravity_load",
    )
    effects = [(name, typical(name, config)) for name in names]
    ahead = run(config, columns, *effects)["joint_position_rad"]
    back = run(config, columns, *effects[::-1])["joint_position_rad"]
    assert ahead == pytest.approx(back, abs=1e-12)


def test_effects_at_their_neutral_value_cost_nothing() -> None:
    config = joint()
    found = extend(
        with_effects(config, [(name, neutral(name)) for name in catalogue() if name != "strand_friction"])
    )
    assert found is not None
    assert found.terms == ()
    assert found.extra_length_m == 0.0


def test_covariates_of_crosstalk_name_its_channel() -> None:
    rich = with_effects(joint(), [("crosstalk", LEAK), ("clock_skew", {"delay_s": 0.0})])
    assert acts_through(rich.effect[0]) == ("other:neighbour_Nm",)
    assert acts_through(rich.effect[1]) == ("velocity", "load_rate")


def test_bounds_are_promised_only_where_order_is_preserved() -> None:
    config = joint()
    assert is_bounded(with_effects(config, [("series_compliance", {"compliance_rad_per_Nm": 1e-3})]))
    assert not is_bounded(with_effects(config, [("bearing_friction", BEARING)]))
    rubs = with_effects(config, [("motor_friction", {"torque_Nm": 0.1, "presliding_rad": 0.1})])
    at_motor = rubs.observer.model_copy(update={"load": "motor_torque"})
    assert is_bounded(rubs)
    assert not is_bounded(rubs.model_copy(update={"observer": at_motor}))  # how it slid before is not known
    # by which parameters, where it depends on these
    for effect, plain, further in (
        ("clamp_slip", {"slip_m": 1e-4, "time_s": 1.0}, {"creep_m_per_Ns": 1e-6, "holds_N": 60.0}),
        ("crosstalk", LEAK, {"growth_per_rad": 0.3}),
    ):
        assert is_bounded(with_effects(config, [(effect, plain)]))
        assert not is_bounded(with_effects(config, [(effect, {**plain, **further})]))


@pytest.mark.parametrize("name", sorted(set(catalogue()) - {"routing_friction", "viscous_slip"}))
def test_a_vanishing_value_changes_vanishingly(name: str) -> None:
    """The plain drive is nested: no jump between switched off and hardly there.

    Two have laws of their own about it: a guide adds its length, viscous slip the grain of its grid.
    """
    config = joint()
    columns = excitation(config, 300)
    values = typical(name, config)
    for parameter in catalogue()[name].parameters:
        if not parameter.shape:
            values[parameter.name] = 1e-9 * parameter.bounds(config)[1]
            if parameter.per_reading:
                values[parameter.name] /= neighbour_Nm(config)
    plain = run(config, columns)["deflection_rad"]
    slight = run(config, columns, (name, values))["deflection_rad"]
    assert np.abs(slight - plain).max() < 1e-5 * np.ptp(plain)
