"""Guides in joints of several stages: each guide's share is kept from the shafts before it."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from effect_cases import Columns, still

from cablecomp.config import JointConfig, parse_joint
from cablecomp.effects import with_effects
from cablecomp.observer import Observer
from cablecomp.signals import Sample
from firmware_sim.plant import COARSE, EffectSpec, PlantConfig, StageConfig, simulate

STAGES: tuple[dict[str, float], ...] = (
    {
        "output_radius_m": 0.03, "input_radius_m": 0.015, "free_length_m": 0.06, "EA_N": 1e5,
        "pretension_N": 40.0, "mu_output": 0.12, "mu_input": 0.15, "wrap_output_rad": 9.0, "wrap_input_rad": 16.0,
    },
    {
        "output_radius_m": 0.05, "input_radius_m": 0.02, "free_length_m": 0.05, "EA_N": 2e5,
        "pretension_N": 70.0, "mu_output": 0.14, "mu_input": 0.11, "wrap_output_rad": 8.0, "wrap_input_rad": 12.0,
    },
    {
        "output_radius_m": 0.04, "input_radius_m": 0.03, "free_length_m": 0.08, "EA_N": 1.5e5,
        "pretension_N": 60.0, "mu_output": 0.1, "mu_input": 0.13, "wrap_output_rad": 8.0, "wrap_input_rad": 10.0,
    },
)  # fmt: skip
ARC = 0.005  # m of cable on a guide
KINDS = (("closed", "series"), ("closed", "parallel"), ("open", "series"))


def drive(circuit: str, arrangement: str, count: int) -> dict[str, Any]:
    """The last stages of `STAGES`; cables that hang one behind the other have the pretension they settle at (5-1)."""
    stages = [dict(stage) for stage in STAGES[-count:]]
    if circuit == "open" or arrangement == "parallel":
        for near, far in reversed(list(pairwise(stages))):
            near["pretension_N"] = far["pretension_N"] * far["input_radius_m"] / near["output_radius_m"]
    return {"circuit": circuit, "arrangement": arrangement, "stage": stages}


def joint(circuit: str, arrangement: str, count: int, mu_angle: float) -> JointConfig:
    """The same as a joint with a guide in every cable."""
    data = {"schema": 1, "name": "guided", "drive": drive(circuit, arrangement, count)}
    config = parse_joint({**data, "observer": {"merge_tolerance": 1e-12, "max_pieces": 512}}, "guided")
    return with_effects(config, [("routing_friction", {"mu_angle": mu_angle, "arc_length_m": ARC})])


def reversals(config: JointConfig, samples: int) -> Columns:
    """Loads up to half of R T0 and back, six times, while the motor turns to and fro by 0.3 rad of the joint."""
    stage = config.drive.stage[-1]
    place = np.linspace(0.0, 6.0, samples)
    load = np.interp(place, np.arange(7.0), [0.0, 1.0, -0.7, 0.5, -0.2, 0.9, -1.0])
    unit = 0.5 * stage.output_radius_m * stage.pretension_N
    return still(0.02 * np.arange(samples), unit * load, 0.3 / config.drive.ratio * np.sin(1.3 * place))


@pytest.mark.parametrize(("circuit", "arrangement"), KINDS)
@pytest.mark.parametrize(("count", "mu_angle"), [(2, 0.2), (2, 1.0), (3, 0.4)])
def test_stages_with_guides_agree_with_a_plant_of_material_points(
    circuit: str, arrangement: str, count: int, mu_angle: float
) -> None:
    config = joint(circuit, arrangement, count, mu_angle)
    columns = reversals(config, 60)
    found = Observer(config).run(columns)
    parts = drive(circuit, arrangement, count)["stage"]
    plant = PlantConfig(
        "guided", circuit, tuple(StageConfig(**part) for part in parts), arrangement=arrangement
    )
    guides = EffectSpec("routing_friction", {"mu_angle": mu_angle, "arc_length_m": ARC})
    truth = simulate(plant, *columns.values(), effects=[guides], resolution=COARSE)
    deflection, torque = truth.deflection_rad, truth.motor_torque_Nm
    assert found["deflection_rad"] == pytest.approx(deflection, abs=2e-3 * np.ptp(deflection))
    assert found["predicted_motor_torque_Nm"] == pytest.approx(torque, abs=2e-3 * np.ptp(torque))
    tensions = ("h", "l") if circuit == "closed" else ("h",)
    for cable in tensions:
        tension = getattr(truth, f"tension_{cable}_N")
        assert found[f"tension_{cable}_N"] == pytest.approx(tension, abs=2e-3 * np.max(tension))


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("mu_angle", [0.1, 0.7, 1.5])
@pytest.mark.parametrize(("arrangement", "count"), [("series", 2), ("parallel", 2), ("parallel", 3)])
def test_cables_that_slide_through_all_guides_obey_the_capstan_law_stage_by_stage(
    arrangement: str, count: int, mu_angle: float, way: float
) -> None:
    """The motor winds h off and l on (way 1): T_out/T_in = e^(mu Theta) in h, e^(-mu Theta) in l. A chain's shafts hold
    R_i T_i = r_{i+1} T_in,i+1 each; the one shaft between two circuits in series R_1 (T_h - T_l) of them both."""
    config = joint("closed", arrangement, count, mu_angle)
    stages = config.drive.stage
    motor = way * np.linspace(0.0, 0.8 / config.drive.ratio, 120)
    load = 0.3 * stages[-1].output_radius_m * stages[-1].pretension_N
    found = Observer(config).run(still(0.1 * np.arange(120.0), np.full(120, load), motor))
    tau = math.exp(way * mu_angle)
    h, l_, h_in, l_in = (
        found[key][-1] for key in ("tension_h_N", "tension_l_N", "tension_h_input_N", "tension_l_input_N")
    )
    if arrangement == "parallel":
        lever = math.prod(far.input_radius_m / near.output_radius_m for near, far in pairwise(stages))
        assert h_in == pytest.approx(lever * h * tau**-count, rel=1e-7)
        assert l_in == pytest.approx(lever * l_ * tau**count, rel=1e-7)
    else:
        before = stages[0].output_radius_m * (h_in * tau - l_in / tau)
        behind = stages[1].input_radius_m * (h / tau - l_ * tau)
        assert before == pytest.approx(behind, rel=1e-7)


@pytest.mark.parametrize("count", [2, 3])
def test_an_open_chain_unloads_through_its_guides_by_the_capstan_law(count: int) -> None:
    """From uniform tension the load falls to half of what slackens it: T_in = e^(mu Theta) T_out in every stage, the
    motor holding r T_in of the first."""
    config = joint("open", "series", count, 0.2)
    stages = config.drive.stage
    unit = stages[-1].output_radius_m * stages[-1].pretension_N
    load = np.linspace(0.0, -0.5 * unit, 50)
    found = Observer(config).run(still(0.1 * np.arange(50.0), load))
    expected = 0.5 * stages[0].pretension_N * math.exp(0.2 * count)
    assert found["tension_h_input_N"][-1] == pytest.approx(expected, rel=1e-7)
    torque = -stages[0].input_radius_m * expected
    assert found["predicted_motor_torque_Nm"][-1] == pytest.approx(torque, rel=1e-7)


@pytest.mark.parametrize(("circuit", "arrangement"), KINDS)
@pytest.mark.parametrize("count", [2, 3])
def test_the_stiffness_of_stages_with_guides_is_the_slope_of_their_deflection(
    circuit: str, arrangement: str, count: int
) -> None:
    """Differences of two loads to either side of the present one, on with the load's way; but where one turns the other
    way or a guide sets off between them."""
    config = joint(circuit, arrangement, count, 0.4)
    columns = reversals(config, 60)
    step = 1e-5 * np.ptp(columns["joint_torque_Nm"])
    observer, misses = Observer(config), []
    for time, motor, load in np.column_stack(list(columns.values())).tolist():
        observer.step(Sample(time, motor, load))
        twins = [observer.copy() for _ in range(2)]
        near, far = (
            twin.step(Sample(time + 1e-3, motor, load + k * step)).deflection_rad
            for k, twin in enumerate(twins, start=1)
        )
        stiffness = 2.0 / (1.0 / twins[0].stiffness() + 1.0 / twins[1].stiffness())
        misses.append(abs(step / (far - near) / stiffness - 1.0))
    assert np.quantile(misses, 0.95) < 1e-3
