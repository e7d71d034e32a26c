"""The drive in python-control: the exact system is the observer, the reduced one its loops at a fixed motor."""

from __future__ import annotations

import math
from pathlib import Path

import control
import numpy as np
import pytest

from cablecomp.config import load_joint
from cablecomp.control.nonlinear_system import to_nlsys
from cablecomp.control.stiffness import greatest_load, stiffness_range
from cablecomp.errors import InputError
from cablecomp.observer import Observer
from cablecomp.signals import Sample

JOINTS = Path(__file__).parents[2] / "configs/joints"
JOINT = load_joint(JOINTS / "wrist-capstan.toml")
T = 1e-3


def course(count: int) -> tuple[np.ndarray, np.ndarray]:
    times = np.arange(count) * T
    return times, np.vstack([0.5 * np.sin(9.0 * times), 1.1 * np.sin(31.0 * times)])


def test_the_exact_system_is_the_observer() -> None:
    system = to_nlsys(JOINT, T)
    times, inputs = course(150)
    found = control.input_output_response(system, times, inputs, system.params["start"])
    observer = Observer(JOINT)
    observer.step(Sample(0.0, 0.0, 0.0, 0.0, 0.0, 20.0))
    for k in range(150):
        motor, load = (float(u) for u in inputs[:, k])
        expected = observer.step(Sample(float(times[k]) + T, motor, load, 0.0, 0.0, 20.0))
        assert found.outputs[0, k] == pytest.approx(expected.joint_position_rad, abs=1e-14)
        assert found.outputs[2, k] == pytest.approx(expected.tension_h_N, abs=1e-10)


def test_a_state_of_zeros_is_a_joint_that_nothing_was_done_to() -> None:
    """What python-control starts from unless it is told otherwise."""
    system = to_nlsys(JOINT, T)
    times, inputs = course(20)
    found = control.input_output_response(system, times, inputs)
    observer = Observer(JOINT)
    for k in range(20):
        motor, load = (float(u) for u in inputs[:, k])
        expected = observer.step(Sample(k * T, motor, load, 0.0, 0.0, 20.0))
        assert found.outputs[0, k] == pytest.approx(expected.joint_position_rad, abs=1e-14)
    steps = control.step_response(system, np.arange(4) * T)
    assert np.isfinite(steps.outputs).all()


def test_a_simulation_goes_on_from_any_state_at_any_time() -> None:
    """Two halves, the second from time 0 again, are the whole."""
    system = to_nlsys(JOINT, T)
    times, inputs = course(40)
    whole = control.input_output_response(system, times, inputs)
    first = control.input_output_response(system, times[:21], inputs[:, :21], return_x=True)
    second = control.input_output_response(system, times[:20], inputs[:, 20:], first.states[:, 20])
    assert np.array_equal(second.outputs, whole.outputs[:, 20:])


@pytest.mark.parametrize("name", [path.stem for path in sorted(JOINTS.glob("*.toml"))])
def test_the_reduced_system_follows_loops_that_it_was_not_fitted_to(name: str) -> None:
    """Within 3 % of the deflection's range, motor at any fixed angle."""
    joint = load_joint(JOINTS / f"{name}.toml")
    system = to_nlsys(joint, T, states=16)
    most = greatest_load(joint)
    phase = np.linspace(0.0, 6.0 * np.pi, 300)
    loads = 0.45 * most * (1.0 - np.cos(phase)) * (0.6 + 0.4 * np.cos(0.37 * phase))
    motors = np.full(300, 0.1)
    found = control.input_output_response(system, np.arange(300) * T, np.vstack([motors, loads])).outputs
    observer = Observer(joint)
    channels = (0.0,) * len(observer.channels)
    exact = [
        observer.step(Sample(k * T, 0.1, float(m), 0.0, 0.0, 20.0, channels)) for k, m in enumerate(loads)
    ]
    wanted = np.array([e.deflection_rad for e in exact])
    scale = np.abs(stiffness_range(joint).deflection_rad).max()
    assert np.abs(found[1] - wanted).max() < 0.03 * scale
    assert found[0] == pytest.approx(joint.drive.ratio * 0.1 + found[1])


def test_more_plays_are_closer() -> None:
    rms = [to_nlsys(JOINT, states=n).params["rms_rad"] for n in (1, 3, 9, 24)]
    assert rms == sorted(rms, reverse=True)


def test_the_reduced_system_has_operating_points_and_a_linearisation() -> None:
    """A point that is held stays; the compliance there is the tangent along the present direction."""
    system = to_nlsys(JOINT, T, states=12)
    inputs = np.array([0.3, 0.7])
    there = control.find_operating_point(system, np.zeros(12), inputs)
    assert system.dynamics(0.0, there.states, inputs) == pytest.approx(there.states)
    linear = control.linearize(system, there, copy_names=True)["deflection_rad", "joint_torque_Nm"]
    gain = float(linear.D[0, 0])
    ahead = system.output(0.0, there.states, inputs + np.array([0.0, 1e-3]))[1]
    assert gain == pytest.approx((ahead - system.output(0.0, there.states, inputs)[1]) / 1e-3, rel=1e-3)
    assert np.isfinite(control.step_response(system, np.arange(30) * T).outputs).all()


def test_what_tries_states_of_its_own_is_sent_to_the_reduced_system() -> None:
    system = to_nlsys(JOINT, T)
    with pytest.raises(InputError, match=r"to_nlsys\(joint, states=16\)"):
        system.dynamics(0.0, np.ones(system.nstates), np.zeros(2))


@pytest.mark.parametrize("states", [0, -1, 65, 1.5, math.nan, "16"])
def test_a_number_of_states_that_makes_no_sense_is_refused(states: int) -> None:
    with pytest.raises(InputError, match="1 to 64"):
        to_nlsys(JOINT, states=states)


@pytest.mark.parametrize("time_s", [0.0, -1e-3, math.nan, math.inf])
def test_a_period_that_is_no_time_is_refused(time_s: float) -> None:
    with pytest.raises(InputError, match="period_s"):
        to_nlsys(JOINT, time_s)


@pytest.mark.parametrize("load_Nm", [0.0, math.nan, math.inf])
def test_a_load_that_none_is_fitted_to_is_refused(load_Nm: float) -> None:
    with pytest.raises(InputError, match="load_max_Nm"):
        to_nlsys(JOINT, states=4, load_max_Nm=load_Nm)
