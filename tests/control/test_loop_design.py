"""Loop design: the linear model against its parts, margins that hold, hysteresis as a describing
function, the drive in python-control.
"""

from __future__ import annotations

from pathlib import Path

import control
import numpy as np
import pytest

from cablecomp.cli.design import to_design
from cablecomp.config import Empirical, load_joint
from cablecomp.control.design import LoopDesign, design_loop
from cablecomp.control.limit_cycle import Hysteresis
from cablecomp.control.margins import grid_for, highest_gain, modulus_for
from cablecomp.control.motors import DriveGains, control_for
from cablecomp.control.options import ControlConfig, MotorModel, load_control, parse_control
from cablecomp.control.plant_model import (
    integrator,
    joint_model,
    lead_filter,
    load_path,
    pick,
    response,
    stable_when_closed,
)
from cablecomp.control.plays import fit_plays
from cablecomp.control.shaping import LeadFilter, Slope
from cablecomp.control.stiffness import held, plain, stiffness_range
from cablecomp.control.synthesis import DesignWork
from cablecomp.effects import with_effects
from cablecomp.errors import InputError
from cablecomp.links.load import load_link
from cablecomp.observer import Observer
from cablecomp.runtime.setup import stated_gains
from cablecomp.thesis.design import design_sheet

CONFIGS = Path(__file__).parents[2] / "configs"
JOINT = load_joint(CONFIGS / "joints/wrist-capstan.toml")
WANTED = load_control(CONFIGS / "control/wrist-capstan.toml")
T = 1e-3


@pytest.fixture(scope="module")
def design() -> LoopDesign:
    free = WANTED.compensator.model_copy(update={"joint_feedback_per_s": None})
    return design_loop(JOINT, 1000.0, WANTED.model_copy(update={"compensator": free}))


@pytest.mark.parametrize("gain", ["stiffness_Nm_per_rad", "damping_Nms_per_rad", "velocity_bandwidth_Hz"])
def test_a_drive_that_outgrows_all_numbers_within_a_period_is_unstable(gain: str) -> None:
    motor = WANTED.motor.model_copy(update={gain: 1e300})
    with pytest.raises(InputError, match=r"the drive's own loop .* is unstable on a cable of"):
        design_loop(JOINT, 1000.0, WANTED.model_copy(update={"motor": motor}))


@pytest.mark.parametrize("name", ["wrist-capstan", "capstan-arm", "snow-closed-rig"])
def test_the_stiffness_range_begins_at_the_free_spans_alone(name: str) -> None:
    """However fast it falls with the load, which on long wraps it does."""
    joint = load_joint(CONFIGS / f"joints/{name}.toml")
    found = stiffness_range(joint)
    stage = joint.drive.stage[0]
    spans = 2.0 * stage.EA_N * stage.output_radius_m**2 / stage.free_length_m
    assert found.zero_Nm_per_rad == found.high_Nm_per_rad == pytest.approx(spans, rel=1e-6)
    assert found.low_Nm_per_rad < found.secant_Nm_per_rad < found.zero_Nm_per_rad
    sheet = design_sheet(joint)
    assert sheet is not None
    assert sheet.zero_load_stiffness_Nm_per_rad == pytest.approx(spans)


@pytest.mark.parametrize("name", ["wrist-capstan", "snow-open-rig"])
def test_the_loops_width_is_between_its_branches_and_not_from_first_touch(name: str) -> None:
    joint = load_joint(CONFIGS / f"joints/{name}.toml")
    found = stiffness_range(joint)
    most, least = found.load_Nm.max(), found.load_Nm.min()
    observer = Observer(plain(joint))
    loads = np.concatenate([np.linspace(a, b, 90) for a, b in ((0.0, most), (most, least), (least, most))])
    deflection = [held(observer, k, float(load), most).deflection_rad for k, load in enumerate(loads)]
    down, up = deflection[90:180][::-1], deflection[180:]
    assert found.width_rad == pytest.approx(np.max(np.abs(np.subtract(up, down))), rel=1e-2)


def test_margins_that_no_loop_keeps_are_refused_or_said() -> None:
    """2 sin(60 deg/2) = 1 is the distance from -1 of a loop that does nothing."""
    with pytest.raises(InputError, match="phase_margin_deg"):
        parse_control({"schema": 1, "phase_margin_deg": 60.0}, "control")
    stated = {
        "load_filter_Hz": 5.0,
        "load_lead_s": 0.0,
        "follow_filter_Hz": 20.0,
        "force_feedback_per_s": 0.0,
    }
    options = WANTED.compensator.model_copy(update=stated)
    found = design_loop(JOINT, 1000.0, WANTED.model_copy(update={"gain_margin": 1e9, "compensator": options}))
    assert found.gains.motor_integral_per_s == 0.0
    assert any("motor_integral_per_s: no gain keeps" in line for line in found.warnings)
    assert not any("motor trim: unstable" in line for line in found.warnings)


def test_the_gains_that_a_control_file_states_are_those_whose_margins_are_shown() -> None:
    stated = {"load_filter_Hz": 200.0, "load_lead_s": 0.002, "joint_feedback_per_s": 5.0}
    options = to_design(parse_control({"schema": 1, "compensator": stated}, "control")).compensator
    assert {name: getattr(options, name) for name in stated} == stated
    assert to_design(WANTED).compensator.joint_feedback_per_s is None


def test_what_sensors_read_wrong_is_no_part_of_the_drive() -> None:
    wrong = {"joint_torque_gain": 1.25, "joint_torque_offset_Nm": 0.3, "joint_position_offset_rad": 0.02}
    joint = JOINT.model_copy(update={"sensors": JOINT.sensors.model_copy(update=wrong)})
    found, true = stiffness_range(joint), stiffness_range(JOINT)
    assert found.secant_Nm_per_rad == pytest.approx(true.secant_Nm_per_rad, rel=1e-9)
    assert Hysteresis(joint).describing_function(1e-3) == Hysteresis(JOINT).describing_function(1e-3)


def test_a_load_that_the_joint_cannot_bear_is_named_as_the_design_s() -> None:
    """A tenth above the pretension the cable breaks, before the limit's load; no sample of anybody's is to blame."""
    stage = JOINT.drive.stage[0]
    weak = stage.model_copy(update={"breaking_force_N": 1.1 * stage.pretension_N})
    joint = JOINT.model_copy(update={"drive": JOINT.drive.model_copy(update={"stage": (weak,)})})
    most = JOINT.limits.joint_torque_max_Nm
    for of in (stiffness_range, fit_plays):
        with pytest.raises(
            InputError, match=rf"of the \+-{most:.4g} Nm that are designed for .*breaking_force_N"
        ):
            of(joint)


OF_TIME = {
    "pretension_relaxation": {"fraction": 0.02, "time_constant_s": 30.0, "steady": 0.05},
    "clamp_slip": {"slip_m": 0.0, "time_s": 10.0, "creep_m_per_Ns": 1e-9, "holds_N": 80.0},
    "strand_break": {"fraction": 0.3, "time_s": 30.0},
}


@pytest.mark.parametrize("name", OF_TIME)
def test_a_joint_is_looked_at_as_it_is_when_it_starts_not_days_into_its_creep(name: str) -> None:
    joint, law = with_effects(JOINT, [(name, OF_TIME[name])]), fit_plays(JOINT)
    assert stiffness_range(joint).deflection_rad == pytest.approx(stiffness_range(JOINT).deflection_rad)
    assert fit_plays(joint).weights == pytest.approx(law.weights)
    assert Hysteresis(joint).describing_function(1e-3) == Hysteresis(JOINT).describing_function(1e-3)


def test_a_law_of_the_time_is_no_part_of_the_load_s_loops() -> None:
    law = Empirical(id="drift", law="chebyshev", of="time_s", half_width=1e6, coefficients_rad=(0.0, 0.01))
    bent = law.model_copy(update={"of": "joint_torque_Nm", "half_width": 4.0})
    width = stiffness_range(JOINT).width_rad
    drifts, bends = (JOINT.model_copy(update={"empirical": (of,)}) for of in (law, bent))
    assert stiffness_range(drifts).width_rad == pytest.approx(width)
    reach = [np.ptp(stiffness_range(of).deflection_rad) for of in (JOINT, bends)]
    assert reach[1] - reach[0] == pytest.approx(0.01 * 2.0 * 2.0 / 4.0)  # slope 0.01/4 over -2 to 2 Nm


def test_what_turns_the_joint_at_any_load_is_no_error_of_the_load_s_loops() -> None:
    """A law of the motor's angle turns the joint by 4 mrad where the motor is held: all else is as without it."""
    law = Empirical(id="wave", law="chebyshev", of="motor_position_rad", coefficients_rad=(0.004, 0.01))
    found, without = fit_plays(JOINT.model_copy(update={"empirical": (law,)})), fit_plays(JOINT)
    assert found.rest_rad - without.rest_rad == pytest.approx(0.004, abs=1e-9)
    assert found.weights == pytest.approx(without.weights, rel=1e-6, abs=1e-9)
    assert found.rms_rad == pytest.approx(without.rms_rad, rel=1e-6)


def test_what_flows_is_at_rest_in_the_load_s_loops() -> None:
    """Infinitely slow, viscous slip is no friction of its own."""
    joint = with_effects(JOINT, [("viscous_slip", {"coefficient_Ns_per_m_rad": 1e5})])
    assert stiffness_range(joint).width_rad == pytest.approx(stiffness_range(JOINT).width_rad, rel=1e-3)


def test_filter_and_path_of_the_model_are_the_compensator_s_own() -> None:
    """The state space gives, step by step, what the running code gives."""
    rng = np.random.default_rng(1)
    readings = rng.standard_normal(60).cumsum()
    ahead, slope = LeadFilter(25.0, 0.004, T), Slope(60.0, T)
    ahead.started = slope.started = True
    compliance, ratio = 1.0 / 180.0, 1.0 / 3.0
    motor = MotorModel(viscous_Nms_per_rad=2e-3)
    times = np.arange(60) * T
    filtered = control.forced_response(lead_filter(25.0, 0.004, T), times, readings).outputs
    path = control.forced_response(
        load_path(motor, ratio, compliance, 25.0, 0.004, 60.0, T), times, readings
    ).outputs
    for k, reading in enumerate(readings):
        expected = ahead.step(float(reading))
        bend = compliance * expected
        rate = slope.step(bend)
        assert filtered[:, k] == pytest.approx([expected, ahead.rate], rel=1e-9, abs=1e-9)
        torque = -ratio * expected - 2e-3 * rate / ratio
        assert path[:, k] == pytest.approx([-bend / ratio, -rate / ratio, torque], rel=1e-9, abs=1e-9)


def test_the_joint_model_rests_where_statics_say() -> None:
    """Motor target q*, output held by a contact k_e: q_out = k N q_in/(k + k_e), M = -k_e q_out."""
    k, contact, n = 200.0, 500.0, 1.0 / 3.0
    model = joint_model(WANTED.motor, n, k, T, contact)
    steady = np.real(response(model, np.array([1.0 + 1e-12j]))[0])
    load, joint, motor = steady[:, 0]
    assert joint == pytest.approx(k * n * motor / (k + contact), rel=1e-6)
    assert load == pytest.approx(-contact * joint, rel=1e-6)
    pull = n * load  # the cable's on the motor, balanced by the drive's spring
    assert motor == pytest.approx(1.0 + pull / WANTED.motor.stiffness_Nm_per_rad, rel=1e-6)


@pytest.mark.parametrize(("gain", "phase_deg"), [(2.0, 35.0), (4.0, 35.0), (2.0, 59.0)])
def test_a_loop_that_keeps_its_distance_has_both_margins(gain: float, phase_deg: float) -> None:
    """A loop with a smaller margin goes through a point that is nearer to -1: -1/gain, or at that angle on the unit
    circle."""
    points = -1.0 / gain, -np.exp(1j * np.radians(phase_deg))
    assert modulus_for(gain, phase_deg) == pytest.approx(max(abs(1.0 + p) for p in points))


def test_every_loop_is_stable_and_keeps_its_distance_over_the_whole_range(design: LoopDesign) -> None:
    least = modulus_for(WANTED.gain_margin, WANTED.phase_margin_deg)
    assert {loop.name for loop in design.loops} >= {
        "load feed-forward",
        "motor trim",
        "joint feedback",
        "force feedback",
    }
    for loop in design.loops:
        assert len(loop.margins) == 5
        for margin in loop.margins:
            assert margin.stable, (loop.name, margin)
            assert margin.modulus_margin >= least - 1e-3, (loop.name, margin)
            assert margin.gain_margin >= WANTED.gain_margin - 0.01
            assert margin.phase_margin_deg >= WANTED.phase_margin_deg - 0.5


def test_a_quicker_filter_would_break_the_margins(design: LoopDesign) -> None:
    quick = WANTED.compensator.model_copy(update={"load_filter_Hz": 80.0, "load_lead_s": 0.004})
    found = design_loop(JOINT, 1000.0, WANTED.model_copy(update={"compensator": quick}))
    assert any("load feed-forward" in line for line in found.warnings)
    assert not any("load feed-forward" in line for line in design.warnings)


def test_compensation_is_whole_at_rest_and_gone_at_high_frequency(design: LoopDesign) -> None:
    error = np.array(design.compensation_error)
    hertz = np.array(design.compensation_Hz)
    assert error[0] < 0.02
    assert np.interp(200.0, hertz, error) == pytest.approx(1.0, abs=0.1)


def test_more_gain_than_the_greatest_does_not_hold() -> None:
    grid = grid_for(T)
    plant = pick(joint_model(WANTED.motor, 1.0 / 3.0, 200.0, T), [2], [0])

    def loops(gain: float) -> list[object]:
        return [plant * integrator(gain, 1.0, T)]

    gain = highest_gain(loops, 0.1, 1000.0, 0.6, grid)
    z = np.exp(1j * grid * T)
    assert np.min(np.abs(1.0 + np.squeeze(response(loops(gain)[0], z)))) == pytest.approx(0.6, abs=0.02)
    assert stable_when_closed(loops(gain)[0])
    assert highest_gain(loops, 1e5, 1e6, 0.6, grid) == 0.0


def test_the_describing_function_is_the_free_span_for_small_swings_and_softens() -> None:
    hysteresis = Hysteresis(JOINT)
    stage = JOINT.drive.stage[0]
    spans = 2.0 * stage.EA_N * stage.output_radius_m**2 / stage.free_length_m
    values = np.asarray(control.describing_function(hysteresis, np.array([1e-6, 1e-4, 1e-3, 5e-3])))
    assert values[0].real == pytest.approx(spans, rel=2e-3)
    assert abs(values[0].imag) < 1e-3 * spans
    assert np.all(np.diff(values.real) < 0.0)
    assert np.all(np.diff(values.imag) > 0.0)  # the loop's loss grows with amplitude


def test_the_describing_function_s_loss_is_the_area_of_the_loop() -> None:
    """Im N = area/(pi A^2), the loop walked with the same observer, load over deflection."""
    amplitude = 3e-3
    hysteresis = Hysteresis(JOINT)
    phase = 2.0 * np.pi * np.arange(1, 3 * 400 + 1) / 400
    angles = amplitude * np.sin(phase)
    hysteresis.reset()
    loads = np.array([hysteresis(float(a)) for a in angles])[-401:]
    turned = angles[-401:]
    area = float(np.sum(0.5 * (loads[1:] + loads[:-1]) * np.diff(turned)))
    expected = area / (np.pi * amplitude**2)
    assert hysteresis.describing_function(amplitude).imag == pytest.approx(expected, rel=0.03)


def test_no_limit_cycle_where_the_feed_forward_damps(design: LoopDesign) -> None:
    limit = design.limit_cycle
    assert limit.found == ()
    assert limit.margin > 0.0
    assert all(loss > 0.0 for loss in limit.loss_factor)
    assert limit.loss_factor[-1] > limit.loss_factor[0]  # the hysteresis takes more out of larger swings


def test_a_drive_that_cannot_be_stable_is_refused() -> None:
    bad = ControlConfig(motor=MotorModel(damping_Nms_per_rad=30.0, inertia_kgm2=1e-4))
    with pytest.raises(InputError, match="unstable"):
        design_loop(JOINT, 1000.0, bad)
    with pytest.raises(InputError, match="rate"):
        design_loop(JOINT, 0.0)


@pytest.mark.parametrize("stated", [DriveGains(200.0, 2.0), DriveGains(40.0, 0.1), DriveGains(3.0, 0.01)])
def test_where_a_link_states_gains_a_motor_is_made_up_that_they_hold(stated: DriveGains) -> None:
    """Four fifths of critical damping, and stable on every cable."""
    wanted = control_for(JOINT, stated)
    motor = wanted.motor
    assert (motor.stiffness_Nm_per_rad, motor.damping_Nms_per_rad) == pytest.approx(stated)
    critical = 2.0 * (stated.stiffness_Nm_per_rad * motor.inertia_kgm2) ** 0.5
    assert stated.damping_Nms_per_rad / critical == pytest.approx(0.8)
    DesignWork(JOINT, T, wanted, stiffness_range(JOINT)).check_drive()


def test_the_simulated_wrist_can_be_run_over_the_link_that_the_guide_names() -> None:
    link = load_link("mit-udp")
    gains = stated_gains(link)
    assert gains is not None
    simulated = control_for(JOINT).motor.inertia_kgm2
    assert control_for(JOINT, gains).motor.inertia_kgm2 == pytest.approx(simulated, rel=0.5)
    assert stated_gains(load_link("odrive-virtual")) is None
