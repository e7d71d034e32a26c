"""The thesis's bench, simulated: ramps and holds of the load on its two rigs, with something switched on that
the evaluation does not know.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from cablecomp.config import JointConfig
from cablecomp.effects import with_effects
from cablecomp.errors import InputError
from cablecomp.observer import Observer
from cablecomp.thesis.bench.evaluate import BenchResult, bench_recording, evaluate_bench
from cablecomp.thesis.bench.suspects import Case, Course, Suspect

Array = npt.NDArray[np.float64]
Columns = Mapping[str, Array]
Simulate = Callable[[JointConfig, Columns], Array]
"""A joint (its effects in its configuration) and a recording's channels -> joint position, rad."""

LBF_N: Final = 4.448222
RATE_N_PER_S: Final = 0.04 * LBF_N
"""Water into the bucket (A.1)."""
REST_S, HOLD_S, STEP_S = 20.0, 300.0, 1.0
"""Holds last "until the deflection reaches its equilibrium" (A.2); 300 s are assumed."""


# pretension, lbf, and greatest moment, N m, of the cycles: trial 145 (m = 2.1, Fig. 3.7); trials 151 to 155, whose
# peak is not stated (m = -0.6 taken); further pretensions of trials 136 to 150; trials 16 to 30
_TIGHTENED, _EASED = (5.43, 1.85), (8.74, -0.85)
_OTHERS = ((2.13, 0.726), (8.74, 1.85))
_CLOSED = (7.54, 2.7)


@dataclass(frozen=True)
class Signature:
    """What a bench shows beside the plain drive; ratios of coefficients of friction, 1 = as the plain drive.

    `true_*`, `acting_*`: loading over unloading, for M_pk > 0 (`up`) and < 0 (`down`). `lag_*`: acting over
    true, M_pk > 0. `creep_*`: share of the cycle's deflection that follows after the load has stopped.
    `scatter`: relative standard deviation of the true loading mu over pretensions of 2.13, 5.43 and 8.74 lbf.
    `closed`: loading over unloading, true, on the closed circuit.
    """

    true_up: float
    true_down: float
    acting_up: float
    acting_down: float
    lag_loading: float
    lag_unloading: float
    creep_loading: float
    creep_unloading: float
    scatter: float
    closed: float


@dataclass(frozen=True)
class Traces:
    """Deflection after the load has stopped: seconds since, and share of the loading's deflection, at the peak
    and back at zero.
    """

    since_s: Array
    loaded: Array
    unloaded: Array


@dataclass(frozen=True)
class Rigs:
    """The thesis's open and closed circuit."""

    opened: JointConfig
    closed: JointConfig


def by_observer(config: JointConfig, columns: Columns) -> Array:
    """Simulate with the observer's own equations."""
    found: Array = Observer(config).run(columns)["joint_position_rad"]
    return found


class Bench:
    """The bench: simulates the cycles with a suspect and evaluates them without."""

    def __init__(self, rigs: Rigs, simulate: Simulate) -> None:
        def plain(joint: JointConfig) -> JointConfig:
            return with_effects(joint.model_copy(update={"tolerance": {}}), ())

        self.rigs = Rigs(plain(rigs.opened), plain(rigs.closed))
        self._simulate = simulate
        self._plain = self._raw((), ())[0]

    def signature(
        self, chosen: Sequence[Suspect], sizes: Sequence[float], full: bool = True
    ) -> tuple[Signature, Traces]:
        """Signature and traces with these suspects; `full`: other pretensions and the closed circuit as well.

        Raises InputError where the evaluation finds no friction (cable slack, deflection against the load).
        """
        raw, traces = self._raw(chosen, sizes, full)
        plain = self._plain
        creep = {k: getattr(raw, k) - getattr(plain, k) for k in ("creep_loading", "creep_unloading")}
        ratios = {
            k: getattr(raw, k) / getattr(plain, k) for k in Signature.__dataclass_fields__ if k not in creep
        }
        return Signature(**{**ratios, **creep, "scatter": raw.scatter}), traces

    def _raw(
        self, chosen: Sequence[Suspect], sizes: Sequence[float], full: bool = True
    ) -> tuple[Signature, Traces]:
        def cycle(rig: JointConfig, pretension_lbf: float, peak_Nm: float) -> tuple[BenchResult, Traces]:
            return self._cycle(rig, pretension_lbf, peak_Nm, chosen, sizes)

        opened, closed_rig = self.rigs.opened, self.rigs.closed
        up, traces = cycle(opened, *_TIGHTENED)
        down, _ = cycle(opened, *_EASED)
        scatter, closed = math.nan, math.nan
        if full:
            values = np.array([_true(r.loading) for r in (up, *(cycle(opened, *k)[0] for k in _OTHERS))])
            scatter = float(np.std(values) / np.mean(values))
            ring, _ = cycle(closed_rig, *_CLOSED)
            closed = _true(ring.loading) / _true(ring.unloading)
        found = Signature(
            _true(up.loading) / _true(up.unloading),
            _true(down.loading) / _true(down.unloading),
            _acting(up.loading) / _acting(up.unloading),
            _acting(down.loading) / _acting(down.unloading),
            _acting(up.loading) / _true(up.loading),
            _acting(up.unloading) / _true(up.unloading),
            float(traces.loaded[-1]),
            float(traces.unloaded[-1]),
            scatter,
            closed,
        )
        return found, traces

    def _cycle(
        self,
        rig: JointConfig,
        pretension_lbf: float,
        peak: float,
        chosen: Sequence[Suspect],
        sizes: Sequence[float],
    ) -> tuple[BenchResult, Traces]:
        nominal = _changed(rig, pretension_lbf * LBF_N)
        radius = nominal.drive.stage[-1].output_radius_m
        ramp = abs(peak) / (RATE_N_PER_S * radius)
        course = Course(
            REST_S,
            REST_S + ramp,
            REST_S + ramp + HOLD_S,
            REST_S + 2 * ramp + HOLD_S,
            REST_S + 2 * ramp + 2 * HOLD_S,
        )
        case = Case()
        for suspect, size in zip(chosen, sizes, strict=True):
            case = case.with_case(suspect.build(size, nominal, course))
        columns = _columns(course, peak)
        true = with_effects(_changed(nominal, pretension_lbf * LBF_N, case.EA, case.mu), case.effects)
        columns["joint_position_rad"] = self._simulate(true, columns)
        columns["joint_torque_Nm"] = _shown(columns["joint_torque_Nm"], case.reading_Nm, course, peak)
        traces = _traces(columns["time_s"], columns["joint_position_rad"], course)
        return evaluate_bench(bench_recording(columns, nominal), nominal), traces


def _changed(joint: JointConfig, pretension_N: float, EA: float = 1.0, mu: float = 1.0) -> JointConfig:
    stages = tuple(
        s.model_copy(
            update={
                "pretension_N": pretension_N,
                "EA_N": EA * s.EA_N,
                "mu_output": mu * s.mu_output,
                "mu_input": mu * s.mu_input,
            }
        )
        for s in joint.drive.stage
    )
    return joint.model_copy(update={"drive": joint.drive.model_copy(update={"stage": stages})})


def _columns(course: Course, peak: float) -> dict[str, Array]:
    time = np.arange(0.0, course.end, STEP_S)
    knots = [course.up, course.held, course.down, course.back]
    drift = time / course.end
    return {
        "time_s": time,
        "motor_position_rad": np.zeros_like(time),
        "joint_torque_Nm": np.interp(time, knots, [0.0, peak, peak, 0.0]),
        "temperature_degC": 20.0 + drift,
        "other_1": drift,
    }


def _shown(load: Array, error: float, course: Course, peak: float) -> Array:
    """The load as read: ahead in the direction last moved in (error > 0), or behind like a play of that radius."""
    if error >= 0.0:
        soon = 0.02 * (course.held - course.up)
        knots = [course.up, course.up + soon, course.down, course.down + 2 * soon]
        direction = np.interp(np.arange(len(load)) * STEP_S, knots, [0.0, 1.0, 1.0, -1.0])
        return np.asarray(load + math.copysign(error, peak) * direction)
    shown = load.copy()
    for k in range(1, len(load)):
        shown[k] = min(max(shown[k - 1], load[k] + error), load[k] - error)
    return shown


def _traces(time: Array, position: Array, course: Course) -> Traces:
    held, down, back = (int(np.searchsorted(time, t)) for t in (course.held, course.down, course.back))
    count = min(down - held, len(time) - back)
    whole = position[down - 1] - position[0]
    since = time[held : held + count] - course.held
    return Traces(
        since,
        (position[held : held + count] - position[held]) / whole,
        (position[back] - position[back : back + count]) / whole,
    )


def _true(branch: object) -> float:
    return _value(branch, "true")


def _acting(branch: object) -> float:
    return _value(branch, "acting")


def _value(branch: object, name: str) -> float:
    measured = getattr(branch, name, None)
    if measured is None:
        raise InputError(f"the bench gives no {name} coefficient of friction there")
    return float(measured.value)
