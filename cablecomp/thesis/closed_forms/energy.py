"""Energies of a wrap while it is loaded, and the losses of pulleys that turn under load (thesis, 2.2.6 to
2.3.2).

Two balances are given. The thesis lets the final load act at once and stay (work in = T_app * elongation,
every element feels its final friction); its three terms balance. A load that grows slowly does less work and
loses less: those are the terms that a quasi-static history must reproduce. Both lose T0^2 R/(EA mu)
(tau-1)^3/6 to leading order.
"""

from __future__ import annotations

import numpy as np

from cablecomp.thesis.closed_forms.wrap import Array, Number, signed_mu


def sudden_work_J(tau: Number, mu: Number, radius_m: Number, EA_N: Number, pretension_N: Number) -> Array:
    """Work of a load applied at once, T0^2 R/(EA mu*) (tau^2 - tau - tau ln tau) (2-96); J."""
    t = np.asarray(tau, dtype=float)
    return np.asarray(_scale(t, mu, radius_m, EA_N, pretension_N) * (t * t - t - t * np.log(t)))


def sudden_dissipation_J(
    tau: Number, mu: Number, radius_m: Number, EA_N: Number, pretension_N: Number
) -> Array:
    """Friction loss of a load applied at once, T0^2 R/(EA mu*) (tau^2/2 - tau ln tau - 1/2) (2-87); J."""
    t = np.asarray(tau, dtype=float)
    return np.asarray(_scale(t, mu, radius_m, EA_N, pretension_N) * (t * t / 2.0 - t * np.log(t) - 0.5))


def sudden_stretching_J(
    tau: Number, mu: Number, radius_m: Number, EA_N: Number, pretension_N: Number
) -> Array:
    """Work of the final tensions on the strain, T0^2 R/(2 EA mu*) (tau - 1)^2 (2-93); J. The thesis calls it
    stored.
    """
    t = np.asarray(tau, dtype=float)
    return _scale(t, mu, radius_m, EA_N, pretension_N) * (t - 1.0) ** 2 / 2.0


def slow_work_J(tau: Number, mu: Number, radius_m: Number, EA_N: Number, pretension_N: Number) -> Array:
    """Work of a load that grows slowly, the integral of T d(delta) = T0^2 R/(2 EA mu*) (tau - 1)^2; J (own
    derivation).
    """
    return sudden_stretching_J(tau, mu, radius_m, EA_N, pretension_N)


def strain_energy_J(tau: Number, mu: Number, radius_m: Number, EA_N: Number, pretension_N: Number) -> Array:
    """Elastic energy above that at uniform pretension; J.

    The integral of (T^2 - T0^2)/(2 EA) over the wrap = T0^2 R/(2 EA mu*) ((tau^2 - 1)/2 - ln tau) (own
    derivation). Negative where the cable is let down.
    """
    t = np.asarray(tau, dtype=float)
    return np.asarray(_scale(t, mu, radius_m, EA_N, pretension_N) * ((t * t - 1.0) / 2.0 - np.log(t)) / 2.0)


def slow_dissipation_J(
    tau: Number, mu: Number, radius_m: Number, EA_N: Number, pretension_N: Number
) -> Array:
    """Friction loss while the load grows slowly, `slow_work_J - strain_energy_J`; J, never negative (own
    derivation).

    T0^2 R/(EA mu*) (tau^2/4 - tau + 3/4 + ln(tau)/2).
    """
    t = np.asarray(tau, dtype=float)
    shape = t * t / 4.0 - t + 0.75 + np.log(t) / 2.0
    return np.asarray(_scale(t, mu, radius_m, EA_N, pretension_N) * shape)


def slip_zone_rad(tight_N: Number, slack_N: Number, mu: Number) -> Array:
    """Slip zone of a belt-like pulley that turns steadily under load, ln(T_h/T_l)/mu, at the exit only
    (2-99); rad.
    """
    return np.asarray(np.log(np.asarray(tight_N, dtype=float) / np.asarray(slack_N)) / mu)


def pulley_loss_W(
    speed_rad_s: Number, moment_Nm: Number, tight_N: Number, slack_N: Number, EA_N: Number
) -> Array:
    """Friction loss of a belt-like pulley that turns steadily, Omega M (T_h - T_l)/(2 EA) (2-113); W."""
    power = np.asarray(speed_rad_s, dtype=float) * np.asarray(moment_Nm)
    return np.asarray(power * (np.asarray(tight_N) - np.asarray(slack_N)) / (2.0 * np.asarray(EA_N)))


def steady_efficiency(moment_Nm: Number, radius_m: Number, EA_N: Number) -> Array:
    """Efficiency of two pulleys that turn steadily, (1 - a)/(1 + a), a = M/(2 R EA) (2-116); M on the pulley
    of radius R.
    """
    a = np.abs(np.asarray(moment_Nm, dtype=float)) / (2.0 * np.asarray(radius_m) * np.asarray(EA_N))
    return np.asarray((1.0 - a) / (1.0 + a))


def efficiency_limit(moment_Nm: Number, radius_m: Number, EA_N: Number) -> Array:
    """First-order efficiency limit of a drive, 1 - M/(R EA) (2-118; Green, Tordion, Townsend)."""
    return np.asarray(
        1.0 - np.abs(np.asarray(moment_Nm, dtype=float)) / (np.asarray(radius_m) * np.asarray(EA_N))
    )


def _scale(tau: Array, mu: Number, radius_m: Number, EA_N: Number, pretension_N: Number) -> Array:
    force = np.asarray(pretension_N, dtype=float)
    return np.asarray(force**2 * np.asarray(radius_m) / (np.asarray(EA_N) * signed_mu(tau, mu)))
