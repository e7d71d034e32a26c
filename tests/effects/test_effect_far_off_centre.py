"""A pulley far off its centre: cable lengths and lever arm follow the angle that they are to find."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from effect_cases import joint, register_alone, run, second_differences, still, unit
from scipy.optimize import brentq

from cablecomp.effects import term, with_effects
from cablecomp.observer import Observer
from cablecomp.signals import Sample

PHASE = 0.6


@pytest.mark.parametrize(
    ("share", "order"),
    [(0.01, 1.0), (0.25, 1.0), (0.6, 1.0), (0.9, 1.0), (-0.9, 1.0), (0.1, 5.0), (-0.3, 2.0)],
)
def test_the_angle_winds_up_what_the_motor_lets_out(share: float, order: float) -> None:
    """R q + e (sin(k q + φ) - sin φ) is what the drive on its centre winds up; steps of 0.1 rad through two turns."""
    config = joint("tendon-finger", wrap_output_rad=40.0, wrap_input_rad=60.0)
    radius = config.drive.stage[0].output_radius_m
    time = np.linspace(0.0, 1.0, 130)
    columns = still(time, np.zeros_like(time), motor=4.0 * np.pi * time / config.drive.ratio)
    effect = ("pulley_runout", {"eccentricity_m": share * radius, "phase_rad": PHASE, "order": order})
    found = run(config, columns, effect)["joint_position_rad"]

    def beyond(q: float, wound: float) -> float:
        return q + share * (math.sin(order * q + PHASE) - math.sin(PHASE)) - wound

    wound = run(config, columns)["joint_position_rad"]
    expected = [brentq(beyond, w - 3.0, w + 3.0, args=(w,), xtol=1e-14, rtol=1e-14) for w in wound]
    assert found == pytest.approx(np.array(expected), abs=1e-10)


@term(parameters=("channel",))
def wind_up(c: Any, p: Any, s: Any) -> None:
    c.length_h += c.other[int(p.channel)]
    c.length_l -= c.other[int(p.channel)]


@pytest.mark.parametrize("share", [0.25, -0.25])
@pytest.mark.parametrize(
    "name", ["snow-closed-rig", "snow-open-rig", "two-stage-series", "two-stage-parallel"]
)
def test_the_angle_is_what_repeated_substitution_ends_at(
    name: str, share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same drive, told the length and the moment by hand, sample by sample, until nothing moves any more."""
    register_alone(monkeypatch, "told", "amount", lambda v: wind_up(channel=v["channel"]), "channel")
    config = joint(name)
    radius = config.drive.stage[-1].output_radius_m
    eccentricity = min(max(share * radius, -0.01), 0.01)  # as far as the law goes
    hanging = unit(config) if config.drive.circuit == "open" else 0.0
    time = np.linspace(0.0, 2.0, 60)
    motor = 0.9 / config.drive.ratio * np.sin(3.0 * time)
    load = 0.6 * unit(config) * np.sin(7.0 * time)
    told = Observer(with_effects(config, [("told", {"amount": 1.0, "channel": "other_length"})]))
    expected = []
    q = 0.0
    for t, m, moment in zip(time, motor, load, strict=True):
        for _ in range(200):
            before = q
            arm = eccentricity * math.cos(q + PHASE)
            wound = eccentricity * (math.sin(q + PHASE) - math.sin(PHASE))
            carried = moment - (moment + hanging) * arm / (radius + arm)
            sample = Sample(t, m, carried, other=(wound,))
            q = told.peek(sample).joint_position_rad
            if abs(q - before) < 1e-13:
                break
        else:
            pytest.fail("the substitution does not settle")
        expected.append(told.step(sample).joint_position_rad)
    effect = ("pulley_runout", {"eccentricity_m": eccentricity, "phase_rad": PHASE})
    found = run(config, still(time, load, motor=motor), effect)["joint_position_rad"]
    assert found == pytest.approx(np.array(expected), abs=1e-10)


@pytest.mark.parametrize("name", ["tendon-finger", "snow-closed-rig"])
def test_weight_and_inertia_pull_at_the_arm_that_the_angle_gives(name: str) -> None:
    """Run-out, weight and inertia together are the run-out alone under the load that the other two leave."""
    config = joint(name, output_radius_m=0.03)
    time = np.linspace(0.0, 1.0, 1000)
    load = 0.4 * unit(config) * np.sin(7.0 * time)
    columns = still(time, load, motor=0.6 / config.drive.ratio * np.sin(2.6 * time))
    runout = ("pulley_runout", {"eccentricity_m": 0.0075, "phase_rad": PHASE})
    weight, inertia = 0.3 * unit(config), 5e-4 * unit(config)
    found = run(
        config,
        columns,
        runout,
        ("gravity_load", {"moment_Nm": weight, "phase_rad": 0.7}),
        ("inertial_load", {"inertia_kgm2": inertia}),
    )["joint_position_rad"]
    left = load - weight * np.sin(found + 0.7) - inertia * second_differences(time, found)
    expected = run(config, {**columns, "joint_torque_Nm": left}, runout)["joint_position_rad"]
    assert found == pytest.approx(expected, abs=1e-10)
