"""The scene of a trial: what its courses may use, its plain drive's run and measures, and whether a cable goes
slack."""

from __future__ import annotations

from firmware_sim.plant import PlantRun
from firmware_sim.trials.courses import Course, Range
from firmware_sim.trials.joints import DrawnJoint
from firmware_sim.trials.measures import PlainDrive, plain_measures
from firmware_sim.trials.sizes import run_course
from firmware_sim.trials.suspects import Scene

PAUSE_S = 30.0  # between two recordings
_TAUT = 0.02  # of T0, the least tension that a trial may come down to


def usable(joint: DrawnJoint, one_sided: bool = False) -> Range:
    """What courses of this joint may use."""
    return Range(joint.load_Nm, joint.travel_rad, 1.0 / joint.true.ratio, one_sided)


def plain_scene(joint: DrawnJoint, course: Course) -> tuple[Scene, PlantRun]:
    """The scene of a course with the measures of its plain drive, and the plain drive's run."""
    unmeasured = PlainDrive(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    run = run_course(Scene(joint, course, unmeasured))
    return Scene(joint, course, plain_measures(course.seen, run.joint_position_rad, joint.true.ratio)), run


def is_slack(run: PlantRun, joint: DrawnJoint) -> bool:
    """Whether a cable came so near to going slack that the trial would be about that."""
    least = float(run.tension_h_N.min())
    if joint.true.circuit == "closed":
        least = min(least, float(run.tension_l_N.min()))
    return least < _TAUT * joint.stage.pretension_N
