"""The diagnosis on recordings of the simulated plant: nothing is named where nothing is missing, and what is, is."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from joints import SMALL, SMALL_NOISE, SMALL_TOLERANCE, closed
from threadpoolctl import threadpool_info, threadpool_limits
from turning import JOINT, recorded

from cablecomp.config import JointConfig, parse_joint
from cablecomp.config_text import joint_text
from cablecomp.diagnosis import diagnose as diagnose_module
from cablecomp.diagnosis.diagnose import diagnose
from cablecomp.diagnosis.result import Diagnosis, report_json
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation import parallel
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

BEARING = EffectSpec("bearing_friction", {"torque_Nm": 0.03, "load_coefficient": 0.0, "presliding_rad": 2e-4})
ROUTING = EffectSpec("routing_friction", {"mu_angle": 0.3, "arc_length_m": 0.01})


def joint() -> JointConfig:
    """The nominal joint; what is known of it, and how well."""
    return parse_joint({**closed(SMALL, "small"), "tolerance": SMALL_TOLERANCE}, "small")


def recording(
    effects: list[EffectSpec], seed: int = 3, tighter: float = 1.0, noise: Mapping[str, float] = SMALL_NOISE
) -> dict[str, FloatArray]:
    """24 s at 25 Hz of the plant: both pulleys turning, load of two frequencies, noise on all channels; cables
    `tighter` times as tight as they are meant to be."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 24.0, 0.04)
    soft = 1.0 - np.exp(-time)
    motor = soft * (0.8 * np.sin(1.1 * time) + 0.5 * np.sin(2.1 * time))
    load = soft * (0.9 * np.sin(1.7 * time) + 0.6 * np.sin(2.9 * time))
    stage = {**SMALL, "pretension_N": tighter * float(SMALL["pretension_N"])}
    config = PlantConfig.from_dict(closed(stage))
    found = simulate(config, time, motor, load, effects=effects).channels()
    columns = {"time_s": time}
    for name, sigma in noise.items():
        columns[name] = found[name] + sigma * rng.standard_normal(len(time))
    return columns


def diagnosed(effects: list[EffectSpec]) -> Diagnosis:
    return diagnose(joint(), {"small/1": recording(effects)})


def parsed(d: Diagnosis) -> dict[str, Any]:
    """The report as a reader of the file has it; no NaN gets in."""
    found: dict[str, Any] = json.loads(json.dumps(report_json(d), allow_nan=False))
    return found


@pytest.fixture(scope="module")
def nothing() -> Diagnosis:
    return diagnosed([])


@pytest.fixture(scope="module")
def routing() -> Diagnosis:
    return diagnosed([ROUTING])


def test_nothing_missing_is_consistent(nothing: Diagnosis) -> None:
    assert nothing.verdict == "consistent"
    assert not nothing.named
    assert nothing.augmented == nothing.baseline
    assert nothing.baseline.heldout_rmse_rad < 1.5 * nothing.noise_floor_rad


def test_consistent_says_what_these_data_could_have_shown(nothing: Diagnosis) -> None:
    below = {u["effect"]: u["below"] for u in nothing.could_be_unseen}
    assert below["bearing_friction"] is not None
    assert below["bearing_friction"] < BEARING.parameters["torque_Nm"]


def test_routing_friction_is_named_and_predicts_what_nobody_had_seen(routing: Diagnosis) -> None:
    (found,) = routing.named
    assert found.effect == "routing_friction"
    assert routing.verdict in ("explained", "partly explained")
    assert routing.augmented.heldout_rmse_rad < 0.5 * routing.baseline.heldout_rmse_rad
    assert routing.augmented.final_rmse_rad < 0.5 * routing.baseline.final_rmse_rad
    assert found.heldout_gain > 0.5
    # the residual without it follows what it acts through; no rival in any form comes near
    assert found.evidence["unfollowed"] < LIMITS.unfollowed
    assert found.evidence["form_margin_z"] > LIMITS.z


def test_bearing_friction_is_named_with_its_size() -> None:
    found = diagnosed([BEARING])
    (named,) = found.named
    assert named.effect == "bearing_friction"
    torque = named.parameters["torque_Nm"]
    assert not isinstance(torque, str)
    assert abs(torque.value - 0.03) < 4.0 * torque.sd + 0.03 * 0.03


def test_the_report_holds_what_the_contract_says(routing: Diagnosis) -> None:
    report = parsed(routing)
    assert report["schema"] == 2
    for key in (
        "recordings", "sessions", "verdict", "noise_floor_rad", "repeatability_rad", "baseline", "augmented", "heldout",
        "channels", "calibration", "mismatch", "missing_physics", "candidates", "not_excluded", "empirical",
        "next_experiment", "could_be_unseen", "remainder", "runtime_s",
    ):  # fmt: skip
        assert key in report, key
    assert set(report["baseline"]) == {"rmse_rad", "heldout_rmse_rad", "final_rmse_rad"}
    assert report["sessions"] == {"small": ["small/1"]}
    assert all(m["confidence"] >= 0.5 for m in report["missing_physics"])


def test_the_augmented_joint_is_written_and_read_as_it_is(routing: Diagnosis) -> None:
    import tomllib

    again = parse_joint(tomllib.loads(joint_text(routing.augmented_joint)), "again")
    assert [e.id for e in again.effect] == ["routing_friction"]


def test_the_same_seed_gives_the_same_report(nothing: Diagnosis, monkeypatch: pytest.MonkeyPatch) -> None:
    """In how many threads the fits are done changes nothing."""
    monkeypatch.setattr(parallel, "_threads", lambda: 2)
    again, before = parsed(diagnosed([])), parsed(nothing)
    for report in (again, before):
        report.pop("runtime_s")
    assert again == before


def test_a_pretension_that_differs_between_sessions_is_no_event() -> None:
    """Mounted anew, a drive is a little tighter: sessions follow each other, and the step between them is no slip."""
    d = diagnose(joint(), {"monday/1": recording([], 3, 0.95), "tuesday/1": recording([], 4, 1.05)})
    assert not d.named
    found = {v.session: v.value for v in d.calibration if v.name.startswith("pretension_N@")}
    # how tight both are trades places with friction; by how much they differ does not
    assert found["tuesday"] / found["monday"] == pytest.approx(1.05 / 0.95, rel=0.02)
    assert d.verdict in ("consistent", "recalibrate")
    # what one pretension for both leaves, it no longer does before anything is asked for
    assert d.baseline.heldout_rmse_rad < 1.1 * d.noise_floor_rad


@pytest.mark.parametrize("off", [0.95, 1.05])
def test_a_free_length_stated_a_little_wrong_is_no_physics(off: float) -> None:
    """Where a cable leaves its drums is read off by the tape. Were the length exact, the cable's stiffness would make
    up for it, a dozen of its standard deviations off."""
    stage = {**SMALL, "free_length_m": off * float(SMALL["free_length_m"])}
    told = parse_joint({**closed(stage, "small"), "tolerance": SMALL_TOLERANCE}, "small")
    found = diagnose(told, {"small/1": recording([])})
    assert not found.named
    assert found.verdict in ("consistent", "recalibrate")
    values = {v.name: v for v in found.calibration}
    for name in ("EA_N", "free_length_m"):
        assert abs(values[name].value - float(SMALL[name])) < 3.0 * values[name].sd


def test_a_torque_sensor_that_reads_too_much_is_no_physics() -> None:
    """The motor's torque shows 3 % less of the load than the joint's sensor reads: a late clock was named for it
    (0.82), and with two recordings friction of the motor."""
    columns = recording([], noise={**SMALL_NOISE, "motor_torque_Nm": 1e-3})
    columns["joint_torque_Nm"] = 1.03 * columns["joint_torque_Nm"]
    d = diagnose(joint(), {"small/1": columns})
    assert not d.named
    assert d.verdict in ("consistent", "recalibrate")
    gain = next(v for v in d.calibration if v.name == "joint_torque_gain")
    assert abs(gain.value - 1.03) < 3.0 * gain.sd
    assert d.augmented_joint.sensors.joint_torque_gain == pytest.approx(gain.value)


def test_a_budget_that_is_over_ends_the_search_with_what_there_is_and_says_so(nothing: Diagnosis) -> None:
    found = diagnose(joint(), {"small/1": recording([BEARING])}, budget_s=0.0)
    assert any("0 s were over" in line for line in found.warnings)
    assert not found.named
    assert found.tested == ()
    assert found.augmented.rmse_rad == found.baseline.rmse_rad
    assert not any("were over" in line for line in nothing.warnings)


def test_linear_algebra_keeps_to_one_thread_meanwhile() -> None:
    """Of many small systems its threads only wait for each other."""

    def threads() -> set[int]:
        return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}

    seen: set[int] = set()
    with threadpool_limits(limits=2, user_api="blas"):
        before = threads()
        diagnose(
            joint(), {"small/1": recording([])}, lambda what, share: seen.update(threads()), budget_s=0.0
        )
        assert threads() == before
    assert seen == {1}


def test_of_many_recordings_in_which_nothing_is_missing_all_are_reported() -> None:
    """More than are searched; a budget of none ends the search, not the report."""
    parts = {f"s/{k}": recorded(seed=k, duration_s=6.0) for k in range(14)}
    found = diagnose(JOINT, parts, budget_s=0.0)
    assert found.named == ()
    assert len(found.final) + len(found.traces) == len(parts)


@pytest.mark.parametrize("sigmas", [8.0, 40.0, 1000.0])
def test_a_zero_set_anew_between_recordings_is_no_slip(sigmas: float) -> None:
    """A drum that slips between two recordings would show the same, so no name is given."""
    first, second = recording([], seed=3), recording([], seed=4)
    apart = sigmas * SMALL_NOISE["joint_position_rad"]
    second["joint_position_rad"] += apart
    found = diagnose(joint(), {"small/1": first, "small/2": second})
    assert not found.named
    assert found.verdict in ("consistent", "recalibrate")
    if sigmas < 1000.0:
        return
    assert any("small/2: its zero lies" in line for line in found.warnings)
    own = [s.values["joint_position_offset_rad"] for s in found.augmented_joint.session if s.recordings]
    common = found.augmented_joint.sensors.joint_position_offset_rad
    assert own == [pytest.approx(common + apart, rel=0.01)]


@pytest.mark.parametrize(
    ("z", "surest", "put_in", "kept"),
    [
        ([-2.7, -0.6, 0.2], 0.4, "", 1),
        ([-2.7, -0.6, 0.2], 0.6, "", 3),
        ([0.1, 0.2], 0.4, "", 2),
        ([2.2, 8.0], 0.4, "0", 1),
        ([-1.0], 0.1, "", 1),
    ],
)
def test_where_none_is_sure_what_is_not_missed_beside_the_others_goes_weakest_first(
    monkeypatch: pytest.MonkeyPatch, z: list[float], surest: float, put_in: str, kept: int
) -> None:
    """Of three that trade places the last is missed (z = 5) once it is alone; where one is sure all stay, as one alone
    does whatever it shows; what was put in another's place has to be missed as a further effect has."""
    shown = {str(k): v for k, v in enumerate(z)}

    def weighed(names: Sequence[str], *_: Any) -> list[Any]:
        alone = len(names) == 1 and len(z) > 1
        return [
            SimpleNamespace(
                term=SimpleNamespace(name=n),
                depends=None,
                confidence=surest,
                evidence={"z": 5.0 if alone else shown[n]},
                better=None,
            )
            for n in names
        ]

    def less(found: Any, term: Any, drive: Any) -> Any:
        final = [n for n in found.final.fit if n != term.name]
        return SimpleNamespace(final=SimpleNamespace(fit=final), put_in=put_in)

    case: Any = SimpleNamespace(
        remainder_of=lambda fit, rng: SimpleNamespace(location=None), locate=None, drive=None
    )
    monkeypatch.setattr(diagnose_module, "weigh", lambda found, *_: weighed(found.final.fit))
    monkeypatch.setattr(diagnose_module, "share_left", lambda drive, final: 0.0)
    monkeypatch.setattr(diagnose_module, "done_without", less)
    begin: Any = SimpleNamespace(final=SimpleNamespace(fit=list(shown)), put_in=put_in)
    found, _, last = diagnose_module._weighed(case, begin, np.random.default_rng(0))
    assert len(last) == kept
    assert [w.term.name for w in last] == list(found.final.fit)
    strongest = max(shown, key=lambda n: shown[n])
    assert strongest in [w.term.name for w in last]


@pytest.mark.parametrize(("follows", "came_to"), [(True, 1 + LIMITS.exchanges), (False, 1)])
def test_what_predicts_better_in_the_place_of_an_effect_is_put_there_a_few_times_at_most(
    monkeypatch: pytest.MonkeyPatch, follows: bool, came_to: int
) -> None:
    """Of two in whose place another is better, the one that is beaten by more goes first; where the drive cannot follow
    with it, the model stays as it was."""

    def weighed(found: Any, *_: Any) -> list[Any]:
        return [
            SimpleNamespace(
                term=SimpleNamespace(name=f"{k}"), depends=None, confidence=0.9, evidence={"z": 5.0},
                difference=SimpleNamespace(z=-float(k)), better=(*found.final.fit, f"in place of {k}"),
            )
            for k in range(3)
        ]  # fmt: skip

    def exchanged(found: Any, model: Any, drive: Any) -> Any:
        return SimpleNamespace(final=SimpleNamespace(fit=model), put_in="") if follows else None

    case: Any = SimpleNamespace(
        remainder_of=lambda fit, rng: SimpleNamespace(location=None), locate=None, drive=None
    )
    monkeypatch.setattr(diagnose_module, "weigh", weighed)
    monkeypatch.setattr(diagnose_module, "share_left", lambda drive, final: 0.0)
    monkeypatch.setattr(diagnose_module, "exchanged", exchanged)
    begin: Any = SimpleNamespace(final=SimpleNamespace(fit=("begun",)), put_in="")
    found, _, last = diagnose_module._weighed(case, begin, np.random.default_rng(0))
    assert found.final.fit == ("begun", *["in place of 2"] * (came_to - 1))
    assert len(last) == 3
