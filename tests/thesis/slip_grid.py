"""A wrapped cable as grid points that slip one after the other: an independent check of the closed forms.

Every point obeys the slip condition (2-11) alone, |dT/dtheta| <= mu T: walking in from the free end, a point
whose tension differs from its outer neighbour's by more than friction holds slips until friction just holds.
No cone, no exponential, no formula of the thesis.
"""

from __future__ import annotations

import numpy as np


class SlipGrid:
    """Tensions T/T0 at equidistant angles, free end first."""

    def __init__(self, mu: float, wrap: float, points: int = 2001) -> None:
        self.step = wrap / (points - 1)
        # Exact ratio of neighbours that friction can hold over one step of the Euler-Eytelwein equation.
        self.ratio = float(np.exp(mu * self.step))
        self.mu = mu
        self.tension = np.ones(points)

    def load(self, tau: float) -> None:
        """Bring the free end to `tau`; call in small steps."""
        t = self.tension
        t[0] = tau
        for i in range(1, len(t)):
            held = min(max(t[i], t[i - 1] / self.ratio), t[i - 1] * self.ratio)
            if held == t[i]:
                break
            t[i] = held

    def copy(self) -> SlipGrid:
        other = object.__new__(SlipGrid)
        other.step, other.ratio, other.mu, other.tension = self.step, self.ratio, self.mu, self.tension.copy()
        return other

    def unwind(self, points: int) -> None:
        """Take `points` steps of cable off the pulley at constant load."""
        tau = self.tension[0]
        self.tension = self.tension[points:]
        self.load(tau)

    def elongation(self) -> float:
        """delta EA/(R T0) = integral of (T/T0 - 1) over the wrap (trapezoid rule)."""
        return float(np.trapezoid(self.tension - 1.0, dx=self.step))

    def strain_energy(self) -> float:
        """Elastic energy above uniform pretension, EA/(R T0^2) times it."""
        return float(np.trapezoid((self.tension**2 - 1.0) / 2.0, dx=self.step))


class SlipCable:
    """Two wraps and a free span; `delta EA/T0` of the whole cable, lengths in units of the output radius."""

    def __init__(self, wraps: list[tuple[float, SlipGrid]], span: float) -> None:
        self.wraps, self.span = wraps, span

    def trial(self, tau: float) -> tuple[float, SlipCable]:
        after = SlipCable([(radius, grid.copy()) for radius, grid in self.wraps], self.span)
        for _, grid in after.wraps:
            grid.load(tau)
        total = sum(radius * grid.elongation() for radius, grid in after.wraps)
        return total + self.span * (tau - 1.0), after


def closed_history(h: SlipCable, low: SlipCable, moments: np.ndarray) -> np.ndarray:
    """Solve (4-1), (4-4) by bisection for each m in turn; returns rows tau_h, tau_l, theta EA/T0
    (radius 1).
    """
    rows = []
    for m in moments:
        a, b = max(0.0, -m), max(0.0, -m) + 6.0
        for _ in range(46):
            t = 0.5 * (a + b)
            if h.trial(t + m)[0] + low.trial(t)[0] > 0.0:
                b = t
            else:
                a = t
        t = 0.5 * (a + b)
        theta, h = h.trial(t + m)
        _, low = low.trial(t)
        rows.append((t + m, t, theta))
    return np.array(rows)
