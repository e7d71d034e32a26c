"""A made-up diagnosis with every part filled, for the page's tests and for looking at it."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from cablecomp.config import load_joint
from cablecomp.diagnosis.locate.covariates import covariates
from cablecomp.diagnosis.locate.location import locate
from cablecomp.diagnosis.locate.series import Series, make_series
from cablecomp.diagnosis.result import Diagnosis, Errors, Law, Named, Tested, Traces, Value
from cablecomp.effects import catalogue

JOINT = Path(__file__).parents[2] / "configs" / "joints" / "snow-closed-rig.toml"

NOISE = 2e-5


def example(samples: int = 2_400) -> Diagnosis:
    """Creep in holds, partly explained by viscous slip, and all of the page's optional parts."""
    traces, series = recorded(samples)
    location = locate(series, np.random.default_rng(5), surrogates=199)
    before, left = (
        float(np.sqrt(np.mean((traces[0].measured_rad - predicted) ** 2)))
        for predicted in (traces[0].before_rad, traces[0].after_rad)
    )
    named, candidate = entries(1.0 - (left / before) ** 2)
    first, second = names = tuple(t.name for t in traces)
    config = load_joint(JOINT)
    return Diagnosis(
        config=config,
        recordings=names,
        sessions={"rig-1": [first], "rig-2": [second]},
        clock_s={second: 20.0},
        verdict="partly explained",
        noise_floor_rad=NOISE,
        repeatability_rad=1.4 * NOISE,
        nominal_rmse_rad=1.2 * before,
        baseline=Errors(before, 1.02 * before, 1.05 * before, before),
        augmented=Errors(left, 1.02 * left, 1.07 * left, left),
        heldout_by="block",
        folds=6,
        final=names,
        channels={"motor_torque_Nm": (0.02, 0.004)},
        calibration=CALIBRATION,
        location=location,
        named=(named,),
        candidates=(candidate,),
        not_excluded=((("series_compliance", "nonlinear_cable"), "both bend the same curve under these loads"),),
        empirical=(Law("ripple_by_motor_angle", "motor_angle", 0.31, 6.0),),
        next_experiment=(
            "A ramp to 4 N·m at two rates separates the two", "load ramp 0 -> 4 N·m in 2 s\nload hold 5 s",
        ),
        could_be_unseen=UNSEEN,
        remainder=REMAINDER,
        remainder_location=location,
        tested=TESTED,
        notes=("load from joint_torque_Nm",),
        augmented_joint=config,
        traces=traces,
        runtime_s=12.0,
        warnings=("EA_N ended on its bound",),
    )  # fmt: skip


def recorded(samples: int) -> tuple[tuple[Traces, Traces], Series]:
    """A made-up recording of load ramps with holds, under two names, and the series of what is left of it."""
    rng = np.random.default_rng(4)
    time = np.arange(samples) * 60.0 / samples
    knots, levels = [0.0], [0.0]
    for start in np.arange(0.0, 62.5, 2.5):
        knots += [start + 0.01, start + 1.3]
        levels += [levels[-1], rng.uniform(-2.0, 2.0)]
    load = np.interp(time, knots, levels)
    motor = np.full(samples, 0.1)
    play = np.zeros(samples)
    for i in range(1, samples):
        play[i] = max(load[i] - 0.4, min(load[i] + 0.4, play[i - 1]))
    plain = motor + 8e-4 * load + 3e-4 * play
    channels = {
        "time_s": time,
        "motor_position_rad": motor,
        "joint_torque_Nm": load + 2e-3 * rng.standard_normal(samples),
        "joint_position_rad": plain,
    }
    found = covariates(channels)
    v = found.values
    creep = -1.6e-4 * v["load_direction"] * np.exp(-v["dwell"] / 0.6) * (0.4 + np.abs(load) / 2.0)
    measured = plain + creep + NOISE * rng.standard_normal(samples)
    used = np.arange(samples) < 0.85 * samples
    one, other = (
        Traces(name, name[:5], v, measured, plain, plain + creep * 0.98, motor, used)
        for name in ("rig-1/bench-07.csv", "rig-2/bench-08.csv")
    )
    return (one, other), make_series(measured - plain, NOISE, found)


def entries(share: float) -> tuple[Named, Named]:
    """What is named, taking off that share of the mismatch, and what is a candidate."""
    effect, skew = catalogue()["viscous_slip"], catalogue()["clock_skew"]
    named = Named(
        effect.id, effect.statement, effect.equation,
        {"coefficient_Ns_per_m_rad": Value("coefficient_Ns_per_m_rad", 118.4, 3.1)},
        {"parameter": "viscous_slip.coefficient_Ns_per_m_rad", "on": "session",
         "values": {"rig-1": 118.4, "rig-2": 131.0}},
        share, 0.97, {"z": 9.3, "selected_in": 1.0, "moves_rad": 3.21e-4}, effect.acts_through,
    )  # fmt: skip
    candidate = Named(
        skew.id, skew.statement, skew.equation, {}, None, 0.38, 0.21, {"z": 3.4}, (), "viscous_slip takes off more",
    )  # fmt: skip
    return named, candidate


CALIBRATION = (
    Value("mu_output", 0.1132, 0.0021, 0.10),
    Value("EA_N", 16_120.0, 140.0, 16_307.0),
    Value("pretension_N", 33.10, 0.22, 33.54),
    Value("joint_position_offset_rad@rig-1", 1e-4, 1e-6, 0.0, "rig-1"),
    Value("joint_position_offset_rad@rig-2", 3e-4, 1e-6, 0.0, "rig-2"),
)
UNSEEN = (
    {"effect": "bearing_friction", "parameter": "torque_Nm", "below": 0.0041, "unit": "N·m", "why": ""},
    {"effect": "clamp_slip", "parameter": "slip_m", "below": None, "unit": "m", "why": "could be any size"},
)
REMAINDER = {
    "rmse_rad": 4e-6, "share": 0.04, "structured": True,
    "description": "follows load: a curve over the load; steady over the recording",
    "equation": "residual = (3.1e-06 ± 4e-07) rad/(N·m)² M²",
}  # fmt: skip
TESTED = (
    Tested("viscous_slip", "calibrated drive", 0.93, 9.3, 1.0, "named"),
    Tested("clock_skew", "calibrated drive", 0.38, 3.4, 0.0, "not needed"),
    Tested("strand_friction", "calibrated drive", 0.12, 1.2, 0.0, "not needed"),
    Tested("pulley_runout", "viscous_slip", -0.03, -0.4, 0.0, "not needed"),
    Tested("clock_skew", "viscous_slip", 0.02, 0.3, 0.1, "not needed"),
)


def without_a_name(d: Diagnosis, verdict: str) -> Diagnosis:
    """The same where nothing was named."""
    return replace(
        d, verdict=verdict, named=(), candidates=(), not_excluded=(), next_experiment=None, empirical=(), tested=(),
        remainder={**d.remainder, "structured": verdict == "unexplained", "equation": None}, augmented=d.baseline,
    )  # fmt: skip


def text_of(html: str) -> str:
    """The page without scripts and tags."""
    html = re.sub(r"<(script|style).*?</\1>", " ", html, flags=re.DOTALL).replace("<wbr>", "")
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", html)).replace("&#x27;", "'")
