"""An effect tried together with a pretension of each session's own, on the simulated plant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joints import SMALL, SMALL_NOISE, closed

from cablecomp.config import JointConfig, parse_joint
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibration.drive import first_weights
from cablecomp.diagnosis.explain import dependence
from cablecomp.diagnosis.explain.hypotheses import Hypothesis, hypotheses
from cablecomp.diagnosis.explain.pairs import with_own_pretensions
from cablecomp.diagnosis.explain.screening import with_entry
from cablecomp.estimation.parameter import of_drive
from cablecomp.estimation.problem import Problem
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import EffectSpec, PlantConfig, simulate

TIGHT, LOOSE, TORQUE = 90.0, 18.0, 0.03


def joint() -> JointConfig:
    """Known by order of magnitude: how tight its cables are."""
    stage = {**SMALL, "pretension_N": 60.0}
    return parse_joint({**closed(stage, "small"), "tolerance": {"pretension_N": 1.0}}, "small")


def recording(pretension_N: float, seed: int) -> dict[str, FloatArray]:
    """10 s at 50 Hz of the plant with a bearing's friction."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 10.0, 0.02)
    motor, load = 0.8 * np.sin(1.1 * time), 0.4 * np.sin(1.7 * time) + 0.2 * np.sin(2.9 * time)
    bearing = EffectSpec(
        "bearing_friction", {"torque_Nm": TORQUE, "load_coefficient": 0.0, "presliding_rad": 2e-4}
    )
    config = PlantConfig.from_dict(closed({**SMALL, "pretension_N": pretension_N}))
    found = simulate(config, time, motor, load, effects=[bearing]).channels()
    noisy = {n: found[n] + sigma * rng.standard_normal(len(time)) for n, sigma in SMALL_NOISE.items()}
    return {"time_s": time, **noisy}


@pytest.fixture(scope="module")
def begun() -> tuple[Problem, Hypothesis]:
    """The nominal drive with a bearing's friction put beside it, about two sessions."""
    config = joint()
    body = gather_body(config, {"tight/1": recording(TIGHT, 1), "loose/1": recording(LOOSE, 2)})
    problem = Problem(config, of_drive(config), body.used, first_weights(config, body.used))
    bearing = next(h for h in hypotheses(config, body.used) if h.name == "bearing_friction")
    return with_entry(problem, bearing, bearing.entry(bearing.starts[0].values)), bearing


COLD = {"effect.bearing_friction.torque_Nm": 0.1, "effect.bearing_friction.presliding_rad": 5e-4}


def test_sessions_whose_cables_are_five_times_as_tight_are_told_together_with_the_friction(
    begun: tuple[Problem, Hypothesis],
) -> None:
    problem, bearing = begun
    found = with_own_pretensions(problem, bearing, {"pretension_N": 60.0}, COLD, "block")
    assert found is not None
    dependence, fit = found
    assert dependence.name == "pretension_N by session"
    values = fit.values
    assert values["pretension_N@tight"] == pytest.approx(TIGHT, rel=0.1)
    assert values["pretension_N@loose"] == pytest.approx(LOOSE, rel=0.1)
    assert values["effect.bearing_friction.torque_Nm"] == pytest.approx(TORQUE, rel=0.1)


def test_a_session_of_one_recording_has_no_pretension_of_its_own_where_whole_ones_are_left_out(
    begun: tuple[Problem, Hypothesis],
) -> None:
    problem, bearing = begun
    assert with_own_pretensions(problem, bearing, {"pretension_N": 60.0}, COLD, "recording") is None


@pytest.mark.parametrize(("third", "by", "own"), [(1, "recording", 0), (2, "recording", 1), (1, "block", 1)])
def test_a_friction_of_each_sessions_own_is_not_asked_for_where_one_recording_alone_would_judge_it(
    third: int, by: str, own: int, begun: tuple[Problem, Hypothesis]
) -> None:
    """Two sessions of two recordings, a third of one or two: of few recordings blocks are left out, and any will do."""
    problem, _ = begun
    path = next(h for h in hypotheses(problem.config, problem.evidence) if h.name == "routing_friction")
    tight, loose = problem.evidence
    sessions = [(tight, 2), (loose, 2), (replace(loose, session="third"), third)]
    several = [replace(e, name=f"{e.session}/{k}") for e, count in sessions for k in range(count)]
    problem = with_entry(problem, path, path.entry(path.starts[0].values)).with_evidence(several)
    p = next(q for q in problem.parameters if q.name == path.key("mu_angle"))
    ways = dependence._ways(problem, p, np.ones(10), np.zeros(10), by)
    assert [d.name for d, _, _ in ways] == ["effect.routing_friction.mu_angle by session"] * own
