"""Whether the hysteresis could keep the link swinging: harmonic balance with its describing function."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import control
import numpy as np
from numpy.typing import NDArray

from cablecomp.config import JointConfig
from cablecomp.control.compensator import Gains
from cablecomp.control.options import MotorModel
from cablecomp.control.plant_model import (
    Complex,
)
from cablecomp.control.stiffness import at_start, full
from cablecomp.control.synthesis import DesignWork
from cablecomp.observer import Observer
from cablecomp.signals import Sample


@dataclass(frozen=True)
class LimitCycle:
    """What the hysteresis, as a describing function N(A), says of the link's swing with feed-forward acting.

    Harmonic balance: `J s^2 + b s + N(A)/(1 - G) = 0`. At each of `amplitudes_rad` (of deflection):
    N(A), the frequency at which the balance of the real parts holds nearest to the link's own, and the
    loss factor left there, `(Im K + b w)/Re K`, K = N/(1 - G): below 0 the swing grows. `found`:
    (amplitude rad, Hz) where it passes 0 from below, hence stays. `margin`: least loss factor over all
    amplitudes; `without`: the same with the feed-forward off.
    """

    amplitudes_rad: tuple[float, ...]
    describing_Nm_per_rad: tuple[complex, ...]
    hertz: tuple[float, ...]
    loss_factor: tuple[float, ...]
    found: tuple[tuple[float, float], ...]
    margin: float
    without: float


def limit_cycle(work: DesignWork, config: JointConfig, gains: Gains, peak_rad: float) -> LimitCycle:
    """Harmonic balance of the link's swing, amplitude by amplitude."""
    hysteresis = Hysteresis(config)
    amplitudes = np.geomspace(1e-3, 1.0, 16) * peak_rad
    values = np.asarray(control.describing_function(hysteresis, amplitudes))
    hertz = np.geomspace(2.0, 0.49 / work.period, 1500)
    G = work.compensation(gains, hertz)
    on = [_balance(work.motor, complex(v), hertz, G) for v in values]
    off = [_balance(work.motor, complex(v), hertz, 0.0 * G) for v in values]
    loss = [pair[1] for pair in on]
    found = tuple(
        (float(amplitudes[k]), on[k][0]) for k in range(1, len(loss)) if loss[k - 1] < 0.0 <= loss[k]
    )
    return LimitCycle(
        tuple(float(a) for a in amplitudes),
        tuple(complex(v) for v in values),
        tuple(pair[0] for pair in on),
        tuple(loss),
        found,
        min(loss),
        min(pair[1] for pair in off),
    )


def _balance(m: MotorModel, value: complex, hertz: NDArray[np.float64], G: Complex) -> tuple[float, float]:
    """(Hz, loss factor) of the least damped frequency at which `Re K = J w^2`."""
    w = 2.0 * pi * hertz
    K = value / (1.0 - G)
    own = float(np.sqrt(abs(value) * m.output_inertia_kgm2))
    b = m.output_viscous_Nms_per_rad + 2.0 * m.structural_damping * own
    excess = K.real - m.output_inertia_kgm2 * w**2
    places = np.flatnonzero((excess[:-1] > 0.0) & (excess[1:] <= 0.0))
    if len(places) == 0:
        return float("nan"), float("inf")
    loss = [float((K[p].imag + b * w[p]) / K[p].real) for p in places]
    worst = int(np.argmin(loss))
    return float(hertz[places[worst]]), loss[worst]


class Hysteresis(control.DescribingFunctionNonlinearity):  # type: ignore[misc]  # python-control has no types
    """Deflection to load of a joint, motor held, as python-control's describing functions want a
    nonlinearity.

    `describing_function(A)` = first harmonic of the load over the amplitude of a sinusoidal deflection of A
    rad, in the third cycle, mean removed (Nm/rad, complex: the imaginary part is the loop's loss). `bias_Nm`
    = load about which it swings.
    """

    def __init__(self, config: JointConfig, bias_Nm: float = 0.0, samples: int = 120) -> None:
        super().__init__()
        self._config = at_start(config)
        self._samples = samples
        self._bias_Nm = bias_Nm
        self._cache: dict[float, complex] = {}
        self._live: Observer | None = None
        self._time = 0.0

    def __call__(self, deflection_rad: float) -> float:
        """Load (Nm) at a deflection (rad), history kept between calls; see `reset`."""
        if self._live is None:
            self._live = self._started()
        self._time += 1e3
        sample = Sample(self._time, 0.0, 0.0, float(deflection_rad), 0.0, 20.0)
        return self._live.step_inverse(full(sample, self._live)).joint_torque_Nm

    def reset(self) -> None:
        """Forget the history of calls."""
        self._live = None

    def _isstatic(self) -> bool:
        return False

    def describing_function(self, A: float) -> complex:
        """First harmonic of the load over A, Nm/rad."""
        key = float(A)
        if key not in self._cache:
            self._cache[key] = self._harmonic(key)
        return self._cache[key]

    def _started(self) -> Observer:
        observer = Observer(self._config)
        self._time = 1.0
        found = observer.step(full(Sample(0.0, 0.0, self._bias_Nm, 0.0, 0.0, 20.0), observer))
        self._middle = found.deflection_rad
        return observer

    def _harmonic(self, amplitude: float) -> complex:
        observer = self._started()
        n = self._samples
        phase = 2.0 * np.pi * np.arange(1, 3 * n + 1) / n
        loads = []
        for k, angle in enumerate(self._middle + amplitude * np.sin(phase)):
            sample = Sample(1e3 * (k + 1), 0.0, 0.0, float(angle), 0.0, 20.0)
            loads.append(observer.step_inverse(full(sample, observer)).joint_torque_Nm)
        last, at = np.array(loads[-n:]), phase[-n:]
        last = last - last.mean()
        in_phase = 2.0 * float(np.mean(last * np.sin(at)))
        quadrature = 2.0 * float(np.mean(last * np.cos(at)))
        return complex(in_phase, quadrature) / amplitude
