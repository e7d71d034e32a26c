"""The joint as its loops see it: linear, at one stiffness, discrete at the loop's rate (python-control
state space).

Continuous: motor `J_m dw + b_m w = tau + N F`, drive `tau = kp (q* - q_in) + kd (v* - w) + tau*`
through a first-order torque loop, cable `F = k (q_out - N q_in) + c d/dt(q_out - N q_in)`, output `J dv
+ b v = -F - k_e q_out - c_e v`, k_e = stiffness of what the joint touches. Inputs q*, v*, tau* are held
over a period; outputs: the torque sensor's M = F, joint angle, motor angle.
"""

from __future__ import annotations

from math import exp, pi, sqrt
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from cablecomp.control.options import MotorModel

LOAD, JOINT, MOTOR = range(3)
Complex = NDArray[np.complex128]


def joint_model(
    motor: MotorModel,
    ratio: float,
    stiffness: float,
    period_s: float,
    contact_Nm_per_rad: float = 0.0,
    inertia_factor: float = 1.0,
) -> Any:
    """State space from (q*, v*, tau*) to (M, q_out, q_in), zero-order hold, drive's delay included in
    whole periods.
    """
    m, n, k, e = motor, ratio, stiffness, contact_Nm_per_rad
    J, Jm = m.output_inertia_kgm2 * inertia_factor, m.inertia_kgm2
    c = 2.0 * m.structural_damping * sqrt(k * J)
    b = m.output_viscous_Nms_per_rad + m.contact_damping_s * e
    w = 2.0 * pi * m.torque_bandwidth_Hz
    v = 2.0 * pi * m.velocity_bandwidth_Hz
    F = np.array(
        [-n * k, -n * c, k, c, 0.0, 0.0]
    )  # states: q_in, w, q_out, dq_out, tau, w as the drive knows it
    A = np.zeros((6, 6))
    A[0, 1] = A[2, 3] = 1.0
    A[1] = n * F / Jm + np.array([0.0, -m.viscous_Nms_per_rad / Jm, 0.0, 0.0, 1.0 / Jm, 0.0])
    A[3] = -F / J + np.array([0.0, 0.0, -e / J, -b / J, 0.0, 0.0])
    A[4] = -w * np.array([m.stiffness_Nm_per_rad, 0.0, 0.0, 0.0, 1.0, m.damping_Nms_per_rad])
    A[5] = np.array([0.0, v, 0.0, 0.0, 0.0, -v])
    B = np.zeros((6, 3))
    B[4] = w * np.array([m.stiffness_Nm_per_rad, m.damping_Nms_per_rad, 1.0])
    C = np.vstack([F, np.eye(6)[2], np.eye(6)[0]])
    with np.errstate(over="ignore", invalid="ignore"):  # a loop that outgrows all numbers: `is_stable`
        sampled = control.c2d(control.ss(A, B, C, np.zeros((3, 3))), period_s, method="zoh")
    return delayed(sampled, round(m.delay_s / period_s))


def delayed(system: Any, samples: int) -> Any:
    """The same system with its inputs late by whole samples."""
    A, B, C, D = parts(system)
    for _ in range(samples):
        n, inputs = A.shape[0], B.shape[1]
        A = np.block([[A, B], [np.zeros((inputs, n + inputs))]])
        B = np.vstack([np.zeros((n, inputs)), np.eye(inputs)])
        C = np.hstack([C, D])
        D = np.zeros_like(D)
    return control.ss(A, B, C, D, system.dt)


def lead_filter(filter_Hz: float, lead_s: float, period_s: float) -> Any:
    """`shaping.LeadFilter` as a system: from a reading to (expected value, its rate)."""
    kept = exp(-2.0 * pi * filter_Hz * period_s)
    a, lag = 1.0 - kept, period_s * kept / (1.0 - kept)
    first, second = np.array([1.0 - a, 0.0]), np.array([a * (1.0 - a), 1.0 - a])
    rate, rate_given = (first - second) / lag, (a - a * a) / lag
    A, B = np.vstack([first, second]), np.array([[a], [a * a]])
    C, D = np.vstack([second + lead_s * rate, rate]), np.array([[a * a + lead_s * rate_given], [rate_given]])
    return control.ss(A, B, C, D, period_s)


def load_path(
    motor: MotorModel,
    ratio: float,
    compliance: float,
    filter_Hz: float,
    lead_s: float,
    slope_Hz: float,
    period_s: float,
) -> Any:
    """The feed-forward as the compensator runs it: from a reading of the load to (q*, v*, tau*);
    `compliance` in rad/Nm.
    """
    a, b, c, d = parts(pick(lead_filter(filter_Hz, lead_s, period_s), [0], [0]))
    s = 1.0 - exp(-2.0 * pi * slope_Hz * period_s)
    bend, bend_given = compliance * c[0], compliance * d[0, 0]
    # two more states: the last deflection and its filtered rate
    zero = np.zeros((2, 1))
    A = np.block([[a, zero, zero], [bend, 0.0, 0.0], [s / period_s * bend, -s / period_s, 1.0 - s]])
    B = np.vstack([b, [[bend_given]], [[s / period_s * bend_given]]])
    rate, rate_given = A[3], B[3, 0]
    bend4, load4 = np.append(bend, [0.0, 0.0]), np.append(c[0], [0.0, 0.0])
    torque = -ratio * load4 - motor.viscous_Nms_per_rad * rate / ratio
    torque_given = -ratio * d[0, 0] - motor.viscous_Nms_per_rad * rate_given / ratio
    C = np.vstack([-bend4 / ratio, -rate / ratio, torque])
    D = np.array([[-bend_given / ratio], [-rate_given / ratio], [torque_given]])
    return control.ss(A, B, C, D, period_s)


def follow_path(ratio: float, filter_Hz: float, lead_s: float, period_s: float) -> Any:
    """What force mode does with the joint angle: from a reading of it to (q*, v*, tau*)."""
    a, b, c, d = parts(lead_filter(filter_Hz, lead_s, period_s))
    C, D = np.vstack([c / ratio, np.zeros((1, 2))]), np.vstack([d / ratio, [[0.0]]])
    return control.ss(a, b, C, D, period_s)


def integrator(gain_per_s: float, scale: float, period_s: float) -> Any:
    """`gain/s`, summed once a period before it is used, times `scale`."""
    step = gain_per_s * period_s
    return control.ss([[1.0]], [[step]], [[scale]], [[scale * step]], period_s)


def pick(system: Any, outputs: list[int], inputs: list[int]) -> Any:
    """Part of a system."""
    A, B, C, D = parts(system)
    return control.ss(A, B[:, inputs], C[outputs], D[np.ix_(outputs, inputs)], system.dt)


def closed(plant: Any, path: Any) -> Any:
    """A strictly proper plant with its first output fed over `path` to its inputs; the path's own sign
    counts.
    """
    A, B, C, D = parts(plant)
    a, b, c, d = parts(path)
    seen, n = C[:1], a.shape[0]
    whole = np.block([[A + B @ d @ seen, B @ c], [b @ seen, a]])
    into = np.vstack([B, np.zeros((n, B.shape[1]))])
    return control.ss(whole, into, np.hstack([C, np.zeros((C.shape[0], n))]), D, plant.dt)


def parts(system: Any) -> tuple[Any, Any, Any, Any]:
    """A, B, C, D as plain arrays."""
    return np.asarray(system.A), np.asarray(system.B), np.asarray(system.C), np.asarray(system.D)


def response(system: Any, z: Complex) -> Complex:
    """C (zI - A)^-1 B + D: array [z, output, input]; at every z at once, where python-control solves one by one."""
    A, B, C, D = parts(system)
    shifted = z[:, None, None] * np.eye(A.shape[0]) - A
    found: Complex = C @ np.linalg.solve(shifted, np.broadcast_to(B.astype(complex), (len(z), *B.shape))) + D
    return found


def is_stable(system: Any, but: int = 0) -> bool:
    """Whether every pole lies inside of the unit circle; `but`: so many may lie on it (free integrators)."""
    A = np.asarray(system.A)
    if not np.all(np.isfinite(A)):  # it grew beyond all numbers within one period
        return False
    size = np.sort(np.abs(np.linalg.eigvals(A)))
    inside = size[: len(size) - but] if but else size
    return bool(np.all(inside < 1.0 - 1e-9) and np.all(size < 1.0 + 1e-7))


def stable_when_closed(loop: Any) -> bool:
    """Whether unit negative feedback around a SISO loop is stable."""
    A, B, C, D = parts(loop)
    around = A - B @ C / (1.0 + D[0, 0])
    return bool(np.all(np.abs(np.linalg.eigvals(around)) < 1.0 - 1e-9))
