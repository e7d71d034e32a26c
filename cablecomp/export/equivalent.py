"""What a simulator can take of a joint: one stiffness, one dry friction, an equivalent backlash; and what that
leaves out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cablecomp.config import EffectEntry, Empirical, JointConfig, Sensors
from cablecomp.control.stiffness import greatest_load, is_of_time, stiffness_range
from cablecomp.effects.catalogue import acts_through


class Equivalent(NamedTuple):
    """A joint as a spring with dry friction beside it, q_out = ratio q_in + deflection.

    The loop +most, −most, +most Nm of the observer (history and effects in it, motor held; of an open circuit most, 0,
    most) gives: `backlash_rad` w = its greatest width, what a joint whose play is that wide would show. Spring and
    friction side by side go 2 (most - friction)/stiffness from end to end and are 2 friction/stiffness wide; so that
    this is the loop's reach and its width, `stiffness_Nm_per_rad` = (span of loads)/(reach + w) and `friction_Nm` =
    stiffness w/2.
    `rms_rad`: what this leaves of the loop, of `reach_rad` in all.
    """

    ratio: float
    stiffness_Nm_per_rad: float
    friction_Nm: float
    backlash_rad: float
    most_Nm: float
    rms_rad: float
    reach_rad: float

    def lost(self, config: JointConfig) -> tuple[str, ...]:
        """What these numbers leave out, one line each."""
        return (
            f"of the loop, {loads(config, self.most_Nm)}, the equivalent leaves {1e3 * self.rms_rad:.3g} mrad RMS of "
            f"{1e3 * self.reach_rad:.3g} mrad",
            "smaller loads: their loops are narrower than those of one dry "
            "friction; the drive is stiffer at each reversal",
            "the memory of the wraps: turning either pulley moves what earlier loads have left",
            "bounds for what came before",
            *beyond_loops(config),
        )


def beyond_loops(config: JointConfig) -> tuple[str, ...]:
    """What a joint's own effects, empirical laws, sensors, sessions and conditions do that is in no loop of the load
    with the motor held, one line each."""
    common = (law for law in config.empirical if not law.session)
    entries: tuple[EffectEntry | Empirical, ...] = (*config.effect, *common)
    of_time = [entry.id for entry in entries if is_of_time(entry)]
    of_more = [entry.id for entry in entries if _is_of_more(entry) and not is_of_time(entry)]
    right = Sensors()
    wrong = [
        f"{name} = {getattr(config.sensors, name):.6g}"
        for name in ("joint_position_offset_rad", "joint_torque_gain", "joint_torque_offset_Nm")
        if getattr(config.sensors, name) != getattr(right, name)
    ]
    own = dict.fromkeys(name for session in config.sessions for name in session.values)
    own |= dict.fromkeys(law.id for law in config.empirical if law.session)
    lines = {
        "what goes by the time": of_time,
        "what goes by more than the load enters by its loops alone, motor held at 0 rad": of_more,
        "what sensors read wrong; angles and loads are the true ones": wrong,
        "what is a session's own; the values common to all are taken": list(own),
        "what goes with a condition; each value at the condition that it is stated for is taken": [
            f"{law.parameter} by {law.on}" for law in config.depends
        ],
    }
    return tuple(f"{line}: {', '.join(names)}" for line, names in lines.items() if names)


def _is_of_more(entry: EffectEntry | Empirical) -> bool:
    """Whether an effect, or an empirical law, goes by anything but the load."""
    if isinstance(entry, Empirical):
        return entry.of != "joint_torque_Nm"
    return not set(acts_through(entry)) <= {"load", "load_direction", "reversal"}


def loads(config: JointConfig, most_Nm: float) -> str:
    """From which to which load a joint's loop goes: an open circuit's cable only pulls."""
    return f"{0.0 if config.drive.circuit == 'open' else -most_Nm:.4g} to {most_Nm:.4g} Nm"


def equivalent(config: JointConfig) -> Equivalent:
    """Find the equivalent of a joint at its greatest load; raises InputError where the drive carries none."""
    most = greatest_load(config)
    found = stiffness_range(config, most)
    n = len(found.load_Nm) // 5  # first touch, no part of the loop
    reach = float(np.ptp(found.deflection_rad[n:]))
    span = float(np.ptp(found.load_Nm))
    stiffness = span / (reach + found.width_rad)
    friction = 0.5 * stiffness * found.width_rad
    down = slice(n, 3 * n)  # one whole branch: from the greatest load to the least
    middle = 0.5 * (found.deflection_rad[down].max() + found.deflection_rad[down].min())
    centre = 0.5 * (found.load_Nm[down].max() + found.load_Nm[down].min())
    line = middle + (found.load_Nm[down] - centre + friction) / stiffness
    line = np.minimum(line, found.deflection_rad[n])  # held by friction until it slides
    return Equivalent(
        config.drive.ratio, stiffness, friction, found.width_rad, most,
        float(np.sqrt(np.mean((found.deflection_rad[down] - line) ** 2))), reach,
    )  # fmt: skip
