"""What has to be measured for a joint to be run, and whether its link measures it."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from cablecomp.cli.simulation import _timing
from cablecomp.config import load_joint
from cablecomp.control.command import Reference
from cablecomp.control.compensator import DEFAULT_GAINS
from cablecomp.control.motors import control_for
from cablecomp.control.options import CompensatorOptions, ControlConfig, ControlMode
from cablecomp.effects import with_effects
from cablecomp.errors import InputError
from cablecomp.links.link import BusLink
from cablecomp.links.load import load_link
from cablecomp.links.protocols import tells
from cablecomp.links.records import JOINT_POSITION, JOINT_TORQUE, MOTOR_POSITION, MOTOR_TORQUE
from cablecomp.runtime import compare
from cablecomp.runtime.joint_loop import JointSetup
from cablecomp.runtime.setup import Contestant, _check_measured, _reads_temperature, joint_setup

LINKS = Path(__file__).parents[2] / "configs/links"
TORQUE, POSITION = "joint_torque_Nm", "joint_position_rad"


@pytest.mark.parametrize(
    ("name", "measured"),
    [
        ("mit-virtual", {TORQUE, POSITION}),
        ("dynamixel-serial", set()),
        ("moteus-dual-encoder", {POSITION}),
        ("cia402-dual-encoder", {POSITION}),
        ("odrive-dual-encoder", {POSITION}),
    ],
)
def test_a_link_is_asked_for_what_the_load_is_to_come_from(name: str, measured: set[str]) -> None:
    link = load_link(LINKS / f"{name}.toml")
    assert {c for c in (TORQUE, POSITION) if tells(link, link.joint[0], c)} == measured
    for load, channel in (("joint_torque", TORQUE), ("both_encoders", POSITION)):
        if channel in measured:
            _check_measured(link, 0, load)
        else:
            with pytest.raises(InputError, match=f'measures {channel}.*observer.load = "{load}"'):
                _check_measured(link, 0, load)
    for load in ("motor_torque", "none"):
        _check_measured(link, 0, load)


@pytest.mark.parametrize("rate_Hz", [1.0, 200.0, 333.0, 500.0, 1000.0, 20_000.0])
def test_a_simulated_joint_goes_at_the_link_s_rate(rate_Hz: float) -> None:
    timing = _timing(rate_Hz)
    assert timing.sample_s == pytest.approx(1.0 / rate_Hz, rel=1e-12)
    assert timing.step_s <= 5e-4 * (1.0 + 1e-9)


@pytest.mark.parametrize(
    ("effect", "reads"),
    [
        ((), False),
        (("thermal_pretension", {"coefficient_per_K": 0.01, "reference_degC": 20.0}), True),
        (("pretension_relaxation", {"fraction": 0.05, "time_constant_s": 20.0}), False),
        (
            ("pretension_relaxation", {"fraction": 0.05, "time_constant_s": 20.0, "quickening_per_K": 0.07}),
            True,
        ),
    ],
)
def test_a_temperature_is_needed_where_an_effect_goes_with_it(
    effect: tuple[str, dict[str, float]] | tuple[()], reads: bool
) -> None:
    joint = with_effects(load_joint("wrist-capstan"), [effect] if effect else [])
    assert _reads_temperature(joint) is reads


@pytest.mark.parametrize("why", ["asked by the user", "asked by the user (SIGTERM)"])
def test_a_comparison_that_is_stopped_by_a_signal_is_no_fault_of_the_input(
    why: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    closed = []
    simulation = SimpleNamespace(close=lambda: closed.append(True))
    monkeypatch.setattr(compare, "run_joints", lambda *given: SimpleNamespace(stop_reason=why))
    joint, link = load_joint("wrist-capstan"), load_link("wrist-virtual")
    with pytest.raises(KeyboardInterrupt):
        compare.compare(
            joint,
            link,
            control_for(joint),
            lambda wish: simulation,  # type: ignore[arg-type, return-value]  # a stand-in
            lambda config, columns: pytest.fail("goes on"),
            compare.CompareOptions(tmp_path),
            lambda: 0.0,
        )
    assert closed


def set_up(bus: BusLink, mode: ControlMode, load: str) -> JointSetup:
    """A wrist whose load is found from that, on the first place of a bus."""
    joint = load_joint("wrist-capstan")
    options = joint.observer.model_copy(update={"load": load})
    joint = joint.model_copy(update={"observer": options})
    contestant = Contestant(0, "wrist", joint, CompensatorOptions())
    return joint_setup(
        contestant, mode, bus, ControlConfig(), lambda time_s: Reference(), DEFAULT_GAINS, 1e-3
    )


@pytest.mark.parametrize("load", ["motor_torque", "none"])
def test_no_joint_is_ready_before_the_motor_torque_that_its_load_is_found_from(load: str) -> None:
    bus = BusLink(load_link("wrist-virtual"))
    setup, readings = set_up(bus, ControlMode.POSITION, load), bus.joints[0]
    readings.values[MOTOR_POSITION] = readings.arrived_s[MOTOR_POSITION] = 0.0
    readings.updates[MOTOR_POSITION] += 1
    assert setup.health.check(readings, 0.0).ready is (load == "none")


@pytest.mark.parametrize(
    ("mode", "load", "silent"),
    [
        ("position", "both_encoders", JOINT_POSITION),
        ("force", "joint_torque", JOINT_POSITION),  # there the encoders tell the load
        ("position", "joint_torque", JOINT_TORQUE),
    ],
)
def test_what_the_load_is_found_from_may_not_grow_old(mode: str, load: str, silent: int) -> None:
    bus = BusLink(load_link("wrist-virtual"))
    setup, readings = set_up(bus, ControlMode(mode), load), bus.joints[0]
    for k in range(40):
        for place in (MOTOR_POSITION, JOINT_POSITION, JOINT_TORQUE, MOTOR_TORQUE):
            if place != silent or k < 20:
                readings.values[place], readings.arrived_s[place] = 0.0, 1e-3 * k
                readings.updates[place] += 1
        checked = setup.health.check(readings, 1e-3 * k)
        assert checked.ready
        assert checked.load_age_s == pytest.approx(1e-3 * max(k - 19, 0))


@pytest.mark.parametrize(("mode", "tells"), [("position", True), ("velocity", False), ("torque", False)])
def test_the_gate_knows_what_holds_an_open_circuit_where_it_is(mode: str, tells: bool) -> None:
    """-r T0 of the input pulley; what is told no position is held by where the motor is."""
    link = load_link("wrist-virtual")
    ends = link.joint[0]
    ends = ends.model_copy(update={"motor": ends.motor.model_copy(update={"mode": mode})})
    bus = BusLink(link.model_copy(update={"joint": (ends,)}))
    joint = load_joint("snow-open-rig")
    stage = joint.drive.stage[0]
    contestant = Contestant(0, "rig", joint, CompensatorOptions())
    setup = joint_setup(
        contestant,
        ControlMode.POSITION,
        bus,
        ControlConfig(),
        lambda time_s: Reference(),
        DEFAULT_GAINS,
        1e-3,
    )
    assert setup.limits.balance_Nm == pytest.approx(-stage.input_radius_m * stage.pretension_N)
    assert setup.limits.tells_position is tells
    assert setup.limits.age_s == pytest.approx(0.5 * link.timeouts.fade_s)
