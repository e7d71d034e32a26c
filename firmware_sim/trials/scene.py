"""The scene of a trial: what its courses may use, its plain drive's run and measures, and whether its joint is
none that a trial is about."""

from __future__ import annotations

import numpy as np

from firmware_sim.plant import PlantRun
from firmware_sim.trials.courses import Course, Range
from firmware_sim.trials.joints import DrawnJoint
from firmware_sim.trials.measures import PlainDrive, plain_measures
from firmware_sim.trials.sizes import run_course
from firmware_sim.trials.suspects import Scene

PAUSE_S = 30.0  # between two recordings
_TAUT = 0.02  # of T0, the least tension that a trial may come down to
_LOST_RAD = 1.0  # off the motor, as no joint of a trial is


def usable(joint: DrawnJoint, one_sided: bool = False) -> Range:
    """What courses of this joint may use."""
    return Range(joint.load_Nm, joint.travel_rad, 1.0 / joint.true.ratio, one_sided)


def plain_scene(joint: DrawnJoint, course: Course) -> tuple[Scene, PlantRun]:
    """The scene of a course with the measures of its plain drive, and the plain drive's run."""
    unmeasured = PlainDrive(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    run = run_course(Scene(joint, course, unmeasured))
    return Scene(joint, course, plain_measures(course.seen, run.joint_position_rad, joint.true.ratio)), run


def is_no_trial(run: PlantRun, joint: DrawnJoint) -> bool:
    """Whether a cable came so near to going slack that the trial would be about that, or the plant found no tension
    that holds: a coefficient that grows with pressure may have none, a few turns of a wrap on."""
    least = float(run.tension_h_N.min())
    if joint.true.circuit == "closed":
        least = min(least, float(run.tension_l_N.min()))
    off = run.joint_position_rad - joint.true.ratio * run.motor_true_rad
    return least < _TAUT * joint.stage.pretension_N or float(np.abs(off).max()) > _LOST_RAD
