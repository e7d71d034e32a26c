"""The compensator: one sample and one reference in, one motor command out.

Position mode: motor target `q_in = (q_ref - deflection(expected load)) / N`, N = product of r/R; rigid drive:
q_out = N q_in; the motor holds the joint's load with the torque -N M. Force mode: the motor goes where the
drive, between the measured joint position and the motor, carries the load wanted: `q_in = (q_out -
deflection(wanted load)) / N`.
"""

from __future__ import annotations

from math import inf, isfinite, tanh
from typing import NamedTuple, Protocol

from cablecomp.config import JointConfig
from cablecomp.control.command import FULL, Command, Feed, Reference
from cablecomp.control.options import CompensatorOptions, ControlMode, FeedForward, MotorModel
from cablecomp.control.shaping import BumplessTransfer, LeadFilter, Slope
from cablecomp.control.torque_sensor import TorqueSensor
from cablecomp.errors import InputError
from cablecomp.signals import NAN, Estimate, Sample

_APPROACH = 0.1
"""Share of the motor's greatest speed at which a target that is far away, as where a run begins, is gone to."""


class ObserverLike(Protocol):
    """What the compensator needs of an observer."""

    def step(self, sample: Sample) -> Estimate:
        """Take a sample in."""

    def peek_deflection(self, time_s: float, motor_position_rad: float, joint_torque_Nm: float) -> float:
        """Say what the deflection would be, commit nothing."""

    def step_ahead(
        self, sample: Sample, time_s: float, motor_position_rad: float, joint_torque_Nm: float
    ) -> tuple[Estimate, float]:
        """Take a sample in, and say what the deflection would be (NaN where it has to be asked for by itself)."""

    def step_inverse(self, sample: Sample) -> Estimate:
        """Take a sample in, the load being found from both encoders."""


class Gains(NamedTuple):
    """Gains and filters in use, all known numbers (rad, Nm, s, Hz)."""

    load_filter_Hz: float
    load_lead_s: float
    follow_filter_Hz: float
    follow_lead_s: float
    joint_feedback_per_s: float
    force_feedback_per_s: float
    motor_integral_per_s: float


DEFAULT_GAINS = Gains(10.0, 0.0, 10.0, 0.0, 0.0, 2.0, 10.0)
"""Slow and safe for a stiff, light joint; `design_loop` gives the joint's own."""


def gains_of(options: CompensatorOptions, designed: Gains = DEFAULT_GAINS) -> Gains:
    """The options' own gains; those left open are taken from `designed`."""
    return Gains(
        *(d if (own := getattr(options, name)) is None else own for name, d in designed._asdict().items())
    )


def given_gains(options: CompensatorOptions) -> Gains | None:
    """The options' own gains, if they state all of them: nothing is left to be designed."""
    found = [getattr(options, name) for name in Gains._fields]
    return None if any(value is None for value in found) else Gains(*found)


def _force_limit_Nm(config: JointConfig, options: CompensatorOptions) -> float:
    """By how much torque feedback may change what is wanted: without contact it finds no torque however far it goes."""
    stated = options.force_feedback_limit_Nm or config.limits.joint_torque_max_Nm
    return stated or config.drive.stage[-1].pretension_moment_Nm


class Compensator:
    """Controls one joint; the state is in the open attributes, time comes with the sample.

    `step` takes the sample of now and the reference of the next instant (one period on). NaN in
    `sample.joint_position_rad` = no joint encoder: feedback then rests. After `enable`, `disable` or a change
    of mode the target runs on without a step and blends over within `blend_s`. `observed`: whether the last
    sample went into the observer.
    """

    def __init__(
        self,
        config: JointConfig,
        options: CompensatorOptions,
        period_s: float,
        observer: ObserverLike,
        *,
        gains: Gains = DEFAULT_GAINS,
        motor: MotorModel | None = None,
    ) -> None:
        if not 0.0 < period_s < inf:
            raise InputError(f"period_s is {period_s}; a time above 0 is accepted")
        self.options = options
        self.gains = gains_of(options, gains)
        self.observer = observer
        self.ratio = config.drive.ratio
        self.preload_Nm = config.drive.preload_Nm
        self.motor_zero_Nm = config.motor_zero_Nm
        self.joint_zero_rad = config.sensors.joint_position_offset_rad
        sensors = config.sensors
        self.sensor = TorqueSensor(sensors.joint_torque_gain, sensors.joint_torque_offset_Nm)
        self.period_s = period_s
        self.active = options.feed_forward is not FeedForward.NONE
        self.load = LeadFilter(self.gains.load_filter_Hz, self.gains.load_lead_s, period_s)
        self.transfer = BumplessTransfer(
            options.blend_s, period_s, _APPROACH * (config.limits.motor_velocity_max_rad_s or 20.0)
        )
        self.deflection_slope = Slope(options.velocity_filter_Hz, period_s)
        self.follow = LeadFilter(self.gains.follow_filter_Hz, self.gains.follow_lead_s, period_s)
        self.motor_trim_rad = 0.0
        self.joint_trim_rad = 0.0
        self.force_trim_Nm = 0.0
        self.deflection_used_rad = 0.0
        self.target_rad = NAN
        self.estimate: Estimate | None = None
        self.observed = True
        self._motor = MotorModel() if motor is None else motor
        self._reference: Reference | None = None
        self._switch = True
        self._velocity = 0.0
        self._motor_share = self.gains.motor_integral_per_s * period_s
        self._motor_limit = options.motor_integral_limit_rad
        self._force_limit = _force_limit_Nm(config, options)
        self._linear = options.linear_stiffness_Nm_per_rad
        self._from_sensor = options.load != "reference"
        self._goes_to_position = options.mode is ControlMode.POSITION
        self._asks_for_motion = options.mode is not ControlMode.FORCE
        self._by_encoders = config.observer.load == "both_encoders" or (
            not self._goes_to_position and options.torque_from == "encoders"
        )
        self._looks_ahead = options.feed_forward is not FeedForward.LINEAR

    def enable(self) -> None:
        """Let feed-forward act from the next step on, without a step in the target."""
        self._switch = self._switch or not self.active
        self.active = True

    def disable(self) -> None:
        """Let feed-forward rest from the next step on, without a step in the target."""
        self._switch = self._switch or self.active
        self.active = False

    def reset(self) -> None:
        """Start control anew where the motor stands; the observer keeps its history."""
        self.load.reset()
        self.deflection_slope.reset()
        self.follow.reset()
        self.motor_trim_rad = self.joint_trim_rad = self.force_trim_Nm = 0.0
        self.target_rad, self._velocity, self._reference, self._switch = NAN, 0.0, None, True

    def step(
        self, sample: Sample, reference: Reference, feed: Feed = FULL, *, joint_ok: bool = True
    ) -> Command:
        """One period; returns the motor command (rad, rad/s, Nm at the input pulley) and the observer's view.

        `joint_ok` False: the joint encoder's value is not to be trusted, feedback on it rests. Raises SampleRefused,
        and InputError for a reference whose motion is not finite; neither leaves a trace.
        """
        self.observed = False
        r = reference
        motion = r.joint_position_rad + r.joint_velocity_rad_s + r.joint_acceleration_rad_s2
        if self._asks_for_motion and not isfinite(motion):
            raise InputError(f"reference: finite position, velocity and acceleration are accepted, not {r}")
        if self._goes_to_position:
            return self._position(sample, reference, feed, joint_ok)
        before = self.estimate
        if before is not None and self._must_not_compare(feed):
            return self._force(sample, reference, feed, before)
        estimate = self._known_torque(sample)
        self.estimate, self.observed = estimate, True
        return self._force(sample, reference, feed, estimate)

    # ---- position mode ---------------------------------------------------------------------------

    def _position(self, sample: Sample, reference: Reference, feed: Feed, joint_ok: bool) -> Command:
        load, ahead = self._observe(sample, reference, feed)
        estimate = self.estimate
        assert estimate is not None
        if not feed.held:
            self.deflection_used_rad = ahead if ahead == ahead else self._deflection(sample, reference, load)
        used = feed.weight * self.deflection_used_rad if self.active else 0.0
        if self._switch:
            self.deflection_slope.jump(used)
        n, now = self.ratio, self._reference
        if joint_ok and now is not None and self.gains.joint_feedback_per_s > 0.0 and not feed.held:
            self._joint_feedback(now.joint_position_rad - (sample.joint_position_rad - self.joint_zero_rad))
        wanted = (reference.joint_position_rad - used + self.joint_trim_rad) / n
        velocity = (reference.joint_velocity_rad_s - self.deflection_slope.step(used)) / n
        torque = self._torque(velocity, reference.joint_acceleration_rad_s2 / n, self.sensor.load(load))
        return self._command(sample, reference, wanted, velocity, torque, used, estimate)

    def _observe(self, sample: Sample, reference: Reference, feed: Feed) -> tuple[float, float]:
        """Take the sample in; returns the load expected next and, where the same call of the observer gives it, the
        deflection under it (else NaN)."""
        measured = sample.joint_torque_Nm
        if self.estimate is not None and self._must_not_compare(feed):
            return self._expected_load(self.estimate.joint_torque_Nm, reference), NAN
        if not self._looks_ahead or measured != measured or feed.held:
            self.estimate, self.observed = self.observer.step(sample), True
            known = self.estimate.joint_torque_Nm
            return self._expected_load(measured if measured == measured else known, reference), NAN
        before = self.load.state
        load = self._expected_load(measured, reference)
        motor = sample.motor_position_rad + self._velocity * self.period_s
        try:
            self.estimate, ahead = self.observer.step_ahead(
                sample, sample.time_s + self.period_s, motor, load
            )
        except InputError:
            self.load.state = before  # what is refused leaves no trace
            raise
        self.observed = True
        return load, ahead

    def _must_not_compare(self, feed: Feed) -> bool:
        """Whether old readings of one encoder against new ones of the other would be taken for a load: better none."""
        return feed.held and self._by_encoders

    def _expected_load(self, measured_Nm: float, reference: Reference) -> float:
        """Load of the next instant as a sensor reads it; `measured_Nm`: the sensor's, or where there is none the
        observer's."""
        stated = reference.joint_torque_Nm
        if not self._from_sensor:
            return self.sensor.reading(stated if isfinite(stated) else 0.0)
        if self.options.load == "sensor" or not isfinite(stated):
            return self.load.step(measured_Nm)
        before = self._reference
        expected_now = stated if before is None else before.joint_torque_Nm
        if not isfinite(expected_now):
            expected_now = stated
        return self.sensor.reading(stated) + self.load.step(measured_Nm - self.sensor.reading(expected_now))

    def _deflection(self, sample: Sample, reference: Reference, load: float) -> float:
        if self._linear is not None and self.options.feed_forward is FeedForward.LINEAR:
            return self.sensor.load(load) / self._linear
        period = self.period_s
        motor = sample.motor_position_rad + self._velocity * period
        return self.observer.peek_deflection(sample.time_s + period, motor, load)

    def _joint_feedback(self, error: float) -> None:
        if error == error:
            limit = self.options.joint_feedback_limit_rad
            trim = self.joint_trim_rad + self.gains.joint_feedback_per_s * self.period_s * error
            self.joint_trim_rad = min(max(trim, -limit), limit)

    # ---- force and impedance mode ----------------------------------------------------------------

    def _known_torque(self, sample: Sample) -> Estimate:
        source = self.options.torque_from
        if source == "encoders":
            return self.observer.step_inverse(sample)
        if source == "motor_torque":
            load_Nm = -(sample.motor_torque_Nm - self.motor_zero_Nm) / self.ratio
            sample = sample._replace(joint_torque_Nm=self.sensor.reading(load_Nm))
        return self.observer.step(sample)

    def _force(self, sample: Sample, reference: Reference, feed: Feed, estimate: Estimate) -> Command:
        measured = sample.joint_position_rad - self.joint_zero_rad
        joint = measured if isfinite(measured) else estimate.joint_position_rad
        followed = self.follow.step(joint)
        joint_velocity = self.follow.rate
        wanted_Nm = self._wanted_torque(reference, joint, joint_velocity)
        if not feed.held:
            if self.active:  # else nothing of it would reach the motor
                self._force_feedback(wanted_Nm - self.sensor.load(estimate.joint_torque_Nm))
            asked = self.sensor.reading(wanted_Nm + self.force_trim_Nm)
            self.deflection_used_rad = self._deflection(sample, reference, asked)
        used = feed.weight * self.deflection_used_rad if self.active else 0.0
        if self._switch:
            self.deflection_slope.jump(used)
        wanted = (followed - used) / self.ratio
        velocity = (joint_velocity - self.deflection_slope.step(used)) / self.ratio
        torque = self._torque(velocity, 0.0, wanted_Nm)
        return self._command(sample, reference, wanted, velocity, torque, used, estimate)

    def _wanted_torque(self, reference: Reference, joint: float, velocity: float) -> float:
        base = reference.joint_torque_Nm if isfinite(reference.joint_torque_Nm) else 0.0
        if self.options.mode is ControlMode.FORCE:
            return base
        o = self.options
        pull = o.impedance_stiffness_Nm_per_rad * (reference.joint_position_rad - joint)
        return base - pull - o.impedance_damping_Nms_per_rad * (reference.joint_velocity_rad_s - velocity)

    def _force_feedback(self, error_Nm: float) -> None:
        if error_Nm == error_Nm:
            limit = self._force_limit
            trim = self.force_trim_Nm + self.gains.force_feedback_per_s * self.period_s * error_Nm
            self.force_trim_Nm = min(max(trim, -limit), limit)

    # ---- common ----------------------------------------------------------------------------------

    def _torque(self, velocity: float, acceleration: float, load: float) -> float:
        m = self._motor
        friction = m.viscous_Nms_per_rad * velocity
        if m.coulomb_Nm > 0.0:
            friction += m.coulomb_Nm * tanh(velocity / self.options.coulomb_velocity_rad_s)
        return m.inertia_kgm2 * acceleration + friction - self.ratio * load - self.preload_Nm

    def _command(
        self,
        sample: Sample,
        reference: Reference,
        wanted: float,
        velocity: float,
        torque: float,
        used: float,
        estimate: Estimate,
    ) -> Command:
        if self._switch:
            self._begin(sample, wanted)
        else:
            limit = self._motor_limit
            error = self.target_rad - sample.motor_position_rad
            trim = self.motor_trim_rad + self._motor_share * error
            self.motor_trim_rad = limit if trim > limit else -limit if trim < -limit else trim
        target = wanted + self.transfer.step()
        self._velocity = velocity + self.transfer.slope
        self.target_rad = target
        self._reference = reference
        e = estimate
        return Command(
            target + self.motor_trim_rad,
            self._velocity,
            torque,
            used,
            e.deflection_rad,
            e.deflection_low_rad,
            e.deflection_high_rad,
            e.joint_position_rad,
            e.joint_torque_Nm,
            e.tension_h_N,
            e.tension_l_N,
        )

    def _begin(self, sample: Sample, wanted: float) -> None:
        before = self.target_rad
        if before != before:
            before = sample.motor_position_rad
        self.transfer.start(before + self._velocity * self.period_s - wanted)
        self._switch = False
