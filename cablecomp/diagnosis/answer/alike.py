"""What an effect that was found does about as another one would: where the data hardly tell, it is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT, Evidence, load_channel
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.simulate import Simulator, simulator

LOAD = "joint_torque_Nm"
ALIKE = 0.25
"""Share of the square of what late readings do to the angle in which a drag differs, up to which it is said that the
two are hardly told apart: half of it (RMS), most of which a second effect, or other values, take up (a seal's drag in
`tests/bench` is named as late readings and a bearing's friction)."""
NEARER = 3
"""Times that the drag is set to what would do most nearly the same by a straight line: friction bends it."""


def drag_alike(fit: Fit) -> str | None:
    """One line where the joint's readings are late, by a fit to its angle alone under a measured load, and a drag in
    proportion to its speed would do about the same in the first recording; else None.

    A short delay takes late * dtheta/dt off the angle, a drag b [N m s/rad] the deflection under b * dtheta/dt: b is
    what comes nearest, with the drive's friction and its history in it.
    """
    problem = fit.problem
    first = problem.evidence[0]
    joint = problem.joint(fit.x, first)
    late = next((e.parameters.get("delay_s", 0.0) for e in joint.effect if e.id == "clock_skew"), 0.0)
    if not late > 0.0 or problem.channels != (JOINT,) or load_channel(joint, first.columns) != LOAD:
        return None
    try:
        drag, differs = _drag(simulator(joint), first, late)
    except InputError:  # a drag that this joint cannot bear
        return None
    if not differs <= ALIKE:
        return None
    return (
        f"readings of the joint that come {1e3 * late:.3g} ms late and a drag of {drag:.2g} N m s/rad in proportion to "
        f"its speed (a seal, grease) do nearly the same to its angle (all but {100 * differs:.0f} % of the square): "
        "the motor's torque or tensions recorded as well, or another pretension, would tell them apart"
    )


def _drag(drive: Simulator, recording: Evidence, late: float) -> tuple[float, float]:
    """The drag [N m s/rad] that does most nearly what the delay [s] does, and the share of its square in which they
    differ: 1 where the joint stands still, or no drag does any of it."""
    columns, rows = recording.columns, np.arange(len(recording.columns["time_s"]))
    before = drive.run(recording, rows)
    speed = np.gradient(before.joint, columns["time_s"])
    wanted = -late * speed
    drag, differs = late / float(np.median(before.compliance)), 1.0
    for _ in range(NEARER):
        dragged = replace(recording, columns={**columns, LOAD: columns[LOAD] - drag * speed})
        does = drive.run(dragged, rows).joint - before.joint
        along = float(does @ wanted)
        if not along > 0.0:
            return drag, 1.0
        times = along / float(does @ does)
        differs = 1.0 - times * along / float(wanted @ wanted)
        drag *= times
    return drag, differs
