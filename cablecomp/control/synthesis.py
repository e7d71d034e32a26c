"""The work of a design: the loops of a joint, the filters and gains that keep their margins over the
stiffness range.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cablecomp.config import JointConfig
from cablecomp.control.compensator import Gains
from cablecomp.control.margins import Loop, grid_for, highest_gain, holds, margin_of, modulus_for
from cablecomp.control.options import ControlConfig
from cablecomp.control.plant_model import (
    JOINT,
    LOAD,
    MOTOR,
    Complex,
    closed,
    delayed,
    follow_path,
    integrator,
    is_stable,
    joint_model,
    load_path,
    pick,
    response,
)
from cablecomp.control.stiffness import StiffnessRange
from cablecomp.errors import InputError

_FILTERS_HZ = tuple(float(f) for f in np.round(np.geomspace(80.0, 1.0, 25), 1))
_LEADS = (2.0, 1.5, 1.0, 0.5, 0.0)  # of the filter's time constant
_INERTIAS = (0.7, 1.4)  # the link's inertia is rarely known better
_CONTACTS = (0.0, 0.3, 1.0, 30.0)  # stiffness of what is touched, over the drive's own


class DesignWork:
    """One design in the making."""

    def __init__(
        self, config: JointConfig, period_s: float, wanted: ControlConfig, stiffness: StiffnessRange
    ) -> None:
        self.wanted = wanted
        self.motor = wanted.motor
        self.ratio = config.drive.ratio
        self.period = period_s
        self.slope_Hz = wanted.compensator.velocity_filter_Hz
        self.range = stiffness.spread(5)
        self.grid = grid_for(period_s)
        self.modulus = modulus_for(wanted.gain_margin, wanted.phase_margin_deg)
        self._models: dict[tuple[float, float, float], Any] = {}

    def model(self, stiffness: float, contact: float = 0.0, inertia: float = 1.0) -> Any:
        """The joint at one stiffness; `contact` is over that stiffness, `inertia` over the nominal one."""
        key = (stiffness, contact, inertia)
        if key not in self._models:
            self._models[key] = joint_model(
                self.motor, self.ratio, stiffness, self.period, contact * stiffness, inertia
            )
        return self._models[key]

    def check_drive(self) -> None:
        """The drive alone must be stable on every cable."""
        for k in self.range:
            if not is_stable(pick(self.model(k, 1.0), [MOTOR], [0])):
                raise InputError(
                    f"motor: the drive's own loop (stiffness {self.motor.stiffness_Nm_per_rad:g} Nm/rad, "
                    f"damping {self.motor.damping_Nms_per_rad:g} Nms/rad) is unstable on a cable of "
                    f"{k:.4g} Nm/rad, with a motor of {self.motor.inertia_kgm2:.3g} kgm2: state the motor's inertia "
                    "and delay in a control file, or other gains"
                )

    # ---- the loops ---------------------------------------------------------------------------------

    def path(self, k: float, filter_Hz: float, lead_s: float) -> Any:
        """The feed-forward's own part of the loop."""
        return load_path(self.motor, self.ratio, 1.0 / k, filter_Hz, lead_s, self.slope_Hz, self.period)

    def load_loop(self, k: float, filter_Hz: float, lead_s: float, inertia: float = 1.0) -> Any:
        """Feed-forward on the measured load, opened at the sensor."""
        return -(pick(self.model(k, 0.0, inertia), [LOAD], [0, 1, 2]) * self.path(k, filter_Hz, lead_s))

    def joint_loop(self, k: float, gain: float, gains: Gains, compensated: bool) -> Any:
        """Integral feedback on the joint encoder, feed-forward acting or not, opened at the encoder."""
        plant = pick(self.model(k), [LOAD, JOINT], [0, 1, 2])
        if compensated:
            plant = closed(plant, self.path(k, gains.load_filter_Hz, gains.load_lead_s))
        return pick(plant, [1], [0]) * integrator(gain, 1.0 / self.ratio, self.period)

    def force_loop(self, k: float, gain: float, gains: Gains, contact: float) -> Any:
        """Integral feedback on the torque known from both encoders, the joint being followed, opened at
        the torque.
        """
        path = follow_path(self.ratio, gains.follow_filter_Hz, gains.follow_lead_s, self.period)
        held = closed(pick(self.model(k, contact), [JOINT, LOAD], [0, 1, 2]), path)
        return pick(held, [1], [0]) * integrator(gain, -1.0 / (k * self.ratio), self.period)

    def motor_loop(self, k: float, gain: float) -> Any:
        """Integral feedback on the motor encoder, opened there."""
        return pick(self.model(k), [MOTOR], [0]) * integrator(gain, 1.0, self.period)

    # ---- the design --------------------------------------------------------------------------------

    def gains(self) -> Gains:
        """The options' own gains where given; the others designed, one after the other."""
        o, ks = self.wanted.compensator, self.range
        load = self._filter(o.load_filter_Hz, o.load_lead_s, self._load_holds)
        follow = self._filter(o.follow_filter_Hz, o.follow_lead_s, self._follow_holds)
        gains = Gains(*load, *follow, 0.0, 0.0, 0.0)
        motor = o.motor_integral_per_s
        if motor is None:
            motor = 0.5 * self._greatest(lambda g: [self.motor_loop(k, g) for k in ks], 200.0)
        joint = o.joint_feedback_per_s
        if joint is None:
            both = (False, True)
            joint = self._greatest(
                lambda g: [self.joint_loop(k, g, gains, on) for k in ks for on in both], 200.0
            )
        force = o.force_feedback_per_s
        if force is None:
            force = 0.5 * self._greatest(
                lambda g: [self.force_loop(k, g, gains, c) for k in ks for c in _CONTACTS[1:]], 100.0
            )
        return gains._replace(
            joint_feedback_per_s=joint, force_feedback_per_s=force, motor_integral_per_s=motor
        )

    def _greatest(self, loops: Callable[[float], Sequence[Any]], most: float) -> float:
        return highest_gain(loops, 0.02, most, self.modulus, self.grid)

    def _load_loops(self, filter_Hz: float, lead_s: float) -> Iterator[Any]:
        # the hardest first: most failures are seen in one look
        for inertia in (_INERTIAS[1], _INERTIAS[0], 1.0):
            for k in self.range:
                yield self.load_loop(k, filter_Hz, lead_s, inertia)

    def _load_holds(self, filter_Hz: float, lead_s: float) -> bool:
        return all(holds(loop, self.modulus, self.grid) for loop in self._load_loops(filter_Hz, lead_s))

    def _follow_holds(self, filter_Hz: float, lead_s: float) -> bool:
        """Following is a positive feedback on purpose (a joint that moves is not held back), so that
        margins about -1 mean little: it must be stable for every cable, contact and inertia, with
        another period of delay as well.
        """
        path = follow_path(self.ratio, filter_Hz, lead_s, self.period)
        late = delayed(path, 1)
        for contact in reversed(_CONTACTS):
            for inertia in _INERTIAS:
                for k in reversed(self.range):
                    plant = pick(self.model(k, contact, inertia), [JOINT], [0, 1, 2])
                    free = 1 if contact == 0.0 else 0
                    if not all(is_stable(closed(plant, p), free) for p in (path, late)):
                        return False
        return True

    def _filter(
        self, filter_Hz: float | None, lead_s: float | None, allowed: Callable[[float, float], bool]
    ) -> tuple[float, float]:
        """The filter with the least error at slow frequencies whose loops keep the margins at every
        stiffness.
        """
        slow = np.exp(2j * pi * np.geomspace(0.1, 3.0, 12) * self.period)
        answer, candidates = self._motor_answer(slow), []
        for f in _FILTERS_HZ if filter_Hz is None else (filter_Hz,):
            tau = 1.0 / (2.0 * pi * f)
            for lead in tuple(x * tau for x in _LEADS) if lead_s is None else (lead_s,):
                G = self._passed(f, lead, slow, answer)
                candidates.append((float(np.sqrt(np.mean(np.abs(1.0 - G) ** 2))), f, lead))
        for _, f, lead in sorted(candidates):
            if allowed(f, lead):
                return f, lead
        _, slowest, lead = min(candidates, key=lambda c: (c[1], c[2]))
        return slowest, lead  # its margins are shown as they are

    def _motor_answer(self, z: Complex) -> Complex:
        """The motor's answer at z to its targets, the cable's pull known and fed forward: a motor that carries nothing
        but itself."""
        return response(pick(self.model(1e-9), [MOTOR], [0, 1]), z)[:, 0, :]

    def _passed(self, filter_Hz: float, lead_s: float, z: Complex, answer: Complex) -> Complex:
        """G: share of the deflection that the motor makes up for, at z, where it answers its targets so."""
        k = self.range[-1]
        target = response(self.path(k, filter_Hz, lead_s), z)[:, :, 0]
        found: Complex = -self.ratio * k * (answer[:, 0] * target[:, 0] + answer[:, 1] * target[:, 1])
        return found

    # ---- what is shown -----------------------------------------------------------------------------

    def compensation(self, gains: Gains, hertz: NDArray[np.float64]) -> Complex:
        """G at frequencies in Hz."""
        z = np.exp(2j * pi * hertz * self.period)
        return self._passed(gains.load_filter_Hz, gains.load_lead_s, z, self._motor_answer(z))

    def loops(self, gains: Gains) -> tuple[Loop, ...]:
        """Margins of every loop in use, at every stiffness of the range."""

        def add(name: str, text: str, make: Callable[[float], Any]) -> None:
            found.append(Loop(name, text, tuple(margin_of(make(k), k, self.grid) for k in self.range)))

        found: list[Loop] = []
        g = gains
        add(
            "load feed-forward",
            "deflection compensated for the measured load, opened at the torque sensor",
            lambda k: self.load_loop(k, g.load_filter_Hz, g.load_lead_s),
        )
        if g.motor_integral_per_s > 0.0:
            gain = g.motor_integral_per_s
            add("motor trim", "integral on the motor encoder", lambda k: self.motor_loop(k, gain))
        if g.joint_feedback_per_s > 0.0:
            text, joint = "integral on the joint encoder, feed-forward ", g.joint_feedback_per_s
            add("joint feedback", text + "acting", lambda k: self.joint_loop(k, joint, g, True))
            add("joint feedback alone", text + "off", lambda k: self.joint_loop(k, joint, g, False))
        if g.force_feedback_per_s > 0.0:
            text = "integral on the torque known from both encoders, against a contact as stiff as the drive"
            add("force feedback", text, lambda k: self.force_loop(k, g.force_feedback_per_s, g, 1.0))
        return tuple(found)

    def responses(self, gains: Gains) -> dict[str, tuple[NDArray[np.float64], Complex]]:
        """Frequency responses of the load loop over the range, for the plots (Hz, complex)."""
        z = np.exp(1j * self.grid * self.period)
        hertz = self.grid / (2.0 * pi)
        g = gains
        return {
            f"{k:.4g} Nm/rad": (
                hertz,
                np.squeeze(response(self.load_loop(k, g.load_filter_Hz, g.load_lead_s), z)),
            )
            for k in (self.range[0], self.range[2], self.range[-1])
        }
