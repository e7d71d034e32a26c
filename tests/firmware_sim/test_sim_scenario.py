"""Loads and scenarios of the simulation."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_sim.errors import SimError
from firmware_sim.faults import parse_fault
from firmware_sim.loads import SHAPES, Load, load_from
from firmware_sim.scenario import Scenario, load_scenario, plant_maker

ROOT = Path(__file__).resolve().parents[2]
CONFIG = ROOT / "configs" / "joints" / "snow-closed-rig.toml"
TIMES = st.floats(0.0, 50.0)


@given(st.sampled_from(sorted(SHAPES)), TIMES, st.floats(0.1, 5.0), st.integers(0, 5))
def test_no_load_exceeds_its_amplitude(shape: str, time_s: float, period_s: float, seed: int) -> None:
    load = Load(shape=shape, amplitude=0.7, period_s=period_s, rise_s=0.01, seed=seed)
    assert abs(load.value(time_s)) <= 0.7 + 1e-12
    assert load.value(time_s) == Load(
        shape=shape, amplitude=0.7, period_s=period_s, rise_s=0.01, seed=seed
    ).value(time_s)


@given(st.sampled_from(["sine", "ramp", "trapezoid", "steps"]), TIMES)
def test_loads_do_not_jump(shape: str, time_s: float) -> None:
    load = Load(shape=shape, amplitude=1.0, period_s=1.0, rise_s=0.05)
    slope = {"sine": 2 * math.pi, "ramp": 1.0, "trapezoid": 4.0, "steps": 40.0}[shape]
    assert abs(load.value(time_s + 1e-4) - load.value(time_s)) <= slope * 1e-4 + 1e-9


def test_shapes_at_known_instants() -> None:
    trapezoid = Load(shape="trapezoid", amplitude=2.0, period_s=4.0)
    assert [trapezoid.value(t) for t in (0.0, 0.5, 1.0, 1.5, 2.5, 3.0, 3.5)] == [
        0.0,
        1.0,
        2.0,
        2.0,
        1.0,
        0.0,
        0.0,
    ]
    late = Load(amplitude=1.0, start_s=1.0, stop_s=2.0)
    assert [late.value(t) for t in (0.99, 1.0, 1.99, 2.0)] == [0.0, 1.0, 1.0, 0.0]


def test_shipped_scenarios_load_and_their_faults_parse() -> None:
    paths = sorted((ROOT / "configs" / "scenarios").glob("*.toml"))
    assert {"load_changes.toml", "rough_bus.toml"} <= {path.name for path in paths}
    for name in ("load_changes.toml", "rough_bus.toml"):
        for text in load_scenario(ROOT / "configs" / "scenarios" / name).faults:
            parse_fault(text)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[motors]\n", "unknown table"),
        ("[[load]]\nshape = 'square'\n", "is accepted"),
        ("[[load]]\nsize = 1.0\n", "unknown key `size`"),
        ("[[load]]\nshape = 3\n", "is 3"),
        ("[[effect]]\ncoefficient = 3\n", "needs `id`"),
        ("[[fault]]\n", "needs `spec`"),
        ("[motor", "not valid TOML"),
    ],
)
def test_wrong_scenarios_are_one_line(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "scenario.toml"
    path.write_text(text)
    with pytest.raises(SimError, match=said) as caught:
        load_scenario(path)
    assert "\n" not in str(caught.value)


def test_unknown_motor_keys_are_named() -> None:
    with pytest.raises(SimError, match="unknown key `torque`"):
        plant_maker(CONFIG, Scenario(motor={"torque": 1.0}))
    with pytest.raises(SimError, match="a number is accepted"):
        plant_maker(CONFIG, Scenario(link={"gravity_Nm": "heavy"}))
    with pytest.raises(SimError, match="shape"):
        load_from({"shape": "square"}, "here")


def test_a_load_moves_the_joint_of_the_real_plant() -> None:
    held = Scenario(link={"gravity_Nm": 0.0}, loads=(Load(shape="ramp", amplitude=0.5, period_s=0.05),))
    free = Scenario(link={"gravity_Nm": 0.0})
    ends = []
    for scenario in (free, held):
        plant = plant_maker(CONFIG, scenario)(1)
        for _ in range(150):
            readings = plant.step(5e-4, 0.0)
        ends.append(readings.truth.joint_position_rad)
    assert abs(ends[0]) < 1e-4
    assert ends[1] > 0.01
