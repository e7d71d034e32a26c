"""What is free where a drive is calibrated: what `[tolerance]` says, and what is exact on paper alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joints import SMALL, SMALL_NOISE, closed
from small_drive import course, recorded

from cablecomp.config import JointConfig, parse_joint
from cablecomp.diagnosis.answer.values import drive_values
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibrate import calibrate
from cablecomp.diagnosis.calibration.drive import calibrate_drive
from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.estimation.evidence import JOINT
from cablecomp.estimation.gather import gather
from cablecomp.estimation.least_squares import Fit, rms_left, solve
from cablecomp.estimation.parameter import of_drive
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import PlantConfig, simulate

ZERO, ANGLE = "joint_torque_offset_Nm", "joint_position_offset_rad"


def fitted(
    tolerance: dict[str, float], recordings: dict[str, dict[str, FloatArray]], *, as_stated: bool = False
) -> Fit:
    """The small joint calibrated with these tolerances."""
    joint = parse_joint({**closed(SMALL, "small"), "tolerance": tolerance}, "small")
    used = gather_body(joint, recordings, None).used
    return calibrate_drive(joint, used, np.random.default_rng(0), as_stated=as_stated).fit


@pytest.mark.parametrize(
    ("tolerance", "length_sd"),
    [
        ({}, 0.02),
        ({"EA_N": 0.05}, 0.02),
        ({"EA_N": 1.0}, None),  # what stands for the same is known far less
        ({"free_length_m": 0.1}, 0.1),
        ({"free_length_m": 0.0}, None),  # whoever says exact means it
    ],
)
def test_a_free_length_is_known_by_the_tape(tolerance: dict[str, float], length_sd: float | None) -> None:
    fit = fitted(tolerance, {"a/1": recorded([], 20.0)})
    found = {p.name: p.sd for p in fit.problem.parameters}
    assert found.get("free_length_m") == (None if length_sd is None else pytest.approx(length_sd))


@pytest.mark.parametrize(
    ("tolerance", "motor", "gain_sd"),
    [
        ({"EA_N": 0.05}, True, 0.02),
        ({"EA_N": 0.05}, False, None),  # nothing else reads force
        ({"EA_N": 1.0}, True, None),  # the drive itself bends to that
        ({"joint_torque_gain": 0.005}, True, 0.005),
        ({"joint_torque_gain": 0.0}, True, None),  # whoever says exact means it
    ],
)
def test_two_sensors_of_force_agree_to_some_percent(
    tolerance: dict[str, float], motor: bool, gain_sd: float | None
) -> None:
    columns = recorded([], 20.0)
    if motor:
        felt = simulate(PlantConfig.from_dict(closed(SMALL)), *course(20.0)).channels()["motor_torque_Nm"]
        columns["motor_torque_Nm"] = felt + 1e-3 * np.random.default_rng(5).standard_normal(len(felt))
    fit = fitted(tolerance, {"a/1": columns})
    found = {p.name: p.sd for p in fit.problem.parameters}
    assert found.get("joint_torque_gain") == (None if gain_sd is None else pytest.approx(gain_sd))


def test_a_motor_torque_that_not_all_recordings_have_is_left_out_and_said() -> None:
    """Beside it alone the gain of the joint's sensor is free."""
    with_it, without = recorded([], 20.0), recorded([], 20.0)
    felt = simulate(PlantConfig.from_dict(closed(SMALL)), *course(20.0)).channels()["motor_torque_Nm"]
    with_it["motor_torque_Nm"] = felt + 1e-3 * np.random.default_rng(5).standard_normal(len(felt))
    recordings = {"a/1": with_it, "a/2": without}
    joint = parse_joint({**closed(SMALL, "small"), "tolerance": {"EA_N": 0.05}}, "small")
    found = diagnose(joint, recordings, budget_s=0.0)
    assert "joint_torque_gain" not in {v.name for v in found.calibration}
    assert any(note.startswith("motor_torque_Nm of a/1 is left out") for note in found.notes)
    both = diagnose(joint, {"a/1": with_it, "a/2": with_it}, budget_s=0.0)
    assert "joint_torque_gain" in {v.name for v in both.calibration}
    assert not any("is left out" in note for note in both.notes)


def test_what_is_calibrated_as_stated_is_exact_without_a_tolerance() -> None:
    fit = fitted({"EA_N": 0.05}, {"a/1": recorded([], 20.0)}, as_stated=True)
    assert [p.name for p in fit.problem.parameters] == ["EA_N", "input_radius_m"]


def opened(own: list[str]) -> JointConfig:
    """The small joint as an open circuit, whose weight is known exactly; `own`: what each session has its own of."""
    plain = closed(SMALL, "small")
    drive = {**plain["drive"], "circuit": "open"}
    told = {"mu_output": 0.25, "mu_input": 0.25}
    return parse_joint({**plain, "drive": drive, "tolerance": told, "session": {"own": own}}, "small")


def hung(seed: int, misread_Nm: float) -> dict[str, FloatArray]:
    """What the plant shows of it, its torque sensor reading so much too much."""
    rng = np.random.default_rng(seed)
    time, motor, load = course(80.0, loads=0.9)
    config = closed(SMALL)
    config["drive"]["circuit"] = "open"
    found = simulate(PlantConfig.from_dict(config), time, motor, load).channels()
    seen = {k: found[k] + sd * rng.standard_normal(len(time)) for k, sd in SMALL_NOISE.items()}
    seen["joint_torque_Nm"] = seen["joint_torque_Nm"] + misread_Nm
    return {"time_s": time, **seen}


@pytest.mark.parametrize("as_stated", [False, True])
def test_a_torque_sensors_zero_is_each_sessions_own_where_it_is_named(as_stated: bool) -> None:
    sessions = {"a/1": hung(3, 0.0), "b/1": hung(4, 1e-2)}
    joint = opened(["joint_position_offset_rad", ZERO])
    used = gather_body(joint, sessions, None).used
    fit = calibrate_drive(joint, used, np.random.default_rng(0), as_stated=as_stated).fit
    largest = max(float(np.max(np.abs(s["joint_torque_Nm"]))) for s in sessions.values())
    found = {p.session: p for p in fit.problem.parameters if p.base == ZERO}
    assert set(found) == {"a", "b"}
    assert found["a"].scale == pytest.approx(0.005 * largest, rel=0.03)
    assert fit.values[f"{ZERO}@b"] - fit.values[f"{ZERO}@a"] == pytest.approx(1e-2, rel=0.2)
    common = opened(["joint_position_offset_rad"])
    fit = calibrate_drive(common, gather_body(common, sessions, None).used, np.random.default_rng(0)).fit
    assert ZERO not in {p.base for p in fit.problem.parameters}


def test_an_encoder_that_dies_early_still_counts() -> None:
    """What the history before takes of a recording is no more than half of its readings."""
    joint = parse_joint({**closed(SMALL, "small"), "tolerance": {"EA_N": 0.03}}, "small")
    whole, died = recorded([], 40.0), recorded([], 40.0)
    died["joint_position_rad"][len(died["time_s"]) // 25 :] = np.nan
    used = gather_body(joint, {"a/1": whole, "a/2": died}, None).used
    fit = calibrate_drive(joint, used, np.random.default_rng(0)).fit
    before = {e.name: int(e.counted["joint_position_rad"].sum()) for e in used}
    after = {e.name: int(e.counted["joint_position_rad"].sum()) for e in fit.problem.evidence}
    assert after["a/2"] >= before["a/2"] // 2 > 10


def test_each_of_several_values_is_each_sessions_own() -> None:
    """Of three sessions, whatever stands beside them: none is lost, and no other takes its place."""
    config = closed(SMALL, "small")
    own = ["joint_position_offset_rad", ZERO, "pretension_N"]
    told = {"EA_N": 0.03, "pretension_N": 0.05, "mu_output": 0.1, "mu_input": 0.1}
    joint = parse_joint({**config, "tolerance": told, "session": {"own": own}}, "small")
    used = gather_body(joint, {f"{s}/1": recorded([], 20.0) for s in "abc"}, None).used
    names = [p.name for p in calibrate_drive(joint, used, np.random.default_rng(0)).fit.problem.parameters]
    common = ["EA_N", "free_length_m", "input_radius_m", "mu_input", "mu_output"]
    assert sorted(names) == sorted(common + [f"{n}@{s}" for n in own[1:] for s in "abc"])


@pytest.mark.parametrize("by", ["calibrate", "diagnose"])
@pytest.mark.parametrize(("known", "sessions"), [(0.1, "ab"), (None, "ab"), (None, "a")])
def test_what_may_differ_between_sessions_and_has_no_tolerance_is_said(
    by: str, known: float | None, sessions: str
) -> None:
    """It is taken as exact, which whoever names it hardly means; of one session nothing can differ."""
    told = {"EA_N": 0.03, **({} if known is None else {"mu_output": known})}
    own = {"own": ["joint_position_offset_rad", ZERO, "mu_output"]}
    joint = parse_joint({**closed(SMALL, "small"), "tolerance": told, "session": own}, "small")
    recordings = {f"{s}/1": recorded([], 20.0) for s in sessions}
    found = calibrate(joint, recordings) if by == "calibrate" else diagnose(joint, recordings, budget_s=0.0)
    lines = [w for w in found.warnings if "[session] own" in w]
    assert [w.partition(",")[0] for w in lines] == (
        ["[session] own names mu_output"] if known is None and len(sessions) > 1 else []
    )


@pytest.mark.parametrize("by", ["calibrate", "diagnose"])
def test_a_tolerance_in_a_unit_of_its_own_stays_in_it(by: str) -> None:
    """A torque's zero known to 50 mN m: told to some of them, not to some hundredths of 1 N m."""
    stated_Nm, misread_Nm = 0.05, 0.03
    plain = opened(["joint_position_offset_rad"])
    joint = plain.model_copy(update={"tolerance": {**plain.tolerance, ZERO: stated_Nm}})
    recordings = {"a/1": hung(3, misread_Nm)}
    if by == "calibrate":
        found = calibrate(joint, recordings).config
    else:
        found = diagnose(joint, recordings, budget_s=0.0).augmented_joint
    assert 0.0 < found.tolerance[ZERO] < 0.4 * stated_Nm
    assert abs(found.sensors.joint_torque_offset_Nm - misread_Nm) < 3.0 * found.tolerance[ZERO]


def test_calibrate_tells_each_sessions_torque_zero() -> None:
    sessions = {"a/1": hung(3, 0.0), "b/1": hung(4, 1e-2)}
    found = calibrate(opened(["joint_position_offset_rad", ZERO]), sessions)
    values = {v.session: v for v in found.values if v.name.startswith(ZERO)}
    apart = values["b"].value - values["a"].value
    assert abs(apart - 1e-2) < 3.0 * np.hypot(values["a"].sd, values["b"].sd)
    common = found.config.sensors.joint_torque_offset_Nm
    stood = {s.name: s.values.get(ZERO, common) for s in found.config.sessions}
    assert stood == pytest.approx({k: v.value for k, v in values.items() if k})


def test_a_sessions_own_value_begins_where_the_session_states_it() -> None:
    """Two mountings as they stood: nothing is left to be found, and each is told by its own."""
    plain = closed(SMALL, "small")
    tension_N = plain["drive"]["stage"][0]["pretension_N"]
    sessions = [
        {"name": "tight", "recordings": ["tight"], "values": {"pretension_N": 1.3 * tension_N}},
        {"name": "loose", "recordings": ["loose"], "values": {"pretension_N": 0.8 * tension_N}},
    ]
    joint = parse_joint({**plain, "tolerance": {"pretension_N": 0.05}, "session": sessions}, "small")
    recordings = {
        f"{name}/1": mounted(factor * tension_N) for name, factor in (("tight", 1.3), ("loose", 0.8))
    }
    drive = calibrate_drive(joint, gather_body(joint, recordings).used, np.random.default_rng(0))
    own = {p.session: (p.start, p.centre) for p in drive.fit.problem.parameters if p.base == "pretension_N"}
    assert own["tight"] == pytest.approx((1.3 * tension_N, 1.3 * tension_N))
    assert own["loose"] == pytest.approx((0.8 * tension_N, 0.8 * tension_N))
    stated = {
        v.session: v.nominal for v in drive_values(drive.fit, joint) if v.name.startswith("pretension_N")
    }
    assert stated == pytest.approx({"tight": 1.3 * tension_N, "loose": 0.8 * tension_N})
    assert rms_left(drive.nominal) < 1.1 * drive.floor_rad
    one = parse_joint({**plain, "tolerance": {"pretension_N": 0.05}}, "small")
    drive = calibrate_drive(one, gather_body(one, recordings).used, np.random.default_rng(0))
    assert rms_left(drive.nominal) > 10.0 * drive.floor_rad  # it is what is stated that tells


def test_an_encoders_zero_was_what_its_session_states() -> None:
    """Of a session that has a part with a zero of its own: the session's. Where none is stated: the joint's."""
    plain = closed(SMALL, "small")
    sessions = [
        {"name": "set", "mounting": "mon", "recordings": ["mon/2"], "values": {ANGLE: 0.5}},
        {"name": "mon", "recordings": ["mon"], "values": {ANGLE: 0.25}},
        {"name": "tue", "recordings": ["tue"], "values": {"mu_output": 0.1}},
    ]
    told = {"tolerance": {"mu_output": 0.1}, "sensors": {ANGLE: 0.125}}
    joint = parse_joint({**plain, **told, "session": sessions}, "small")
    columns = recorded([], 20.0)
    recordings = dict.fromkeys(("mon/2", "mon/1", "tue/1", "wed/1"), columns)
    fit = calibrate_drive(joint, gather_body(joint, recordings).used, np.random.default_rng(0)).fit
    found = {v.session: v.nominal for v in drive_values(fit, joint) if v.name.startswith(ANGLE)}
    assert found == {"mon": 0.25, "tue": 0.125, "wed": 0.125}


@pytest.mark.parametrize(
    ("factor", "tolerance", "circuit", "sessions"),
    [
        (1.04, {"EA_N": 0.03, "pretension_N": 0.08}, "closed", "ab"),
        (1.0, {"EA_N": 0.03, "pretension_N": 0.08}, "closed", ""),  # nothing differs
        (1.04, {"EA_N": 0.03}, "closed", ""),  # pretension is exact
        (1.04, {"EA_N": 1.0, "pretension_N": 1.0}, "closed", ""),  # the search asks for that beside effects
        (1.04, {"EA_N": 0.03, "pretension_N": 0.08}, "open", ""),  # a weight is the same
    ],
)
def test_cables_that_were_taken_off_are_tightened_anew(
    factor: float, tolerance: dict[str, float], circuit: str, sessions: str
) -> None:
    """The plant's two sessions, one of them tighter by so much, and `[session] own` names nothing."""
    plain = closed(SMALL, "small")
    tension_N = plain["drive"]["stage"][0]["pretension_N"]
    recordings = {"a/1": mounted(tension_N), "b/1": mounted(factor * tension_N, 6)}
    raw = {**plain, "drive": {**plain["drive"], "circuit": circuit}, "tolerance": tolerance}
    joint = parse_joint(raw, "small")
    fit = calibrate_drive(joint, gather_body(joint, recordings).used, np.random.default_rng(0)).fit
    own = {p.session: p for p in fit.problem.parameters if p.base == "pretension_N" and p.session}
    assert sorted(own) == list(sessions)
    if own:
        ratio = fit.values["pretension_N@b"] / fit.values["pretension_N@a"]
        assert ratio == pytest.approx(factor, abs=0.005)


def mounted(pretension_N: float, seed: int = 5) -> dict[str, FloatArray]:
    """What the plant shows of the small joint with this pretension."""
    plain = closed(SMALL)
    (stage,) = plain["drive"]["stage"]
    built = {**plain, "drive": {**plain["drive"], "stage": [{**stage, "pretension_N": pretension_N}]}}
    rng = np.random.default_rng(seed)
    time, motor, load = course(40.0)
    found = simulate(PlantConfig.from_dict(built), time, motor, load).channels()
    return {
        "time_s": time,
        **{k: found[k] + sd * rng.standard_normal(len(time)) for k, sd in SMALL_NOISE.items()},
    }


def test_a_calibration_hears_nothing_of_the_rows_that_are_kept_for_the_end() -> None:
    joint = parse_joint(closed(SMALL, "small"), "small")
    (used,) = gather_body(joint, {"a/1": recorded([], 24.0)}, rows=250).used
    last = int(np.flatnonzero(used.counted[JOINT])[-1])
    # a judged row's reading is averaged with those that are nearer to it than to the next one
    kept = np.arange(len(used.columns["time_s"])) > (used.rows[last] + used.rows[last + 1]) // 2
    angle = used.columns[JOINT] + 0.1 * np.sin(np.arange(len(kept))) * kept
    other = replace(used, columns={**used.columns, JOINT: angle})
    one, two = (calibrate_drive(joint, [e], np.random.default_rng(0)) for e in (used, other))
    assert np.array_equal(one.fit.x, two.fit.x)
    assert one.floor_rad == pytest.approx(two.floor_rad, rel=1e-9)


def test_a_zero_is_known_no_better_than_what_it_goes_along_with_and_what_recordings_depart_by() -> None:
    """Of a load to one side: as an explicit least squares fit of zero and parameters has it; of two recordings whose
    zeros depart by chance: that over sqrt(2)."""
    joint = parse_joint({**closed(SMALL, "small"), "tolerance": {"EA_N": 0.9}}, "small")
    load = 0.5 + 0.1 * np.sin(np.arange(400.0))
    rigid = {"time_s": 0.02 * np.arange(400.0), "motor_position_rad": np.zeros(400), "joint_torque_Nm": load}
    fits = []
    for names, departs in (("a", 0.0), ("ab", 1e-3)):
        columns = {**rigid, JOINT: 1e-3 * load}
        parts = [gather(joint, n, columns, "one", fine_rows=400, judged_rows=400) for n in names]
        weighing = Weighing({JOINT: 1e-5}, {JOINT: departs})
        fits.append(solve(Problem(joint, of_drive(joint), tuple(parts), weighing), evaluations=3))
    one, two = (next(v.sd for v in drive_values(f, joint) if v.name == ANGLE) for f in fits)
    assert two == pytest.approx(1e-3 / 2.0**0.5, rel=0.05)
    problem, x = fits[0].problem, fits[0].x
    weight = problem.evidence[0].weight / 1e-5
    moved = [problem.misfits(x + s)[JOINT][0] - problem.misfits(x)[JOINT][0] for s in 1e-3 * np.eye(len(x))]
    rows = np.column_stack([weight, *(weight * m / 1e-3 for m in moved)])
    prior = np.diag([0.0, *(1.0 / p.sd for p in problem.parameters)])
    assert one == pytest.approx(np.linalg.inv(rows.T @ rows + prior**2)[0, 0] ** 0.5, rel=0.01)
    assert one > 5.0 * 1e-5 / 400.0**0.5


def test_readings_without_any_noise_have_a_floor_to_be_told_in_units_of() -> None:
    still = {c: np.zeros(400) for c in ("motor_position_rad", "joint_torque_Nm", JOINT)}
    joint = parse_joint(closed(SMALL, "small"), "small")
    used = gather_body(joint, {"a/1": {**still, "time_s": 0.02 * np.arange(400.0)}}).used
    drive = calibrate_drive(joint, used, np.random.default_rng(0))
    assert 0.0 < drive.floor_rad < 1e-11
