"""The thesis's own bench evaluation: coefficients of friction out of a load cycle (3.3, 4.3, Appendices A.3
and B).

True coefficients come from the equilibrium points, the ends of the holds; acting ones from the slope of the
wrap deflection against the processed load vector while the load moves. They differ where something beyond
Coulomb friction acts, such as viscous slip.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from cablecomp.config import Drive, JointConfig
from cablecomp.effects.series_compliance import EFFECT as IN_SERIES
from cablecomp.errors import InputError
from cablecomp.signal.noise import reading_sigma
from cablecomp.thesis.bench.friction import BenchData, branch_of, weighted_mean
from cablecomp.thesis.bench.segments import Segment, Smoothed, noise_of, segments_of, trimmed
from cablecomp.thesis.bench.types import (
    Array,
    BenchRecording,
    BenchResult,
    Branch,
    Measured,
    PulleyFriction,
)
from cablecomp.thesis.bench.vectors import DriveOnBench
from cablecomp.thesis.closed_forms.series import acting_stages
from cablecomp.thesis.design import check_settled
from cablecomp.thesis.geometry import sensor_deflection_rad

__all__ = ["BenchRecording", "BenchResult", "Measured", "bench_recording", "evaluate_bench"]

_TURNED_RAD = 0.1
"""Turn of the motor that is said: a few per cent of the wrap that a usual load stretches (ln(1 + m)/mu)."""


def bench_recording(columns: Mapping[str, Array], config: JointConfig) -> BenchRecording:
    """Return what the bench evaluation needs out of a recording's canonical channels.

    Deflection = joint_position_rad - prod(r/R) motor_position_rad; without a motor channel the input pulley
    counts as held still. Raises InputError that names a missing channel, and as `BenchRecording`.
    """
    for name in ("time_s", "joint_torque_Nm", "joint_position_rad"):
        if name not in columns:
            there = ", ".join(columns) or "no channel"
            raise InputError(
                f"recording has no channel {name}, which a bench evaluation needs; there is {there}"
            )
    deflection = np.asarray(columns["joint_position_rad"], dtype=float)
    motor = columns.get("motor_position_rad")
    if motor is not None:
        deflection = deflection - config.drive.ratio * np.asarray(motor)
    return BenchRecording(
        np.asarray(columns["time_s"], dtype=float),
        np.asarray(columns["joint_torque_Nm"], dtype=float),
        deflection,
        motor,
    )


def evaluate_bench(
    recording: BenchRecording,
    config: JointConfig,
    *,
    sensor_stiffness_Nm_per_rad: float = math.inf,
    narrow_tensions: bool = False,
) -> BenchResult:
    """Return the coefficients of friction that a bench recording shows.

    The recording starts at zero load and uniform pretension, input held: a ramp (steps with holds are as
    good) to a peak of either sign, a hold, a ramp back, a hold. Later cycles are left out.
    `sensor_stiffness_Nm_per_rad`: torsional stiffness of the torque sensor that holds the input pulley (A-1);
    a `series_compliance` effect in the configuration is taken out as well. `narrow_tensions`: the thesis's
    tensions of GF = 0 (4-53) in place of the exact ones. Raises InputError where no ramp from zero load is
    found or the deflection runs against the load.
    """
    check_settled(config)
    data = _prepare(recording, config, sensor_stiffness_Nm_per_rad)
    bench = DriveOnBench(config.drive, narrow_tensions)
    loading = branch_of("loading", data.loading, data, bench, config, None)
    unloading = None
    if data.unloading:
        found = branch_of("unloading", data.unloading, data, bench, config, data.peak)
        unloading = _after_unsettled(found, loading)
    return _result(config, data, loading, unloading)


def _after_unsettled(unloading: Branch, loading: Branch) -> Branch:
    """Unloading from a peak that had not settled is no surer than that peak."""
    if unloading.true is None or not loading.points:
        return unloading
    peak = loading.points[-1]
    if peak.settled or peak.mu_eff is None:
        return unloading
    share = peak.mu_eff.sd / peak.mu_eff.value
    true = unloading.true
    return replace(unloading, true=Measured(true.value, math.hypot(true.sd, share * true.value)))


def _prepare(recording: BenchRecording, config: JointConfig, sensor_stiffness: float) -> BenchData:
    if not sensor_stiffness > 0.0:
        raise InputError(f"sensor stiffness is {sensor_stiffness} N m/rad; a value above 0 is accepted")
    sensors = config.sensors
    load = (recording.load_Nm - sensors.joint_torque_offset_Nm) / sensors.joint_torque_gain
    segments, smoothed = segments_of(recording.time_s, load)
    loading, unloading, notes = _phases(segments, smoothed)
    twist = sensor_deflection_rad(smoothed.value, config.drive.ratio, sensor_stiffness)
    for entry in config.effect:
        if entry.id == IN_SERIES.id:  # like the sensor's own twist
            twist = twist + float(entry.parameters.get(IN_SERIES.parameters[0].name, 0.0)) * smoothed.value
    deflection = np.asarray(recording.deflection_rad - twist, dtype=float)
    peak_segment = loading[-1]
    middle = smoothed.value[trimmed(peak_segment, smoothed.window)]
    ends = smoothed.value[loading[0].start : peak_segment.stop]
    sign = float(np.sign(smoothed.value[loading[0].stop - 1] - smoothed.value[loading[0].start]))
    peak = float(np.mean(middle)) if peak_segment.is_hold else sign * float(np.max(sign * ends))
    _check_peak(peak, config.drive)
    rest = _rest(segments, loading[0], smoothed)
    first_load = float(np.mean(smoothed.value[rest]))
    if abs(first_load) > 0.05 * abs(peak):
        raise InputError(
            f"load is {first_load:.3g} N m where the loading ramp begins; a bench recording starts at "
            "zero load (set `[sensors] joint_torque_offset_Nm` if that is the sensor's zero)"
        )
    start = DriveOnBench(config.drive).deflection(np.asarray([first_load]), 1.0)[0]
    deflection = deflection - (float(np.mean(deflection[rest])) - start)
    if rest.stop - rest.start < 8:
        notes = (*notes, "no hold at zero load before the ramp: its first samples are taken as the zero")
    notes = (*notes, *_turned(recording.motor_position_rad, loading + unloading))
    _check_direction(deflection, smoothed.value, loading)
    resolution = sensors.joint_position_resolution_rad or 0.0
    quantised = reading_sigma(0.0, resolution)
    noise = max(noise_of(deflection), quantised)
    white = math.sqrt(max(noise**2 - quantised**2, 0.0))
    steps = white / resolution if resolution > 0.0 else math.inf
    step = quantised * math.exp(-2.0 * math.pi**2 * min(steps, 5.0) ** 2)
    return BenchData(
        recording.time_s,
        smoothed,
        deflection,
        noise,
        step,
        noise_of(load),
        loading,
        unloading,
        segments,
        peak,
        notes,
    )


def _turned(motor_rad: Array | None, used: tuple[Segment, ...]) -> tuple[str, ...]:
    """A note if the input was not held: cable that runs onto a pulley takes the place of what loads have stretched."""
    turned = 0.0 if motor_rad is None else float(np.ptp(motor_rad[used[0].start : used[-1].stop]))
    if turned < _TURNED_RAD:
        return ()
    return (
        f"the motor turns by {turned:.3g} rad between the ramps' beginning and end, and a bench holds it still: the "
        "coefficients are not to be trusted; hold it, or use `cablecomp calibrate`",
    )


def _phases(
    segments: tuple[Segment, ...], smoothed: Smoothed
) -> tuple[tuple[Segment, ...], tuple[Segment, ...], tuple[str, ...]]:
    """Loading: up to the first reversal, its last hold included. Unloading: up to the next."""
    first = next((i for i, segment in enumerate(segments) if not segment.is_hold), None)
    if first is None:
        raise InputError("no load ramp found; a bench recording is a ramp, a hold, a ramp back, a hold")
    phases: list[list[Segment]] = [[]]
    direction = segments[first].direction
    for segment in segments[first:]:
        if not segment.is_hold and segment.direction != direction:
            direction = segment.direction
            phases.append([])
        phases[-1].append(segment)
    notes = []
    if len(phases) > 2:
        notes.append(f"{len(phases) - 2} further reversals of load are left out: they start from a bump")
    unloading = tuple(phases[1]) if len(phases) > 1 else ()
    if not unloading:
        notes.append("no unloading in the recording")
    for name, phase in (("loading", phases[0]), ("unloading", list(unloading))):
        if phase and not any(segment.is_hold for segment in phase):
            notes.append(f"no hold in the {name} part: no equilibrium point, so no true coefficient there")
    return tuple(phases[0]), unloading, tuple(notes)


def _rest(segments: tuple[Segment, ...], ramp: Segment, smoothed: Smoothed) -> slice:
    before = segments[0]
    if before.is_hold and before.stop == ramp.start:
        end = max(before.stop - smoothed.window // 2, min(before.stop, 3))
        return slice(0, end)
    return slice(0, 3)


def _check_peak(peak: float, drive: Drive) -> None:
    for n, stage in acting_stages(drive):
        m = n * peak / stage.moment_scale_Nm
        if drive.circuit == "open" and m <= -1.0:
            raise InputError(
                f"load goes to {peak:.3g} N m, m = {m:.3g}: an open circuit is slack from m = -1; check the "
                "sign of the load, the pretension, the radii"
            )


def _check_direction(deflection: Array, load: Array, loading: tuple[Segment, ...]) -> None:
    part = slice(loading[0].start, loading[-1].stop)
    if np.corrcoef(deflection[part], load[part])[0, 1] < 0.0:
        raise InputError(
            "deflection falls where the load rises; positive M gives positive deflection: turn the sign of "
            "one of them"
        )


def _result(config: JointConfig, data: BenchData, loading: Branch, unloading: Branch | None) -> BenchResult:
    branches = [loading] + ([unloading] if unloading is not None else [])
    best = weighted_mean([branch.true for branch in branches if branch.true is not None])
    if best is None:
        best = weighted_mean([branch.acting for branch in branches if branch.acting is not None])
    if best is None:
        raise InputError(
            "no coefficient of friction follows from the recording: no hold and no ramp of 10 samples that "
            "friction could explain; check EA, T0 and the deflection's unit"
        )
    last = acting_stages(config.drive)[-1]
    notes = list(data.notes)
    for branch in branches:
        for point in branch.points:
            if not point.settled:
                notes.append(
                    f"{branch.name}: deflection drifts by {point.drift_rad:.2g} rad at the end of the hold "
                    f"at {point.time_s:.4g} s; wait longer for the equilibrium"
                )
            if point.mu_eff is None:
                notes.append(f"{branch.name}: no friction explains the rest at {point.time_s:.4g} s")
    factor = best.value / last.stage.mu_eff
    share = best.sd / best.value
    pulleys = tuple(
        PulleyFriction(
            index + 1,
            Measured(stage.mu_output * factor, stage.mu_output * factor * share),
            Measured(stage.mu_input * factor, stage.mu_input * factor * share),
        )
        for index, stage in enumerate(config.drive.stage)
    )
    return BenchResult(
        config.name,
        config.drive.circuit,
        data.peak,
        last.ratio * data.peak / last.stage.moment_scale_Nm,
        best,
        last.stage.mu_eff,
        last.stage.GF * factor,
        loading,
        unloading,
        pulleys,
        data.load_noise,
        data.deflection_noise,
        data.segments,
        tuple(notes),
    )
