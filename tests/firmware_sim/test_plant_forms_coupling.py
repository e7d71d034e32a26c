"""Other forms of a coupling between pulley and encoder, against laws worked out apart."""

from __future__ import annotations

import numpy as np
from plant_effect_course import play
from plant_joints import clock, joint

from firmware_sim.plant import EffectSpec, PlantRun, simulate


def test_a_coupling_stiffens_and_a_stop_is_one_sided(plain: PlantRun) -> None:
    path, aside = plain.load_path_Nm, plain.pulley_position_rad - 0.2
    cases = {
        "stiffening": ({"compliance_rad_per_Nm": 1e-3, "knee_Nm": 0.4}, 4e-4 * np.arcsinh(path / 0.4)),
        "softening": (
            {"compliance_rad_per_Nm": 1e-3, "knee_Nm": 0.4},
            1e-3 * path + 2.5e-3 * path * np.abs(path),
        ),
        "staged": (
            {"compliance_rad_per_Nm": 1e-3, "knee_Nm": 0.3, "beyond": 4.0},
            np.where(np.abs(path) < 0.3, 1e-3 * path, np.sign(path) * (4e-3 * np.abs(path) - 9e-4)),
        ),
        "one_way": ({"compliance_rad_per_Nm": 1e-3, "skew": 1.0}, 2e-3 * np.maximum(path, 0.0)),
        "rubber": ({"compliance_rad_per_Nm": 1e-3, "share": 0.5, "lag_s": 0.0}, 1e-3 * path),
        "anisotropic": (
            {"compliance_rad_per_Nm": 1e-3, "swing": 0.6, "phase_rad": 0.4},
            path * (1.6e-3 * np.cos(aside) ** 2 + 4e-4 * np.sin(aside) ** 2),
        ),
    }
    for form, (parameters, expected) in cases.items():
        run = play(f"series_compliance:{form}", **parameters)
        np.testing.assert_allclose(run.joint_position_rad - plain.joint_position_rad, expected, atol=1e-12)


def test_a_diaphragm_bends_at_first_and_is_stretched_the_more_it_turns(plain: PlantRun) -> None:
    law = {"compliance_rad_per_Nm": 1e-3, "knee_Nm": 0.1}
    turned = play("series_compliance:diaphragm", **law).joint_position_rad - plain.joint_position_rad
    borne = turned / 1e-3 + turned**3 / (1e-3 * 1e-4**2)
    np.testing.assert_allclose(borne, plain.load_path_Nm, rtol=1e-7, atol=1e-10)
    assert np.max(np.abs(turned)) > 2e-4  # most of it by what stretches


def test_rubber_gives_way_exponentially_to_a_step_of_load() -> None:
    load, still = np.full(300, 0.5), np.zeros(300)
    load[:100] = 0.0
    config, law = joint(), {"compliance_rad_per_Nm": 2e-2, "share": 0.4, "lag_s": 0.3}
    run = simulate(config, clock(load), still, load, effects=(EffectSpec("series_compliance:rubber", law),))
    late = (
        0.5 - (run.joint_position_rad - simulate(config, clock(load), still, load).joint_position_rad) / 2e-2
    )
    since = clock(load)[100:] - clock(load)[99]
    np.testing.assert_allclose(late[100:], 0.4 * 0.5 * np.exp(-since / 0.3), rtol=0.03, atol=2e-4)


def test_a_bushing_gives_way_over_decades_of_time() -> None:
    load, still = np.full(600, 0.5), np.zeros(600)
    load[:100] = 0.0
    config, law = joint(), {"compliance_rad_per_Nm": 2e-2, "share": 0.6, "lag_s": 0.05}
    run = simulate(config, clock(load), still, load, effects=(EffectSpec("series_compliance:bushing", law),))
    gave = (run.joint_position_rad - simulate(config, clock(load), still, load).joint_position_rad) / 2e-2
    since, rise = clock(load)[100:] - clock(load)[99], clock(load)[100] - clock(load)[99]
    lags = np.array([[0.05], [0.35], [2.45]])  # the load rises over one sample
    left = np.mean(lags / rise * np.expm1(rise / lags) * np.exp(-since / lags), axis=0)
    np.testing.assert_allclose(gave[100:], 0.5 * (0.4 + 0.6 * (1.0 - left)), rtol=1e-3)
