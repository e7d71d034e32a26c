"""What the laws that the diagnosis finds on the jaw can do at a wrist pitch left out, where nobody has to search for
them: fitted from values near where all pitches together put them, each session's pretension its own."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import jaw_recordings as jaw
import numpy as np
import recordings as files
from recordings import JOINT

from cablecomp.config import EffectEntry
from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.calibration.drive import first_weights
from cablecomp.effects import catalogue
from cablecomp.estimation.evidence import Evidence
from cablecomp.estimation.least_squares import Fit, refit, rms_left, solve
from cablecomp.estimation.parameter import Parameter, of_drive, of_effect, own_of
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.recording.reader import read_all
from cablecomp.signal.smoothing import FloatArray

LAWS: Final = {
    "routing_friction": {"mu_angle": 0.5, "arc_length_m": 3e-4},
    "nonlinear_cable": {"stiffening": 0.6},
    "bearing_friction": {"torque_Nm": 5e-3, "presliding_rad": 0.03},
    "motor_friction": {"torque_Nm": 0.025, "presliding_rad": 6e-3},
}
DRIVE: Final = {"input_radius_m": 3.66e-3, "EA_N": 1.3e4, "mu_output": 0.3, "mu_input": 0.5}
PRETENSION: Final = {"Pitch_1": 5.0, "Pitch_3": 6.0, "Pitch_5": 1.2}
"""Where they begin [SI]; the fit moves them."""


def fitted(evidence: Sequence[Evidence]) -> Fit:
    """The drive with the laws, fitted to these recordings."""
    config = files.joint("davinci-jaw")
    free: list[Parameter] = []
    sessions = tuple(dict.fromkeys(e.session for e in evidence))
    for p in of_drive(config):
        free += own_of(p, sessions) if p.name == "pretension_N" else (p,)
    for name, values in LAWS.items():
        effect = catalogue()[name]
        all_of_it = {p.name: p.neutral for p in effect.parameters} | values
        config = config.model_copy(update={"effect": (*config.effect, EffectEntry(id=name, **all_of_it))})
        free += of_effect(effect, values, config)
    problem = Problem(config, tuple(free), tuple(evidence), first_weights(config, evidence))
    begin = DRIVE | {
        f"pretension_N@{s}": T0 for s in sessions for pitch, T0 in PRETENSION.items() if s.endswith(pitch)
    }
    fit = solve(problem, np.array([p.x(begin.get(p.name, p.start)) for p in problem.parameters]), 60)
    left = {c: rms_left(fit, c) for c in problem.channels}
    return refit(fit, Weighing(left, {c: 0.1 * v for c, v in left.items()}), 30)


def pitch_left_out(pitch: str) -> dict[str, FloatArray]:
    """What they leave [rad] of the recordings judged where a pitch is left out, with the zero that its lightest load
    tells."""
    train, judged = jaw.pitch_split(pitch)
    paths: Sequence[Path] = [*train, *judged]
    body = gather_body(files.joint("davinci-jaw"), {str(p): read_all(p, gaps=True).columns for p in paths})
    evidence = [*body.used, *body.final]
    fit = fitted([e for e in evidence if e.name in {str(p) for p in train}])
    zeros = fit.problem.zeros(fit.x)[JOINT]
    out = [e for e in evidence if e.name in {str(p) for p in judged}]
    misfits = fit.problem.with_evidence(out).misfits(fit.x)[JOINT]
    return {e.name: m - zeros[e.session][0] for e, m in zip(out, misfits, strict=True)}
