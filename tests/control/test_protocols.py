"""Protocols: continuous in time, true to their numbers, and back from their own text unchanged."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from cablecomp.config import load_joint
from cablecomp.control.protocol import Protocol, load_protocol, parse_protocol
from cablecomp.control.standard import calibration_protocol, force_protocol, reaching_protocol
from cablecomp.errors import InputError

JOINTS = sorted((Path(__file__).parents[2] / "configs/joints").glob("*.toml"))
EVERYTHING = {
    "schema": 1,
    "name": 'all "kinds"',
    "note": "one\nof each",
    "start_position_rad": 0.1,
    "segment": [
        {"kind": "ramp", "load_Nm": 1.0, "position_rad": -0.2, "duration_s": 2.0},
        {"kind": "hold", "duration_s": 0.5},
        {
            "kind": "sine_sweep",
            "channel": "position",
            "amplitude": 0.1,
            "from_Hz": 0.5,
            "to_Hz": 2.0,
            "duration_s": 3.0,
        },
        {"kind": "nested_reversals", "peaks": [1.5, -0.5, 0.7], "rate": 2.0, "dwell_s": 0.1},
        {"kind": "rate_pair", "amplitude": 0.5, "rates": [0.5, 5.0]},
        {
            "kind": "angle_sweep",
            "from_rad": -0.5,
            "to_rad": 0.5,
            "speed_rad_s": 1.0,
            "load_Nm": 0.3,
            "cycles": 2,
        },
        {"kind": "wait", "duration_s": 1.0, "why": "temperature"},
        {"kind": "sine_sweep", "amplitude": 0.2, "from_Hz": 1.0, "to_Hz": 1.0, "duration_s": 2.5},
        {"kind": "unload", "rate_Nm_s": 1.0, "dwell_s": 0.2},
    ],
}


@pytest.fixture
def everything() -> Protocol:
    return parse_protocol(EVERYTHING, "test")


def test_load_and_position_never_jump(everything: Protocol) -> None:
    dt = 1e-3
    points = [everything.reference(dt * k) for k in range(int(everything.duration_s / dt) + 500)]
    loads = np.array([p.joint_torque_Nm for p in points])
    positions = np.array([p.joint_position_rad for p in points])
    assert np.abs(np.diff(loads)).max() < 6.0 * dt
    assert np.abs(np.diff(positions)).max() < 3.0 * dt


def test_rates_are_the_derivatives_of_the_values(everything: Protocol) -> None:
    h = 1e-6
    for t in np.linspace(0.05, everything.duration_s - 0.05, 211):
        a, b, c = (everything.reference(t + k * h) for k in (-1, 0, 1))
        assert (c.joint_position_rad - a.joint_position_rad) / (2 * h) == pytest.approx(
            b.joint_velocity_rad_s, abs=1e-4
        )


def test_ends_and_extremes_are_as_asked(everything: Protocol) -> None:
    assert everything.reference(-1.0).joint_position_rad == 0.1
    assert everything.reference(2.0).joint_torque_Nm == pytest.approx(1.0)
    end = everything.reference(1e6)
    assert (end.joint_position_rad, end.joint_torque_Nm, end.joint_velocity_rad_s) == (-0.5, 0.0, 0.0)
    found = everything.extremes()
    assert found.load_high_Nm == 1.5
    assert found.load_low_Nm == -0.5
    assert (found.position_low_rad, found.position_high_rad) == (-0.5, 0.5)


def test_text_reads_back_as_the_same_protocol(everything: Protocol, tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    path.write_text(everything.to_toml(), encoding="utf-8")
    assert load_protocol(path) == everything
    assert tomllib.loads(everything.to_toml())["name"] == 'all "kinds"'


@pytest.mark.parametrize("path", JOINTS, ids=lambda p: p.stem)
def test_standard_protocols_stay_within_the_joint_s_limits(path: Path) -> None:
    config = load_joint(path)
    for protocol in (calibration_protocol(config), reaching_protocol(config, 3), force_protocol(config, 3)):
        protocol.check_within(config.limits, protocol.name)
        assert parse_protocol(tomllib.loads(protocol.to_toml()), "again") == protocol
    assert 40.0 < calibration_protocol(config).duration_s < 75.0
    assert reaching_protocol(config, 3) == reaching_protocol(config, 3)
    assert reaching_protocol(config, 3) != reaching_protocol(config, 4)


@pytest.mark.parametrize(
    ("segment", "word"),
    [
        ({"kind": "leap", "duration_s": 1.0}, "leap"),
        ({"kind": "ramp", "duration_s": 1.0}, "load_Nm"),
        ({"kind": "ramp", "duration_s": -1.0, "load_Nm": 1.0}, "duration_s"),
        ({"kind": "hold", "duration_s": 1.0, "load": 2.0}, "load"),
        ({"kind": "ramp", "duration_s": 1.0, "load_Nm": float("nan")}, "load_Nm"),
    ],
)
def test_bad_segments_are_one_line(segment: dict[str, object], word: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_protocol({"schema": 1, "name": "x", "segment": [segment]}, "p.toml")
    text = str(caught.value)
    assert word in text
    assert text.startswith("p.toml")
    assert "\n" not in text


def test_more_than_the_joint_may_be_given_is_refused() -> None:
    config = load_joint(JOINTS[-1])
    protocol = parse_protocol(
        {"schema": 1, "name": "x", "segment": [{"kind": "ramp", "load_Nm": 50.0, "duration_s": 1.0}]}, "x"
    )
    with pytest.raises(InputError, match="50 Nm"):
        protocol.check_within(config.limits)
