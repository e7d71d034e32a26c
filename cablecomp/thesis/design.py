"""Design sheet of a joint (thesis, chapter 6): what its dimensions make of it, by the closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from cablecomp.config import Drive, JointConfig, Limits, Stage, ratios_to_last
from cablecomp.errors import InputError
from cablecomp.thesis.closed_forms import closed
from cablecomp.thesis.closed_forms import open as open_
from cablecomp.thesis.closed_forms.energy import efficiency_limit, steady_efficiency
from cablecomp.thesis.closed_forms.models import choose_model, pretension_rule
from cablecomp.thesis.closed_forms.series import GearedStage, acting_stages
from cablecomp.thesis.closed_forms.stage import (
    EquivalentStage,
    equivalent_of,
    is_series,
    settled_pretensions_N,
)
from cablecomp.thesis.design_types import DesignSheet, Pretension, StageSheet, WrapUse

__all__ = ["DesignSheet", "Pretension", "StageSheet", "WrapUse", "check_settled", "design_sheet"]


def design_sheet(config: JointConfig, load_max_Nm: float | None = None) -> DesignSheet:
    """Return the design sheet of a joint for loads up to `load_max_Nm` (default: `[limits]
    joint_torque_max_Nm`), N m.

    Raises InputError where no greatest load is known or the pretensions of a chain cannot settle as stated
    (5-1).
    """
    drive = config.drive
    load = _greatest_load(config, load_max_Nm)
    check_settled(config)
    parts = acting_stages(drive)
    last = parts[-1].stage
    stages = _stage_sheets(config, load, parts)
    slip, slack = _least_slip(drive, parts), _least_slack(drive, parts)
    loaded = _compliance(drive, parts, load)
    sheet = DesignSheet(
        name=config.name,
        circuit=drive.circuit,
        arrangement=drive.arrangement if len(drive.stage) > 1 else "single",
        load_max_Nm=load,
        ratio=drive.ratio,
        equivalent=None if is_series(drive) else last,
        mu_eff=last.mu_eff,
        GF=last.GF,
        model=choose_model(last.GF),
        zero_load_stiffness_Nm_per_rad=1.0 / _compliance(drive, parts, 0.0),
        loaded_stiffness_Nm_per_rad=1.0 / loaded if loaded > 0.0 else math.inf,
        deflection_rad=_total(drive, parts, load, None),
        hysteresis_rad=_total(drive, parts, 0.0, load),
        zero_load_tension_N=_zero_load_tension(drive, parts[-1], load),
        tension_greatest_N=max(stage.tension_greatest_N for stage in stages),
        slip_moment_Nm=slip,
        slack_moment_Nm=slack,
        pretension=_pretension(drive, last, load),
        efficiency=float(np.prod([stage.efficiency for stage in stages])),
        efficiency_limit=float(
            np.prod(
                [
                    efficiency_limit(s.moment_Nm, part.output_radius_m, part.EA_N)
                    for s, part in zip(stages, drive.stage, strict=True)
                ]
            )
        ),
        stages=stages,
        notes=(),
    )
    return _with_notes(sheet, config)


def check_settled(config: JointConfig) -> None:
    """Raise InputError where the stages of one chain state pretensions that cannot settle so (5-1)."""
    if is_series(config.drive):
        return
    for index, (stage, settled) in enumerate(
        zip(config.drive.stage, settled_pretensions_N(config.drive), strict=True)
    ):
        if abs(stage.pretension_N - settled) > 1e-3 * settled:
            raise InputError(
                f"{config.name}: key `drive.stage.{index}.pretension_N` is {stage.pretension_N:g}; "
                f"cables in a chain settle at {settled:.6g} N there, given the last stage's; write that value"
            )


def _greatest_load(config: JointConfig, load_max_Nm: float | None) -> float:
    load = config.limits.joint_torque_max_Nm if load_max_Nm is None else load_max_Nm
    if load is None:
        raise InputError(
            f"{config.name}: no greatest load is known; state `[limits] joint_torque_max_Nm` or "
            "give a load in N m"
        )
    if not (math.isfinite(load) and load > 0.0):
        raise InputError(f"{config.name}: greatest load is {load} N m; a finite load above 0 is accepted")
    return load


def _total(drive: Drive, parts: tuple[GearedStage, ...], load: float, peak: float | None) -> float:
    """Deflection at the joint: at `load` while loading, or after a reversal at `peak`."""
    total = 0.0
    for n, stage in parts:
        if drive.circuit == "open" and peak is None:
            total += n * float(open_.open_loading_deflection_rad(n * load, stage))
        elif drive.circuit == "open" and peak is not None:
            total += n * float(open_.open_unloading_deflection_rad(n * load, n * peak, stage))
        elif peak is None:
            total += n * float(closed.closed_loading_deflection_rad(n * load, stage))
        else:
            total += n * float(closed.closed_unloading_deflection_rad(n * load, n * peak, stage))
    return total


def _compliance(drive: Drive, parts: tuple[GearedStage, ...], load: float) -> float:
    stiffness = (
        open_.open_stiffness_Nm_per_rad if drive.circuit == "open" else closed.closed_stiffness_Nm_per_rad
    )
    return float(sum(n * n / float(stiffness(n * load, stage)) for n, stage in parts))


def _zero_load_tension(drive: Drive, part: GearedStage, load: float) -> float:
    stage = part.stage
    if drive.circuit == "open":
        return stage.pretension_N
    m = part.ratio * load / stage.moment_scale_Nm
    return float(stage.pretension_N * closed.closed_tensions_unloading(0.0, m, stage).h)


def _least_slip(drive: Drive, parts: tuple[GearedStage, ...]) -> float:
    if drive.circuit == "open":
        return min(abs(moment) for moment in open_.open_slip_moments_Nm(parts[0].stage))
    return min(closed.closed_slip_moment_Nm(stage) / n for n, stage in parts)


def _least_slack(drive: Drive, parts: tuple[GearedStage, ...]) -> float:
    if drive.circuit == "open":
        return parts[0].stage.moment_scale_Nm
    return min(closed.closed_slack_moment_Nm(stage) / n for n, stage in parts)


def _pretension(drive: Drive, stage: EquivalentStage, load: float) -> Pretension:
    if drive.circuit == "open":
        force = load / stage.radius_m
        slip = -open_.open_slip_moments_Nm(stage)[0] / stage.moment_scale_Nm
        return Pretension(force, force, force, force / slip, force)
    narrow, wide = pretension_rule(load, stage.radius_m)
    scale = load / stage.moment_scale_Nm * stage.pretension_N
    no_slack = scale / (closed.closed_slack_moment_Nm(stage) / stage.moment_scale_Nm)
    no_slip = scale / (closed.closed_slip_moment_Nm(stage) / stage.moment_scale_Nm)
    rule = narrow if choose_model(stage.GF).name == "III" else wide
    return Pretension(narrow, wide, no_slack, no_slip, max(rule, no_slack))


def _stage_sheets(config: JointConfig, load: float, parts: tuple[GearedStage, ...]) -> tuple[StageSheet, ...]:
    drive = config.drive
    sheets = []
    for index, (stage, n) in enumerate(zip(drive.stage, ratios_to_last(drive.stage), strict=True)):
        acting = parts[index] if is_series(drive) else parts[0]
        high, low = _extreme_tensions(drive, acting, load)
        own = equivalent_of(stage)
        moment = float(n) * load
        greatest = stage.pretension_N * high
        sheets.append(
            StageSheet(
                number=index + 1,
                ratio=float(n),
                mu_eff=own.mu_eff,
                GF=own.GF,
                model=choose_model(own.GF),
                pretension_N=stage.pretension_N,
                moment_Nm=moment,
                tension_greatest_N=greatest,
                tension_least_N=stage.pretension_N * low,
                breaking_margin=None if stage.breaking_force_N is None else stage.breaking_force_N / greatest,
                wraps=_wrap_uses(drive, stage, float(n), high, low, config.limits),
                efficiency=float(steady_efficiency(moment, stage.output_radius_m, stage.EA_N)),
            )
        )
    return tuple(sheets)


def _extreme_tensions(drive: Drive, part: GearedStage, load: float) -> tuple[float, float]:
    """Greatest and least dimensionless tension while the load goes to `load` and back."""
    m = part.ratio * load / part.stage.moment_scale_Nm
    if drive.circuit == "open":
        return 1.0 + m, 1.0
    tau = closed.closed_tensions_loading(m, part.stage)
    return float(tau.h), float(tau.l)


def _wrap_uses(
    drive: Drive, stage: Stage, ratio: float, high: float, low: float, limits: Limits
) -> tuple[WrapUse, ...]:
    bounds = (limits.joint_position_min_rad, limits.joint_position_max_rad)
    down, up = (0.0 if bound is None else bound / ratio for bound in bounds)
    gear = stage.output_radius_m / stage.input_radius_m
    uses = []
    for pulley, mu, wrap, least in (
        ("output", stage.mu_output, stage.wrap_output_rad, min(down, 0.0)),
        ("input", stage.mu_input, stage.wrap_input_rad, min(-up * gear, 0.0)),
    ):
        turned = least
        if drive.circuit == "closed":  # the other cable unwinds when the joint turns the other way
            turned = -max(abs(down), abs(up)) * (1.0 if pulley == "output" else gear)
        easing = math.inf if low <= 0.0 else -math.log(low) / mu
        uses.append(
            WrapUse(
                pulley,
                math.log(high) / mu,
                math.nan if drive.circuit == "open" else easing,
                wrap,
                wrap + turned,
            )
        )
    return tuple(uses)


def _with_notes(sheet: DesignSheet, config: JointConfig) -> DesignSheet:
    notes = []
    if sheet.load_max_Nm > sheet.slack_moment_Nm and sheet.circuit == "closed":
        notes.append(
            f"a cable goes slack at {sheet.slack_moment_Nm:.3g} N m, below the greatest load: raise the "
            f"pretension to {sheet.pretension.no_slack_N:.3g} N or the wraps"
        )
    elif sheet.load_max_Nm > sheet.slip_moment_Nm and sheet.circuit == "closed":
        notes.append(
            f"a wrap slips to its termination from {sheet.slip_moment_Nm:.3g} N m on: the unending wraps of "
            f"the thesis do not hold there (finite wrap is accounted for)"
        )
    for stage in sheet.stages:
        for use in stage.wraps:
            where = f"stage {stage.number}, {use.pulley} pulley"
            if use.available_least_rad <= 0.0:
                notes.append(f"{where}: the cable is unwound before the end of the joint's travel")
            elif use.used > 1.0 and sheet.load_max_Nm <= sheet.slip_moment_Nm:
                notes.append(f"{where}: at the end of the travel less wrap is left than the load affects")
        if stage.breaking_margin is not None and stage.breaking_margin < 1.0:
            notes.append(f"stage {stage.number}: the greatest load breaks the cable")
    if sheet.stages[-1].pretension_N < sheet.pretension.minimum_N and sheet.circuit == "closed":
        notes.append(f"pretension is below the minimum of {sheet.pretension.minimum_N:.3g} N")
    if sheet.circuit == "open":
        notes.append(f"loads that ease the cable must stay below {sheet.slack_moment_Nm:.3g} N m")
    if config.effect:
        names = ", ".join(entry.id for entry in config.effect)
        notes.append(f"effects of the configuration are not part of this sheet: {names}")
    return replace(sheet, notes=tuple(notes))
