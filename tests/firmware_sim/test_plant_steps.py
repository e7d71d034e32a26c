"""How a load comes on between two samples is no matter to a plant that knows no rates."""

from __future__ import annotations

import numpy as np
import pytest

from firmware_sim.plant import EffectSpec, PlantConfig, simulate

STEP_S = 0.0078
DRIVE = {
    "output_radius_m": 0.0387, "input_radius_m": 0.01444, "free_length_m": 0.0407, "EA_N": 12940.0,
    "pretension_N": 28.4, "mu_output": 0.044, "mu_input": 0.0546, "wrap_output_rad": 7.57, "wrap_input_rad": 16.2,
}  # fmt: skip
"""Of little pretension and much wrap: a load that comes on within a tenth of a second slides far into the drums."""
REACHED_Nm = (0.0, 0.6, -0.5, 0.0, -0.7, 0.5, 0.0, 0.55, -0.02)
KNEE = EffectSpec("nonlinear_cable:knee", {"place": 0.976, "width": 0.151, "rise": -0.1756})
BREAK = EffectSpec("strand_break", {"fraction": 0.2, "time_s": 3.0})


@pytest.mark.parametrize("effects", [(), (KNEE,), (BREAK,)])
def test_quick_loads_leave_the_same_whether_one_step_or_eight_bring_them_on(
    effects: tuple[EffectSpec, ...],
) -> None:
    time = np.arange(0.0, 7.5, STEP_S)
    begins = 0.8 * np.arange(len(REACHED_Nm))
    corners = np.ravel(np.column_stack((begins, begins + 0.7)))  # 0.1 s from level to level
    config = PlantConfig.from_dict({"drive": {"circuit": "closed", "stage": [DRIVE]}})

    def angle(pieces: int) -> np.ndarray:
        fine = np.arange(0.0, 7.5 - 1e-9, STEP_S / pieces)
        load = np.interp(fine, corners, np.repeat(REACHED_Nm, 2))
        run = simulate(config, fine, 0.9 * np.sin(0.9 * fine), load, effects=effects)
        return np.interp(time, fine, run.channels()["joint_position_rad"])

    whole, parts = angle(1), angle(8)
    loop = float(
        np.ptp(whole - DRIVE["input_radius_m"] / DRIVE["output_radius_m"] * 0.9 * np.sin(0.9 * time))
    )
    assert loop > 5e-3
    assert float(np.max(np.abs(whole - parts))) < 2e-3 * loop
