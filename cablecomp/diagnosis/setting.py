"""From recordings and a configuration to a fitting problem: rows, noise, blocks, the calibrated drive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cablecomp.config import JointConfig
from cablecomp.diagnosis.blocks import Layout, alternate_blocks
from cablecomp.diagnosis.covariates import Covariates, covariates, join
from cablecomp.diagnosis.fitting import Model, Problem, evaluate, solve
from cablecomp.diagnosis.forms import Surroundings
from cablecomp.diagnosis.replicas import MEASURED, observe, shaken, steps_for
from cablecomp.diagnosis.starts import CAREFULLY, deepest
from cablecomp.errors import InputError
from cablecomp.identification.misfit import Prepared
from cablecomp.identification.parameters import OFFSET, Parameter, free_parameters
from cablecomp.signal.noise import channel_noise
from cablecomp.signal.smoothing import FloatArray

ROWS = 5000  # of all recordings together, after averaging
REPLICAS = 12
NEEDED = ("time_s", "motor_position_rad", "joint_position_rad")
Columns = Mapping[str, FloatArray]


@dataclass(frozen=True)
class Setting:
    """Everything that the diagnosis of some recordings starts from."""

    problem: Problem
    covariates: Covariates
    layout: Layout
    around: Surroundings
    nominal: Model
    calibrated: Model
    floor_rad: float


def set_up(
    config: JointConfig, recordings: Sequence[Columns], rng: np.random.Generator, rows: int = ROWS
) -> Setting:
    """Average the recordings to `rows` rows, weigh them by their noise, and calibrate the drive within
    its tolerances.

    Raises InputError if a channel is missing or the joint cannot follow a recording.
    """
    for columns in recordings:
        for name in NEEDED:
            if name not in columns:
                raise InputError(
                    f"channel `{name}` is missing; diagnosis needs {', '.join(NEEDED)} and a load"
                )
    finest, each = steps_for(recordings, rows)
    seen = [observe(c, config, finest, each) for c in recordings]
    parts = tuple(part for part, _ in seen)
    replicas = tuple(tuple(shaken(part, noise, rng) for part, noise in seen) for _ in range(REPLICAS))
    views = join([covariates(_with_load(part.columns, config)) for part in parts])
    problem = Problem(
        config,
        _parameters(config),
        parts,
        np.concatenate([p.columns["joint_position_rad"] for p in parts]),
        np.concatenate([p.sigma_rad for p in parts]),
        replicas,
        _own_noise(config, parts),
    )
    guard = max(2, len(problem.measured) // 1000)
    layout = alternate_blocks(views.starts, problem.rows, views.values["load_direction"], guard)
    _start(problem)  # says it if the nominal joint cannot follow
    problem = replace(problem, sigma=_row_noise(problem, config))
    floor = float(np.sqrt(np.mean(problem.sigma**2)))
    nominal = _start(problem)
    mask = layout.heldout | layout.training
    calibrated = solve(problem, (), nominal.z, mask, iterations=CAREFULLY, renew=True)
    if calibrated is None:
        raise InputError(f"{config.name}: the joint cannot follow the recording with its nominal parameters")
    calibrated = deepest(problem, calibrated, mask)
    return Setting(problem, views, layout, _around(recordings), nominal, calibrated, floor)


def _parameters(config: JointConfig) -> tuple[Parameter, ...]:
    names = [k for k, s in config.tolerance.items() if s > 0.0]
    return free_parameters(config, [*names, *([] if OFFSET in names else [OFFSET])])


def _start(problem: Problem) -> Model:
    """The nominal joint with the best offset of its encoder."""
    z = np.zeros(len(problem.parameters))
    try:
        predicted = problem.predict(problem.joint(z))
    except InputError as error:
        raise InputError(
            f"{problem.config.name}: the nominal joint cannot follow the recording: {error}"
        ) from None
    for k, p in enumerate(problem.parameters):
        if p.name == OFFSET:
            z[k] = float(np.mean(problem.measured - predicted)) / p.unit
    residual = evaluate(problem, (), z)
    if residual is None:
        raise InputError(f"{problem.config.name}: the nominal joint cannot follow the recording")
    return Model((), z, (), residual, np.zeros((problem.rows, len(z))))


def _own_noise(config: JointConfig, parts: Sequence[Prepared]) -> float:
    """RMS of the joint encoder's noise in the rows, rad."""
    own = [_joint_sigma(config, p) for p in parts]
    return float(np.sqrt(np.average(np.square(own), weights=[p.rows for p in parts])))


def _row_noise(problem: Problem, config: JointConfig) -> FloatArray:
    """1-sigma of every row's residual, rad, the same within a recording: the joint encoder's own noise, and what
    noise on the inputs does to the prediction there."""
    moved = problem.moved(config)
    square = (
        np.mean((moved - moved.mean(axis=1, keepdims=True)) ** 2, axis=0)
        if len(moved)
        else np.zeros(problem.rows)
    )
    found, first = [], 0
    for part in problem.parts:
        through = float(np.mean(square[first : first + part.rows]))
        found.append(np.full(part.rows, np.sqrt(_joint_sigma(config, part) ** 2 + through)))
        first += part.rows
    return np.concatenate(found)


def _joint_sigma(config: JointConfig, part: Prepared) -> float:
    """1-sigma of the joint encoder's group means; white noise averages, quantisation at rest does not."""
    noise, resolution = config.sensors.joint_position_noise_rad, config.sensors.joint_position_resolution_rad
    if noise is None and resolution is None:
        return float(channel_noise(part.columns["time_s"], part.columns[MEASURED]).sigma)
    white, step = noise or 0.0, (resolution or 0.0) / np.sqrt(12.0)
    if white > step:
        return float(np.hypot(white, step) / np.sqrt(part.group))
    return float(np.hypot(white / np.sqrt(part.group), step / np.sqrt(min(part.group, 3))))


def _with_load(columns: Columns, config: JointConfig) -> dict[str, FloatArray]:
    """The columns with the load that the observer uses under the name of the joint torque."""
    found = dict(columns)
    if config.observer.load == "motor_torque":
        ratio = float(np.prod([s.input_radius_m / s.output_radius_m for s in config.drive.stage]))
        torque = columns["motor_torque_Nm"] - config.sensors.motor_torque_offset_Nm
        found["joint_torque_Nm"] = -torque / ratio
    elif config.observer.load == "none":
        found["joint_torque_Nm"] = np.zeros(len(columns["time_s"]))
    return found


def _around(recordings: Sequence[Columns]) -> Surroundings:
    times = [c["time_s"] for c in recordings]
    warm = [c["temperature_degC"] for c in recordings if "temperature_degC" in c]
    mean = spread = 0.0
    if len(warm) == len(recordings) and all(np.all(np.isfinite(w)) for w in warm):
        joined = np.concatenate(warm)
        mean, spread = float(np.mean(joined)), float(np.ptp(joined))
    common = set.intersection(*({n for n in c if n.startswith("other_")} for c in recordings))
    varying = [n for n in sorted(common) if any(float(np.ptp(c[n])) > 0.0 for c in recordings)]
    first = min(float(t[0]) for t in times)
    last = max(float(t[-1]) for t in times)
    return Surroundings(first, last, mean, spread, tuple(varying))
