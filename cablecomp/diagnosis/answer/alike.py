"""What an effect that is named does about as another one would: where the data hardly tell, it is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT, Evidence, load_channel
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.simulate import Simulator, load_of, simulator
from cablecomp.signal.smoothing import FloatArray


def drag_alike(fit: Fit) -> str | None:
    """One line where the model has the joint's readings late, its angle alone was recorded, and a drag in proportion to
    its speed would do about the same; else None.

    A short delay takes late * dtheta/dt off the angle, a drag b [N m s/rad] the deflection under b * dtheta/dt: b is
    what comes nearest, with the drive's friction and its history in it.
    """
    problem = fit.problem
    first = problem.evidence[0]
    joint = problem.joint(fit.x, first)
    late = next((e.parameters.get("delay_s", 0.0) for e in joint.effect if e.id == "clock_skew"), 0.0)
    if problem.channels != (JOINT,) or isinstance(late, str) or not late > 0.0:
        return None
    drive = simulator(joint)
    try:
        found = _drag(drive, first, float(late))
    except InputError:  # a drag that this joint could not bear
        return None
    if found is None or found[1] > LIMITS.alike:
        return None
    drag, differs = found
    return (
        f"readings of the joint that come {1e3 * late:.3g} ms late and a drag of {drag:.2g} N m s/rad in proportion to "
        f"its speed (a seal, grease) do nearly the same to its angle (all but {100 * differs:.0f} % of the square): "
        "the motor's torque or tensions recorded as well, or another pretension, would tell them apart"
    )


def _drag(drive: Simulator, recording: Evidence, late: float) -> tuple[float, float] | None:
    """The drag [N m s/rad] that does most nearly what the delay does, and the share of its square in which they
    differ."""
    time = recording.columns["time_s"]
    load = np.broadcast_to(load_of(drive.joint, recording.columns), time.shape)
    before = drive.run(recording, np.arange(len(time)))
    speed = np.gradient(before.joint, time)
    wanted = -late * speed
    drag, left = late / float(np.median(before.compliance)), wanted
    for _ in range(3):
        does = _under(drive, recording, load - drag * speed) - before.joint
        square = float(does @ does)
        if not square > 0.0:
            return None
        times = float(does @ wanted) / square
        left = wanted - times * does
        drag *= max(times, 0.1)
    return drag, float(left @ left) / max(float(wanted @ wanted), 1e-300)


def _under(drive: Simulator, recording: Evidence, load: FloatArray) -> FloatArray:
    """The joint's angle under another load [N m]."""
    channel = load_channel(drive.joint, recording.columns)
    if channel != "joint_torque_Nm":
        raise InputError(f"{recording.name}: no joint torque was recorded")
    changed = replace(recording, columns={**recording.columns, channel: load})
    return drive.run(changed, np.arange(len(load))).joint
