"""The joint that a diagnosis ends with says how well it is known now."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from math import log
from pathlib import Path

import numpy as np
import pytest
from joints import SMALL, SMALL_NOISE, closed
from small_drive import TOLERANT, course, recorded

from cablecomp.config import Empirical, JointConfig, parse_joint
from cablecomp.config.sessions import Session
from cablecomp.config_text import joint_text
from cablecomp.diagnosis.answer.augmented import augmented_joint
from cablecomp.diagnosis.body import Columns, Sessions, gather_body
from cablecomp.diagnosis.calibration.drive import first_weights
from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.model import Model
from cablecomp.diagnosis.result import Diagnosis, Value
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import Evidence
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.parameter import of_drive
from cablecomp.estimation.problem import Problem
from cablecomp.estimation.standing import as_it_stood
from cablecomp.observer import Observer
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

VAGUE = {"pretension_N": 1.0, "mu_output": 1.0, "mu_input": 1.0, "EA_N": 0.02}
SLIP_M = 2e-4
LEFT_RAD = 0.125 * SLIP_M / (2.0 * SMALL["output_radius_m"])
"""An eighth of what a slip of one cable moves the joint by: a recording begun in mid-motion carries over more than
the sensors' noise."""
AS_BUILT = closed(SMALL)["drive"]["stage"][0]


def diagnosed(*, locked: bool) -> Diagnosis:
    """The small joint, twice as tight as stated; nothing is searched, the drive is calibrated alone."""
    drive = closed(SMALL)
    (stage,) = drive["drive"]["stage"]
    stage = {**stage, "pretension_N": 0.5 * stage["pretension_N"]}
    vague = {**drive, "drive": {**drive["drive"], "stage": [stage]}, "tolerance": VAGUE}
    columns = recorded([], 60.0, locked=locked)
    return diagnose(parse_joint(vague, "vague"), {"small/1": columns}, budget_s=0.0)


def test_what_was_known_by_order_of_magnitude_is_known_as_well_as_it_was_fitted() -> None:
    joint = diagnosed(locked=False).augmented_joint
    (stage,) = joint.drive.stage
    for name in ("pretension_N", "mu_output"):
        assert LIMITS.known <= joint.tolerance[name] < 0.7
        assert abs(log(getattr(stage, name) / AS_BUILT[name])) < 3.0 * joint.tolerance[name]
    assert joint.tolerance["EA_N"] == pytest.approx(0.02)  # no more than before


def test_what_the_recordings_do_not_tell_is_known_no_better_than_before() -> None:
    """A motor that stands still: no cable runs over the motor's pulley but by its stretch."""
    tolerance = diagnosed(locked=True).augmented_joint.tolerance
    assert tolerance["mu_input"] == pytest.approx(1.0)


def one_after_the_other(slip_s: float) -> dict[str, Columns]:
    """90 s of the small joint in which a clamp slips, cut into three recordings, each of which starts its own clock."""
    time, motor, load = course(90.0)
    slip = EffectSpec("clamp_slip", {"slip_m": SLIP_M, "time_s": slip_s})
    found = simulate(PlantConfig.from_dict(closed(SMALL)), time, motor, load, effects=[slip]).channels()
    rng = np.random.default_rng(3)
    noisy = {name: found[name] + sd * rng.standard_normal(len(time)) for name, sd in SMALL_NOISE.items()}
    parts = {f"day/{k}": (time >= 30.0 * k) & (time < 30.0 * (k + 1)) for k in range(3)}
    return {
        name: {"time_s": time[part] - time[part][0], **{c: v[part] for c, v in noisy.items()}}
        for name, part in parts.items()
    }


def left_rad(joint: JointConfig, recording: str, columns: Columns) -> float:
    """What the joint, as it stood in a recording, leaves of its second half (RMS)."""
    stood, _, _ = as_it_stood(joint, Path(recording), lambda: columns)
    predicted = Observer(stood).run(columns)["joint_position_rad"] + stood.sensors.joint_position_offset_rad
    half = len(predicted) // 2
    return float(np.sqrt(np.mean((columns["joint_position_rad"] - predicted)[half:] ** 2)))


def test_an_event_stands_on_each_recordings_own_clock() -> None:
    """Before the slip there is none, in its recording it comes when it came, and from then on it has been."""
    recordings = one_after_the_other(slip_s=45.0)
    found = diagnose(TOLERANT, recordings)
    assert [n.effect for n in found.named] == ["clamp_slip"]
    said = found.named[0].parameters
    assert said["recording"] == "day/1"
    assert isinstance(said["time_s"], Value)
    assert abs(said["time_s"].value - 15.0) < 0.2
    joint = found.augmented_joint
    instants = {}
    for name, columns in recordings.items():
        assert left_rad(joint, name, columns) < LEFT_RAD, name
        (slip,) = as_it_stood(joint, Path(name), lambda columns=columns: columns)[0].effect
        instants[name] = slip.parameters["time_s"] if slip.parameters["slip_m"] else None
    assert instants == {"day/0": None, "day/1": pytest.approx(15.0, abs=0.1), "day/2": 0.0}
    later = left_rad(joint, "day/3", recordings["day/2"])
    assert later < LEFT_RAD  # it has not been mended since
    again = diagnose(joint, recordings)
    assert again.verdict == "consistent"
    assert list(again.sessions) == ["day"]
    for name, columns in recordings.items():
        assert left_rad(again.augmented_joint, name, columns) < LEFT_RAD, name


def test_sessions_that_the_recordings_do_not_belong_to_stay_as_they_were() -> None:
    """A joint of two days: the third day's slip is not in them, nor is the factor by which one was tighter lost."""
    tension_N = TOLERANT.drive.stage[0].pretension_N
    days = (
        Session(name="mon", recordings=("mon",), values={"joint_position_offset_rad": 0.02}),
        Session(name="tue", recordings=("tue",), values={"pretension_N": 1.25 * tension_N}),
    )
    known = TOLERANT.model_copy(update={"session": days})
    evidence = gather_body(known, {"wed/0": recorded([], 16.0)}).used
    model = with_a_slip(evidence, 8.0)
    tighter = model.fit.x.copy()
    tighter[0] += log(1.1)
    joint = augmented_joint(known, replace(model, fit=replace(model.fit, x=tighter)), ())
    assert joint.effect[0].parameters["slip_m"] == pytest.approx(SLIP_M)
    stood = {day: as_it_stood(joint, Path(f"{day}/0"), dict)[0] for day in ("mon", "tue")}
    assert stood["mon"].sensors.joint_position_offset_rad == 0.02
    assert stood["mon"].drive.stage[0].pretension_N == pytest.approx(1.1 * tension_N)
    assert stood["tue"].drive.stage[0].pretension_N == pytest.approx(1.25 * 1.1 * tension_N)
    assert {s.effect[0].parameters["slip_m"] for s in stood.values()} == {0.0}


def test_laws_of_sessions_are_written_with_these_and_go_with_them() -> None:
    """What an earlier diagnosis wrote of a session that is not there any more has nowhere to hold."""
    laws = [
        Empirical(
            id="ripple", law="fourier", of="motor_position_rad", coefficients_rad=(0.0, 1e-3), session=s
        )
        for s in ("mon", "tue", "long ago", "")
    ]
    known = [Session(name="long ago", recordings=("mon/0",))]
    joint = TOLERANT.model_copy(update={"session": tuple(known), "empirical": tuple(laws[2:])})
    body = gather_body(TOLERANT, {name: recorded((), 12.0) for name in ("mon/0", "tue/0")})
    model = with_a_slip(body.used, 1e3)
    written = augmented_joint(joint, replace(model, terms=()), laws[:2])
    assert [law.session for law in written.empirical] == ["", "mon", "tue"]
    assert parse_joint(tomllib.loads(joint_text(written)), "again") == written


@pytest.mark.parametrize(
    ("again", "mode"),
    [
        ("mon", None),
        ("mon tue", None),
        ("mon tue", "each"),
        ("mon tue", "one"),
        ("wed", None),
        ("mon", "one"),
    ],
)
def test_a_law_of_one_session_stays_with_its_recordings_in_whatever_sessions_they_are_diagnosed_again(
    again: str, mode: Sessions | None
) -> None:
    """Also with the days alone that were not diagnosed again."""
    laws = tuple(
        Empirical(id=s, law="fourier", of="motor_position_rad", coefficients_rad=(0.0, 1e-3), session=s)
        for s in ("mon", "tue")
    )
    days = tuple(Session(name=s, recordings=(s,)) for s in ("mon", "tue"))
    joint = TOLERANT.model_copy(update={"session": days, "empirical": laws})
    columns = recorded((), 12.0)
    body = gather_body(joint, {f"{day}/{k}": columns for day in again.split() for k in range(2)}, mode)
    problem = Problem(joint, of_drive(joint), body.used, first_weights(joint, body.used))
    residual = problem.residual(problem.start)
    fit = Fit(problem, problem.start, residual, np.zeros((len(residual), len(problem.start))))
    written = augmented_joint(joint, Model((), fit, residual), (), body.whole_for_the_end)
    for day in ("mon", "tue", "wed"):
        for k in range(2):
            stood = as_it_stood(written, Path(f"{day}/{k}"), dict)[0]
            held = [law.id for law in stood.empirical if not law.session]
            assert held == ([day] if day in ("mon", "tue") else []), f"{day}/{k}"
    assert parse_joint(tomllib.loads(joint_text(written)), "again") == written


def with_a_slip(evidence: Sequence[Evidence], instant_s: float) -> Model:
    """A drive that slips at an instant on the common clock, as it is, not fitted."""
    slip = next(h for h in hypotheses(TOLERANT, evidence) if h.effect.id == "clamp_slip")
    values = {**slip.starts[0].values, "slip_m": SLIP_M, "time_s": instant_s}
    joint = TOLERANT.model_copy(update={"effect": (slip.entry(values),)})
    free = (*of_drive(TOLERANT), *slip.free(values, TOLERANT))
    problem = Problem(joint, free, tuple(evidence), first_weights(TOLERANT, evidence))
    x = problem.start
    residual = problem.residual(x)
    return Model((slip,), Fit(problem, x, residual, np.zeros((len(residual), len(x)))), residual)


@pytest.mark.parametrize(
    ("slips_in", "expected"),
    [
        ("mon/1", {"mon/0": None, "mon/1": 8.0, "mon/2": 0.0, "mon/later": 0.0, "tue/0": 0.0, "wed/0": 0.0}),
        ("tue/0", {"mon/0": None, "mon/1": None, "mon/later": None, "tue/0": 8.0, "tue/later": 0.0}),
    ],
)
def test_a_session_before_an_event_knows_none_and_one_after_it_does(
    slips_in: str, expected: dict[str, float | None]
) -> None:
    """Two sessions; one recording of the first is kept for the end, and stands as it stood all the same."""
    names = ("mon/0", "mon/1", "mon/2", "tue/0")
    evidence = gather_body(TOLERANT, {name: recorded([], 16.0) for name in names}).used
    (e,) = (e for e in evidence if e.name == slips_in)
    used = [e for e in evidence if e.name != "mon/0"]
    joint = augmented_joint(TOLERANT, with_a_slip(used, 8.0 + e.shift_s), (), [evidence[0]])
    for name, instant_s in expected.items():
        (slip,) = as_it_stood(joint, Path(name), dict)[0].effect
        found = slip.parameters["time_s"] if slip.parameters["slip_m"] else None
        assert found == (None if instant_s is None else pytest.approx(instant_s)), name
    assert joint.effect[0].parameters["time_s"] == 0.0  # as it stands now


@pytest.mark.parametrize(
    "names",
    [
        ("mon/s/1.csv", "tue/s/1.csv"),
        ("/data/mon/s/1.csv", "s/1.csv"),
        ("s/1.csv", "s/t/1.csv"),
        ("1.csv", "s/1.csv"),
        ("run [3]/1.csv", "run 3/1.csv"),
        ("a [1].csv", "b/a*1.csv"),
    ],
)
def test_sessions_claim_their_recordings_and_no_others(names: tuple[str, ...]) -> None:
    """Folders of one name, and one inside of another; of each a recording is kept for the end; an event in the first
    of the second."""
    zeros = {name.replace("1", k): 0.05 * i for i, name in enumerate(names) for k in "012"}
    columns = recorded([], 16.0)
    angle = columns["joint_position_rad"]
    moved = {name: {**columns, "joint_position_rad": angle + zero} for name, zero in zeros.items()}
    evidence = gather_body(TOLERANT, moved).used
    used, kept = [e for k, e in enumerate(evidence) if k % 3 < 2], evidence[2::3]
    joint = augmented_joint(TOLERANT, with_a_slip(used, 8.0 + evidence[3].shift_s), (), kept)
    again = parse_joint(tomllib.loads(joint_text(joint)), "again")
    came = []
    for name, zero in zeros.items():
        stood, _, _ = as_it_stood(again, Path(name), dict)
        assert stood.sensors.joint_position_offset_rad == pytest.approx(zero, abs=0.01), name
        (slip,) = stood.effect
        came.append(slip.parameters["time_s"] if slip.parameters["slip_m"] else None)
    assert came == [None, None, None, pytest.approx(8.0), 0.0, 0.0]
