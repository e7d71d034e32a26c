"""Whether what came from the wire can be true: every channel against its own past, and channels against
each other.
"""

from __future__ import annotations

from math import expm1, inf, isnan, nan, tau
from typing import Final, NamedTuple

from cablecomp.control.options import HealthOptions
from cablecomp.links.readings import JointReadings
from cablecomp.links.records import JOINT_POSITION, JOINT_TORQUE, MOTOR_POSITION, MOTOR_TORQUE, TEMPERATURE
from cablecomp.runtime.channel import Channel, Latency, Seldom, Shaking, Sustained
from cablecomp.signals import Sample

(
    MOTOR_STALE,
    TORQUE_STALE,
    JOINT_STALE,
    MOTOR_JUMP,
    TORQUE_JUMP,
    JOINT_JUMP,
    TORQUE_SATURATED,
    JOINT_RESIDUAL,
    TORQUE_MISMATCH,
    MOTOR_LAGS,
    UNANSWERED,
    LATE,
    SHAKES,
    MOTOR_STUCK,
    JOINT_STUCK,
    ENCODERS_DISAGREE,
    TEMPERATURE_UNTRUE,
    OTHER_UNTRUE,
    TEMPERATURE_STALE,
    OTHER_STALE,
    MOTOR_TORQUE_STALE,
) = (1 << bit for bit in range(21))
FATAL: Final = MOTOR_LAGS | MOTOR_STUCK | ENCODERS_DISAGREE

_WORDS: Final = (
    "motor position is stale",
    "joint torque is stale",
    "joint position is stale",
    "motor encoder jumped",
    "joint torque jumped",
    "joint encoder jumped",
    "torque sensor is at its limit",
    "joint encoder disagrees with the model",
    "torque sensor disagrees with motor torque",
    "motor does not follow",
    "drive does not answer",
    "sensor data come late",
    "load shakes",
    "motor encoder is stuck",
    "joint encoder is stuck",
    "encoders disagree",
    "temperature cannot be true",
    "a further channel cannot be true",
    "temperature is stale",
    "a further channel is stale",
    "motor torque is stale",
)
_FAR = 5.0  # times the joint residual's limit: no joint moves there in a few samples
_FAR_S = 0.003
_FAR_PERIODS = 2.5  # at least: of a slow loop two samples would be enough
_SAME = 3  # readings that repeat the one before: fewer come from a drive that stood still itself
_STILL_S = 0.008
_STILL_PERIODS = 7.5
_COLDEST_DEGC, _HOTTEST_DEGC = -60.0, 200.0
"""What a thermometer at a joint can read: a little more than the widest grade of electronics (-55 degC) and the hottest
class of winding insulation in use (H, 180 degC) bear."""
_TEMPERATURE_FLOOR_K, _ANGLE_FLOOR_RAD, _TORQUE_FLOOR_Nm = 5.0, 0.05, 0.5
"""Steps that pass however soon a reading comes after the one before: resolution and noise of a coarse sensor."""


def health_names(flags: int) -> tuple[str, ...]:
    """Words for the flags of a check."""
    return tuple(word for bit, word in enumerate(_WORDS) if flags >> bit & 1)


class Checked(NamedTuple):
    """What a check gives: the sample for the observer, ages in s, what is wrong, and whether control
    may live on it.

    `sample` holds the last plausible values, `ready` that all needed ones have come at least once;
    `joint_ok` = the joint encoder may be used for feedback; `fatal` = stop now.
    """

    sample: Sample
    motor_age_s: float
    load_age_s: float
    flags: int
    ready: bool
    joint_ok: bool
    fatal: bool


class Health:
    """Watches one joint. `needs_torque`, `needs_joint`, `needs_motor_torque`: channels that the feed-forward lives on;
    `others`: places of the further channels that the observer reads, in its order; `preload_Nm`: by which an
    open circuit's pretension pulls at the motor; `motor_step_rad`: what the drive rounds its position to, so that a
    motor that moves by less shows no change.

    Motor position, joint torque, joint position are held at their last plausible value. So are temperature and
    `others`: what is turned down of them is put back in the readings too, so that what is recorded is what the observer
    saw. Further channels are judged by the unit in their name; of one without, only that it is finite.
    `needs_temperature`: an effect reads it. What effects read has to have come before a joint is ready, and counts as
    old once it stays out (`Seldom`). All else passes as it came.
    """

    def __init__(
        self,
        options: HealthOptions,
        ratio: float,
        fresh_s: float,
        period_s: float,
        *,
        needs_torque: bool = True,
        needs_joint: bool = False,
        needs_motor_torque: bool = False,
        needs_temperature: bool = False,
        others: tuple[int, ...] = (),
        preload_Nm: float = 0.0,
        motor_step_rad: float = 0.0,
    ) -> None:
        o = options
        limit = inf if o.torque_max_Nm is None else o.torque_max_Nm
        self.motor = Channel(o.motor_rate_rad_s, 0.002 + motor_step_rad, fresh_s)
        self.joint = Channel(o.joint_rate_rad_s, 0.002, fresh_s)
        self.torque = Channel(o.torque_rate_Nm_s, 0.05, fresh_s, limit)
        self._channels = (
            (self.motor, MOTOR_POSITION, MOTOR_JUMP),
            (self.torque, JOINT_TORQUE, TORQUE_JUMP),
            (self.joint, JOINT_POSITION, JOINT_JUMP),
        )
        self.latency = Latency()
        self.shaking = Shaking(period_s)
        self._o = o
        self._most_Nm = limit
        self._ratio = ratio
        self._preload_Nm = preload_Nm
        self._fresh_s = fresh_s
        self._needs_torque = needs_torque
        self._needs_joint = needs_joint
        self._needs_motor_torque = needs_motor_torque
        self._others = others
        self._needs_temperature = needs_temperature
        self._further: list[tuple[Seldom, int, int]] = []
        self._needed: list[tuple[Seldom, int]] = []
        self._unanswered = o.unanswered
        self._lead_rad = inf if o.lead_rad is None else o.lead_rad
        self._stuck_rad = inf if o.stuck_rad is None else o.stuck_rad + 2.0 * motor_step_rad
        self._mismatch_Nm = inf if o.torque_mismatch_Nm is None else o.torque_mismatch_Nm
        self._residual = Sustained(o.confirm_s)
        self._far = Sustained(max(_FAR_S, _FAR_PERIODS * period_s))
        self._still_s = max(_STILL_S, _STILL_PERIODS * period_s)
        self._mismatch = Sustained(o.confirm_s)
        self._lags = Sustained(o.confirm_s)
        self._shakes = Sustained(0.2 * o.confirm_s)
        self._mean_mismatch = 0.0
        self._share = -expm1(-period_s / o.confirm_s)
        self._shake_square = inf if o.shake_Nm is None else o.shake_Nm**2
        self._motor_changed_s = nan
        self._motor_heard_s = inf
        self._motor_same = 0
        self._target_then = nan
        self._stuck_since_s = nan

    def check(
        self, readings: JointReadings, now_s: float, predicted_rad: float = nan, target_rad: float = nan
    ) -> Checked:
        """One cycle. `predicted_rad`: joint position that the observer said last; `target_rad`: motor
        target sent last.
        """
        values = readings.values
        flags = self._take(readings)
        motor, torque, joint, fresh = self.motor, self.torque, self.joint, self._fresh_s
        stamp = readings.device_s[JOINT_TORQUE]
        late = self.latency.take(readings.arrived_s[JOINT_TORQUE], stamp) if not isnan(stamp) else 0.0
        motor_age = now_s - motor.arrived_s
        torque_age = now_s - torque.arrived_s + late
        joint_age = now_s - joint.arrived_s + late
        has_joint, has_torque = not isnan(joint.value), not isnan(torque.value)
        if motor_age > fresh:
            flags |= MOTOR_STALE
        if has_torque and torque_age > fresh:
            flags |= LATE if late > fresh else TORQUE_STALE
        if has_joint and joint_age > fresh:
            flags |= LATE if late > fresh else JOINT_STALE
        if readings.unanswered > self._unanswered:
            flags |= UNANSWERED
        flags |= self._encoders(now_s, predicted_rad, target_rad)
        flags |= self._torques(values[MOTOR_TORQUE], now_s)
        load_age = 0.0
        if self._needs_torque:
            load_age = self._shakes.age_s
            if torque_age > load_age:
                load_age = torque_age
            if self._mismatch.age_s > load_age:
                load_age = self._mismatch.age_s
        if self._needs_joint:
            load_age = max(load_age, joint_age, self._residual.age_s)
        ready = (
            not isnan(motor.value)
            and (has_torque or not self._needs_torque)
            and (has_joint or not self._needs_joint)
        )
        for further, stale in self._needed:
            if not further.old_from_s > now_s:
                load_age = max(load_age, further.age_s(now_s))
                if not further.held:
                    flags |= stale
            if isnan(further.value):
                ready = False
        others = self._others
        sample = Sample(
            now_s,
            motor.value,
            torque.value,
            joint.value,
            values[MOTOR_TORQUE],
            values[TEMPERATURE],
            tuple([values[place] for place in others]) if others else (),
        )
        joint_ok = has_joint and joint_age <= fresh and not flags & (JOINT_RESIDUAL | JOINT_STUCK)
        return Checked(sample, motor_age, load_age, flags, ready, joint_ok, bool(flags & FATAL))

    def _take(self, readings: JointReadings) -> int:
        values, arrived, updates = readings.values, readings.arrived_s, readings.updates
        flags = 0
        for channel, place, jump in self._channels:
            n = updates[place]
            if n != channel.seen:
                channel.seen = n
                channel.take(values[place], arrived[place])
            if channel.suspect:
                flags |= jump
        if abs(values[JOINT_TORQUE]) >= self._most_Nm:
            flags |= TORQUE_SATURATED
        for further, place, untrue in self._further or self._name_further(readings):
            n = updates[place]
            if n != further.seen:
                further.seen = n
                if not further.take(values[place], arrived[place]):
                    further.hold(arrived[place])
                    values[place] = further.value
            if further.held:
                flags |= untrue
        return flags

    def _name_further(self, readings: JointReadings) -> list[tuple[Seldom, int, int]]:
        """Temperature and the further channels, whose names the readings know: where they lie, and their flags; which
        of them effects read."""
        names = readings.channels
        self._further += [(self._of_name(names[TEMPERATURE]), TEMPERATURE, TEMPERATURE_UNTRUE)]
        self._further += [(self._of_name(names[place]), place, OTHER_UNTRUE) for place in self._others]
        needed = self._further if self._needs_temperature else self._further[1:]
        self._needed += [
            (further, TEMPERATURE_STALE if untrue == TEMPERATURE_UNTRUE else OTHER_STALE)
            for further, _, untrue in needed
        ]
        if self._needs_motor_torque:  # a drive may tell it in a message of its own, and more seldom
            told = Seldom(inf, 0.0, self._fresh_s, self._o.confirm_s)
            self._further.append((told, MOTOR_TORQUE, MOTOR_TORQUE_STALE))
            self._needed.append((told, MOTOR_TORQUE_STALE))
        return self._further

    def _of_name(self, channel: str) -> Seldom:
        """What is plausible of a further channel, by the unit that its name ends in."""
        o, hold_s = self._o, self._fresh_s
        if channel.endswith("_degC"):
            limits = _HOTTEST_DEGC, _COLDEST_DEGC
            return Seldom(o.temperature_rate_K_s, _TEMPERATURE_FLOOR_K, hold_s, o.confirm_s, *limits)
        rates = {
            "_rad": (o.joint_rate_rad_s, _ANGLE_FLOOR_RAD),
            "_Nm": (o.torque_rate_Nm_s, _TORQUE_FLOOR_Nm),
        }
        found = next((limit for unit, limit in rates.items() if channel.endswith(unit)), (inf, 0.0))
        turn = tau if channel.endswith("_rad") else inf
        return Seldom(*found, hold_s, o.confirm_s, turn=turn)

    def _encoders(self, now_s: float, predicted_rad: float, target_rad: float) -> int:
        flags, limit, motor = 0, self._o.joint_residual_rad, self.motor
        if limit is not None and not self.joint.suspect:
            residual = abs(self.joint.value - predicted_rad)
            off = residual > limit
            if (off or self._residual.begun) and self._residual.step(off, now_s):
                flags |= JOINT_RESIDUAL
            far = residual > _FAR * limit
            if (far or self._far.begun) and self._far.step(far, now_s):
                flags |= self._who_is_stuck(now_s)
        leads = abs(target_rad - motor.value) > self._lead_rad
        if (leads or self._lags.begun) and self._lags.step(leads, now_s):
            flags |= MOTOR_LAGS
        if motor.changed_s != self._motor_changed_s or self._target_then != self._target_then:
            self._motor_changed_s, self._target_then, self._motor_same = motor.changed_s, target_rad, 0
        elif motor.arrived_s > self._motor_heard_s:
            # a silent motor is stale, not stuck, and one that was held up may say the same again
            self._motor_same += 1
            if self._motor_same >= _SAME and abs(target_rad - self._target_then) > self._stuck_rad:
                flags |= MOTOR_STUCK
        self._motor_heard_s = motor.arrived_s
        return flags

    def _who_is_stuck(self, now_s: float) -> int:
        """Joint and prediction are far apart: the encoder whose reading does not change at all is the
        one that lies, and goes on lying until it does; a motor may rest where it turns back. A motor that says
        nothing is stale, not stuck.
        """
        if now_s - self.motor.arrived_s > self._fresh_s:
            return ENCODERS_DISAGREE
        motor_still = now_s - self.motor.changed_s > self._still_s
        joint_still = now_s - self.joint.changed_s > self._still_s
        if joint_still and not motor_still:
            self._stuck_since_s = self.joint.changed_s
        elif motor_still and not joint_still:
            return MOTOR_STUCK
        elif self.joint.changed_s != self._stuck_since_s:
            return ENCODERS_DISAGREE
        return JOINT_STUCK

    def _torques(self, motor_torque: float, now_s: float) -> int:
        flags, torque = 0, self.torque.value
        mismatch = torque + (motor_torque + self._preload_Nm) / self._ratio
        if not isnan(mismatch):
            self._mean_mismatch += self._share * (mismatch - self._mean_mismatch)
        off = not -self._mismatch_Nm <= self._mean_mismatch <= self._mismatch_Nm
        if (off or self._mismatch.begun) and self._mismatch.step(off, now_s):
            flags |= TORQUE_MISMATCH
        shakes = self.shaking.step(torque) > self._shake_square
        if (shakes or self._shakes.begun) and self._shakes.step(shakes, now_s):
            flags |= SHAKES
        return flags
