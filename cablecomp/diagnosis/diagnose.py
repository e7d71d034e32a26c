"""The diagnosis from end to end: locate, hypothesise, fit, judge, say, propose; and what is written of it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.config_text import joint_text
from cablecomp.diagnosis.experiment import Experiment, best_experiment
from cablecomp.diagnosis.final import Final, finish
from cablecomp.diagnosis.fitting import INFLATION
from cablecomp.diagnosis.forms import Form, all_forms
from cablecomp.diagnosis.hidden import SHOWN
from cablecomp.diagnosis.locate import Location, locate
from cablecomp.diagnosis.screening import Progress
from cablecomp.diagnosis.selection import Selection, select
from cablecomp.diagnosis.series import Series, make_series
from cablecomp.diagnosis.setting import Setting, set_up
from cablecomp.diagnosis.unknown import Description, describe
from cablecomp.diagnosis.verdict import Findings, weigh
from cablecomp.signal.smoothing import FloatArray


@dataclass(frozen=True)
class Diagnosis:
    """Everything found, for the report and for `diagnosis.json`."""

    names: tuple[str, ...]
    setting: Setting
    selection: Selection
    final: Final
    findings: Findings
    location: Location
    remainder: Location
    description: Description | None
    experiment: Experiment | None
    mismatch_rad: FloatArray
    after_rad: FloatArray
    config: JointConfig

    def series(self, residual_rad: FloatArray) -> Series:
        """A residual beside its noise and covariates."""
        return make_series(residual_rad, self.setting.problem.sigma, self.setting.covariates)


def diagnose(
    config: JointConfig,
    recordings: Mapping[str, Mapping[str, FloatArray]],
    progress: Progress = lambda what, share: None,
    seed: int = 0,
) -> Diagnosis:
    """Find out what physics the configuration lacks to explain the recordings (name -> canonical channels).

    `progress` is told the hypothesis under test and the share done. Raises InputError for recordings that
    lack a channel or that the nominal joint cannot follow.
    """
    rng = np.random.default_rng(seed)
    progress("calibrating the drive", 0.0)
    setting = set_up(config, list(recordings.values()), rng)
    groups = all_forms(config, setting.around)
    selection = select(setting.problem, setting.calibrated, groups, setting.layout, rng, progress)
    progress("last fit", 0.95)
    final = finish(setting.problem, selection.model, setting.layout)
    unit = setting.problem.sigma * INFLATION
    nuisance = setting.calibrated.J * unit[:, None]
    calibrated = make_series(selection.baseline.residual_rad, setting.problem.sigma, setting.covariates)
    first = locate(calibrated, rng, nuisance)
    findings = weigh(setting, selection, final, first, rng)
    named = [k for k, _ in findings.named]
    explained = findings.verdict == "explained"
    mismatch = after = selection.baseline.residual_rad
    kept = setting.calibrated.c
    augmented = setting.problem.joint(kept)
    location = first
    if explained:
        # with the effect known, the mismatch is what the rest of the fitted model leaves:
        # no parameter covers it up
        bare = final.config.model_copy(update={"effect": config.effect})
        mismatch = setting.problem.measured - setting.problem.predict(bare)
        after = selection.final.residual_rad
        series = make_series(mismatch, setting.problem.sigma, setting.covariates)
        location = _through_effects(
            locate(series, rng, np.ones((setting.problem.rows, 1))), series, final, findings
        )
        augmented = final.config
    if explained and not named:  # tied: the model predicts, but no name is given
        augmented = final.config
    remainder = locate(make_series(after, setting.problem.sigma, setting.covariates), rng, nuisance)
    description = None
    if findings.verdict == "unexplained":
        progress("describing what is unexplained", 0.97)
        motor = config.drive.stage
        ratio = float(np.prod([s.output_radius_m / s.input_radius_m for s in motor]))
        description = describe(calibrated, rng, nuisance, ratio)
    experiment = _experiment(setting, selection, findings, final)
    return Diagnosis(
        tuple(recordings), setting, selection, final, findings, location, remainder, description, experiment,
        mismatch, after, augmented,
    )  # fmt: skip


def _through_effects(found: Location, series: Series, final: Final, findings: Findings) -> Location:
    """Rank first what the named effects act through, as far as the data show it there.

    An event is placed at its instant.
    """
    order: list[str] = []
    entries = {m.covariate: m for m in found.mismatch}
    for k, _ in findings.named:
        form, entry, _ = final.effects[k]
        channel = form.fixed.get("channel")
        names = (
            [f"other:{str(channel).removeprefix('other_')}"] if channel else list(form.effect.acts_through)
        )
        names = [n for n in names if n in entries]
        order += [n for n in names if entries[n].p_value < 0.05] or names[:1]
        instant = entry.parameters.get("time_s")
        if isinstance(instant, float) and "time" in entries:
            time = series.covariates.values["time"]
            after = time >= instant
            share = float(np.sum(series.residual[after] ** 2) / np.sum(series.residual**2))
            end = float(time.max())
            entries["time"] = replace(
                entries["time"],
                share=share,
                low=instant,
                high=end,
                intervals_s=((instant, end),),
                how="from one instant on",
            )
            order.insert(0, "time")
    ranked = [entries[n] for n in dict.fromkeys(order)]
    ranked += [m for m in found.mismatch if m.covariate not in order]
    return replace(found, mismatch=tuple(ranked))


def _experiment(
    setting: Setting, selection: Selection, findings: Findings, final: Final
) -> Experiment | None:
    """Where effects are tied, what would separate them."""
    if not findings.tied:
        return None
    problem = setting.problem
    if findings.verdict in ("consistent", "recalibrate"):
        plain = problem.joint(setting.calibrated.c)
        models = [plain, *(h.model for h in selection.hidden[:SHOWN])]
        return best_experiment(models, setting.covariates, setting.floor_rad, setting.around.temperature_degC)
    models = [final.config]
    for round_ in selection.rounds:
        models += [problem.joint(r.model.c, r.model.entries()) for r in round_.rivals]
    return best_experiment(models, setting.covariates, setting.floor_rad, setting.around.temperature_degC)


def report_json(d: Diagnosis) -> dict[str, Any]:
    """The contents of `diagnosis.json`."""
    problem = d.setting.problem
    kept = d.setting.layout.heldout | d.setting.layout.training
    base, after = d.selection.baseline.residual_rad, d.after_rad
    whole = (
        d.final.residual_rad
        if d.findings.verdict == "explained"
        else d.setting.calibrated.residual * (problem.sigma * INFLATION)
    )
    gain = 1.0 - float(np.mean(after[kept] ** 2) / np.mean(base[kept] ** 2))
    left = d.remainder.significant(0.01)
    structured = bool(left) and d.remainder.energy_ratio > 1.5
    named = []
    for k, sure in d.findings.named:
        form, entry, values = d.final.effects[k]
        named.append({
            "effect": entry.id,
            "statement": form.effect.statement,
            "equation": form.effect.equation,
            "parameters": {n: {"value": v.value, "sd": v.sd} for n, v in values.items()}
            | {n: v for n, v in form.fixed.items() if isinstance(v, str)},
            "heldout_gain": gain if len(d.findings.named) == 1 else _share_of(d, form.name),
            "confidence": sure,
        })  # fmt: skip
    report: dict[str, Any] = _finite(
        {
            "schema": 1,
            "recordings": list(d.names),
            "verdict": d.findings.verdict,
            "noise_floor_rad": d.setting.floor_rad,
            "nominal": {
                "rmse_rad": _rms(d.setting.nominal.residual[kept] * (problem.sigma * INFLATION)[kept])
            },
            "baseline": {
                "rmse_rad": _rms((d.setting.calibrated.residual * problem.sigma * INFLATION)[kept]),
                "heldout_rmse_rad": _rms(base[kept]),
            },
            "augmented": {"rmse_rad": _rms(whole[kept]), "heldout_rmse_rad": _rms(after[kept])},
            "calibration": _calibration(d),
            "mismatch": [m.entry() for m in d.location.mismatch],
            "missing_physics": sorted(named, key=lambda m: -m["heldout_gain"]),
            "not_excluded": [{"effects": list(names), "why": why} for names, why in d.findings.tied],
            "next_experiment": None
            if d.experiment is None
            else {"why": d.experiment.why, "protocol": d.experiment.protocol.to_toml()},
            "remainder": {
                "rmse_rad": _rms(after[kept]),
                "structured": structured,
                "description": d.description.text
                if d.description
                else (left[0].how if structured else "noise"),
                "equation": d.description.law.equation if d.description and d.description.law else None,
            },
            "hypotheses": _hypotheses(d.selection),
            "could_be_unseen": _unseen(d) if d.findings.verdict in ("consistent", "recalibrate") else [],
            "warnings": [f"{name} ended on its bound" for name in d.final.at_bound],
        }
    )
    return report


def _share_of(d: Diagnosis, name: str) -> float:
    """Held-out gain of the round in which an effect was accepted."""
    for round_ in d.selection.rounds:
        best = round_.accepted
        if best is not None and best.name == name:
            return best.heldout_gain
    return 0.0


def _calibration(d: Diagnosis) -> dict[str, Any]:
    nominal = {p.name: p.value(0.0) for p in d.setting.problem.parameters}
    if d.findings.verdict == "explained":
        values = {n: (v.value, v.sd) for n, v in d.final.calibration.items()}
    else:
        own = d.final.calibration if not d.final.effects else {}
        fitted = d.setting.problem.values(d.setting.calibrated.c)
        values = {n: (v, own[n].sd if n in own else math.nan) for n, v in fitted.items()}
    return {n: {"value": v, "sd": s, "nominal": nominal[n]} for n, (v, s) in values.items()}


def _hypotheses(selection: Selection) -> list[dict[str, Any]]:
    """What was tried, with the score of each."""
    found = []
    for round_ in selection.rounds:
        for name, drop in sorted(round_.asked.items(), key=lambda i: -i[1]):
            row: dict[str, Any] = {"beside": round_.base, "effect": name, "linear_drop": drop}
            if name in round_.folds:
                s = round_.verdict.of(name)
                row |= {
                    "heldout_gain": s.heldout_gain,
                    "z": s.z,
                    "margin": s.margin,
                    "supported": s.supported,
                }
            found.append(row)
    return found


def _unseen(d: Diagnosis) -> list[dict[str, Any]]:
    """How large each effect could be without having shown: three standard deviations of its amplitude."""
    rows = d.setting.problem.rows / INFLATION**2
    found = []
    for group in d.selection.probes:
        best = max(group, key=lambda p: p.length)
        form: Form = best.form
        size = 3.0 * form.scales[0] / max(best.length * math.sqrt(rows), 1e-12)
        main = form.amplitudes[0]
        found.append({"effect": form.name, "parameter": main.name, "unit": main.unit, "below": size})
    return found


def write_diagnosis(d: Diagnosis, out: Path) -> None:
    """Write `diagnosis.json`, `joint.augmented.toml`, and `next_experiment.toml` where one is proposed."""
    (out / "diagnosis.json").write_text(json.dumps(report_json(d), indent=1) + "\n")
    (out / "joint.augmented.toml").write_text(
        joint_text(d.config, ("calibrated values and effects found by the diagnosis",))
    )
    if d.experiment is not None:
        (out / "next_experiment.toml").write_text(d.experiment.protocol.to_toml())


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _finite(value: Any) -> Any:
    """JSON knows no NaN: None instead."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, np.floating | np.integer | np.bool_):
        return _finite(value.item())
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    return value
