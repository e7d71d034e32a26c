"""What an effect that was found does about as another one would: where the data hardly tell, it is said."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np

from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT, Evidence, load_channel
from cablecomp.estimation.least_squares import Fit, rms_left
from cablecomp.estimation.simulate import Simulator, simulator

LOAD = "joint_torque_Nm"
APART = 3.0
"""Times what the fit leaves (RMS), beyond which a drag that differs by so much from the delay is another thing, which
these data exclude; some of it other values take up (two drags of the plant, named as delays: 1.1 and 2.0 times; a true
delay: 18)."""
NEARER = 3
"""Times that the drag is set to what would do most nearly the same by a straight line: friction bends it."""


def drag_alike(fit: Fit) -> str | None:
    """One line where the joint's readings are late, by a fit to its angle alone under a measured load or none, and a
    drag in proportion to its speed would leave about as much of the first recording; else None.

    A short delay takes late * dtheta/dt off the angle, a drag b [N m s/rad] the deflection under b * dtheta/dt: b is
    what comes nearest, with the drive's friction and its history in it.
    """
    problem = fit.problem
    first = problem.evidence[0]
    joint = problem.joint(fit.x, first)
    late = next((e.parameters.get("delay_s", 0.0) for e in joint.effect if e.id == "clock_skew"), 0.0)
    if (
        not late > 0.0
        or problem.channels != (JOINT,)
        or load_channel(joint, first.columns) not in (LOAD, None)
    ):
        return None
    try:
        drag, differs = _drag(simulator(joint), first, late)
    except InputError:  # a drag that this joint cannot bear
        return None
    left = rms_left(fit)
    if not differs < APART * left:
        return None
    return (
        f"what reads as {1e3 * late:.3g} ms late may be a drag of {drag:.2g} N m s/rad in proportion to the joint's "
        f"speed (a seal, grease): they differ by {1e3 * differs:.2g} mrad (RMS), {1e3 * left:.2g} mrad are left; the "
        "motor's torque or tensions recorded as well, or another pretension, would tell them apart"
    )


def _drag(drive: Simulator, recording: Evidence, late: float) -> tuple[float, float]:
    """The drag [N m s/rad] that does most nearly what the delay [s] does, and by how much they differ [rad, RMS];
    infinite where no drag does any of it."""
    columns, rows = recording.columns, np.arange(len(recording.columns["time_s"]))
    before = drive.run(recording, rows)
    speed = np.gradient(before.joint, columns["time_s"])
    wanted = -late * speed
    load = columns.get(LOAD, np.zeros_like(speed))
    drag, differs = late / float(np.median(before.compliance)), inf
    for _ in range(NEARER):
        dragged = replace(recording, columns={**columns, LOAD: load - drag * speed})
        does = drive.run(dragged, rows).joint - before.joint
        along = float(does @ wanted)
        if not along > 0.0:
            return drag, inf
        times = along / float(does @ does)
        differs = float(np.sqrt(np.mean((wanted - times * does) ** 2)))
        drag *= times
    return drag, differs
