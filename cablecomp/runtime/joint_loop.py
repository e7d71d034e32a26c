"""One joint's cycle: readings in, judged, observed, compensated, gated, sent, recorded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isfinite, nan
from pathlib import Path
from time import perf_counter

from cablecomp.config import JointConfig
from cablecomp.control.command import FULL, Command, Feed, Reference
from cablecomp.control.compensator import Compensator
from cablecomp.control.degrade import NORMAL, DegradeState, DegradeTimes, Phase, degrade, feed_of
from cablecomp.control.gate import MUST_STOP, GateLimits, SafeCommand, gate, gate_names
from cablecomp.errors import InputError
from cablecomp.links.link import Link
from cablecomp.links.records import CHANNELS, NOT_TAKEN, DriveState, Mode, MotorCommand
from cablecomp.runtime.folder import SNAPSHOT
from cablecomp.runtime.health import Checked, Health, health_names
from cablecomp.runtime.keeper import Keeper
from cablecomp.runtime.log import EventLog, JointLog
from cablecomp.runtime.taking_up import TakingUp
from cablecomp.runtime.tally import JointTally, View
from cablecomp.signals import Estimate

References = Callable[[float], Reference]
"""What is wanted of a joint at a time (s since the run was armed)."""


ROWS_EVERY_S = 0.1
"""Of the loop's own time, between two times that rows are handed over: what a process that is killed loses of them."""
_NOTHING_NEW = Feed(0.0, True)
_ENABLED = DriveState.ENABLED  # looked up in its class anew it would take ten times as long
_NONE_YET = Command(nan, nan, nan)


@dataclass(frozen=True)
class JointSetup:
    """All that is needed to run one joint: its place on the link, configuration, controller, health, limits,
    reference."""

    place: int
    name: str
    config: JointConfig
    compensator: Compensator
    health: Health
    limits: GateLimits
    times: DegradeTimes
    reference: References


class JointLoop:
    """Runs one joint on one link, cycle by cycle; `stop_reason` says why it wants the run stopped ("" = it
    does not). A cycle under control is `look`, `decide`, `act`, `note`.
    """

    def __init__(self, setup: JointSetup, link: Link, folder: Path | None, events: EventLog) -> None:
        self.setup = setup
        self.readings = link.joints[setup.place]
        self.degraded: DegradeState = NORMAL
        self.stop_reason = ""
        self.step_s = nan
        self.tally = JointTally()
        self.log: JointLog | None = None
        self._keeper: Keeper | None = None
        self.checked: Checked | None = None
        self._link = link
        self._folder = folder
        self._events = events
        self._command = _NONE_YET
        self._sent = SafeCommand(nan, 0.0, 0.0, 0)
        self._predicted = nan
        self._flags = 0
        self._gate_flags = 0
        self._refused = False
        self._untaken_s = nan
        self._rows_due_s = -inf
        self._period_s = setup.compensator.period_s
        self._fresh_s = setup.times.fresh_s
        self._offset = setup.config.sensors.joint_position_offset_rad
        self._reference = self._last_reference = setup.reference(0.0)
        preload = setup.compensator.preload_Nm
        self.taking_up = TakingUp(
            link, setup.place, setup.limits, setup.times.fresh_s, preload, self._period_s
        )

    @property
    def view(self) -> View | None:
        """The last cycle, for the eye; None before the first one."""
        estimate, checked = self.setup.compensator.estimate, self.checked
        if estimate is None or checked is None:
            return None
        name, phase, sample = self.setup.name, self.degraded.phase, checked.sample
        return View(
            name, sample.time_s, phase, sample, estimate, self._command, self._reference, checked.flags
        )

    @property
    def enabled(self) -> bool:
        """Whether the drive says that it is enabled."""
        return self.readings.state is DriveState.ENABLED

    @property
    def drive_words(self) -> str:
        """State and error of the drive, in words."""
        readings = self.readings
        error = f"error {readings.error:#x}" if readings.error else ""
        words = ", ".join(filter(None, (error, self._link.error_text(self.setup.place))))
        return readings.state.name.lower() + (f" ({words})" if words else "")

    def listen(self, now_s: float) -> None:
        """Before anything is commanded: judge what comes, until the drive is known."""
        self.checked = self.setup.health.check(self.readings, now_s)
        self.taking_up.listen(self.readings, self.checked, now_s)

    def first(self, now_s: float) -> None:
        """The first command: where the motor is, without force."""
        assert self.checked is not None
        self._send(self.taking_up.first(self.checked.sample.motor_position_rad), now_s)

    def enable(self, now_s: float, mode: Mode) -> None:
        """While the drive is taken up: observe and record, and let it take hold where it is, against the
        pretension of an open circuit."""
        checked = self._check(now_s, nan)
        self._observe(checked, now_s, None)
        self._judge(checked, now_s, drive=False)
        if not self.stop_reason:
            if isfinite(self._sent.motor_position_rad):
                motor = checked.sample.motor_position_rad
                wish = self.taking_up.step(self._sent, motor, self.enabled, mode, now_s)
                self._send_gated(wish, checked, now_s)
            else:
                self.first(now_s)  # the bus has not taken it yet: nothing else goes out before
        self._finish(None)

    def begin(self) -> None:
        """Control starts from where the motor is held."""
        compensator = self.setup.compensator
        compensator.reset()
        compensator.target_rad = self._sent.motor_position_rad

    def look(self, now_s: float) -> None:
        """Under control: judge what has come."""
        self._judge(self._check(now_s, self._sent.motor_position_rad), now_s)

    def decide(self, now_s: float, since_s: float) -> None:
        """Under control: observe, and find the next command; `since_s` = time since control began."""
        assert self.checked is not None
        self._observe(self.checked, now_s, since_s)

    def act(self, now_s: float) -> None:
        """Under control: send the command, unless the joint wants the run stopped."""
        if not self.stop_reason:
            assert self.checked is not None
            self._send_gated(self._command, self.checked, now_s)

    def note(self, since_s: float) -> None:
        """Under control: count and record."""
        self._finish(since_s)

    def stand(self, now_s: float) -> None:
        """After the stop: observe and record what has come, command nothing."""
        if self.checked is not None and self.checked.ready and not self._refused:
            self._observe(self._check(now_s, nan), now_s, None, report=False)
            self._finish(None)

    def keep(self, now_s: float) -> None:
        """In idle time: hand what has been recorded and the observer's state to those who write it."""
        if self._keeper is None or self.log is None:
            return
        if now_s >= self._rows_due_s:
            self._rows_due_s = now_s + ROWS_EVERY_S
            self.log.flush()
        if self._keeper.due:
            self._keep(self._keeper)

    @property
    def failure(self) -> str:
        """Why something of this joint is not on disk ("" = it is)."""
        if self.log is None:
            return ""
        return self.log.failure or ("" if self._keeper is None else self._keeper.failure)

    def close(self) -> list[str]:
        """Keep the observer's state, finish the logs; returns why something of it is incomplete."""
        found: list[str] = []
        if self._keeper is not None:
            self._keep(self._keeper)
            self._keeper.close()
            found += [self._keeper.failure] if self._keeper.failure else []
            self._keeper = None
        if self.log is not None:
            found += self.log.close()
        return found

    def _keep(self, keeper: Keeper) -> None:
        snapshot = getattr(self.setup.compensator.observer, "snapshot", None)
        if snapshot is not None and self.log is not None:
            keeper.offer(snapshot())

    # ---- inside ----------------------------------------------------------------------------------

    def _send(self, safe: SafeCommand, now_s: float) -> None:
        """Send it; what the bus does not take has not been sent, and a bus that takes none for as long as a motor's
        reading may be old ends the run."""
        command = MotorCommand(safe.motor_position_rad, safe.motor_velocity_rad_s, safe.motor_torque_Nm)
        if not self._link.send(self.setup.place, command) & NOT_TAKEN:
            self._sent, self._untaken_s = safe, nan
        elif self._untaken_s != self._untaken_s:
            self._untaken_s = now_s
        elif now_s - self._untaken_s > self.setup.limits.age_s:
            self.stop_reason = self.stop_reason or "the bus takes no commands"

    def _check(self, now_s: float, target_rad: float) -> Checked:
        predicted = self._predicted + self._offset
        checked = self.setup.health.check(self.readings, now_s, predicted, target_rad)
        self.checked = checked
        return checked

    def _observe(self, checked: Checked, now_s: float, since_s: float | None, *, report: bool = True) -> None:
        """Take in what has come, and find what the compensator asks for. `report`: what is wrong with it is an event,
        which the silence of a drive that was stopped is not. A sample that the observer refuses
        ends the run: replay would refuse it as well. So does one that it takes where the next one, as expected, is
        beyond what the joint can take.
        """
        s = self.setup
        reference = s.reference(self._period_s + (0.0 if since_s is None else since_s))
        begin = perf_counter()
        feed = FULL if self.degraded is NORMAL else feed_of(self.degraded)
        if since_s is None and max(checked.motor_age_s, checked.load_age_s) > self._fresh_s:
            feed = _NOTHING_NEW
        compensator = s.compensator
        try:
            command = compensator.step(checked.sample, reference, feed, joint_ok=checked.joint_ok)
        except InputError as error:
            self._refused = True
            what = "would come next" if compensator.observed else "came"
            self.stop_reason = self.stop_reason or f"the observer refuses what {what}: {error}"
            command = _NONE_YET
        self.step_s = perf_counter() - begin
        self._command, self._reference = command, reference
        estimate = compensator.estimate
        if estimate is not None:
            self._predicted = estimate.joint_position_rad
        if report and checked.flags != self._flags:
            self._note(checked.flags, now_s)

    def _finish(self, since_s: float | None) -> None:
        """Count and record the cycle, once its command has gone out."""
        estimate, checked = self.setup.compensator.estimate, self.checked
        if estimate is None or checked is None:
            return
        sample = checked.sample
        self.tally.phases[self.degraded.phase] += 1
        if since_s is not None and not self._refused:
            torque = self.setup.compensator.sensor.load(estimate.joint_torque_Nm)
            self.tally.add(self._last_reference, sample.joint_position_rad - self._offset, torque, estimate)
        if self._folder is not None and self.setup.compensator.observed:
            self._record(self._folder, estimate, checked, since_s is not None)
        self._last_reference = self._reference

    def _judge(self, checked: Checked, now_s: float, *, drive: bool = True) -> None:
        fresh = self._fresh_s
        if (
            self.degraded is NORMAL
            and checked.motor_age_s <= fresh
            and checked.load_age_s <= fresh
            and not checked.fatal
            and (self.readings.state is _ENABLED or not drive)
        ):
            return  # nearly always: nothing is amiss
        s, before = self.setup, self.degraded.phase
        ages = checked.motor_age_s, checked.load_age_s
        self.degraded = degrade(self.degraded, self._period_s, *ages, s.times)
        phase = self.degraded.phase
        if phase is not before:
            self._events.add(now_s, s.name, f"{before.name.lower()} -> {phase.name.lower()}")
        if phase is Phase.STOPPED:
            words = ", ".join(health_names(checked.flags)) or "data too old"
            self.stop_reason = self.stop_reason or words
        elif checked.fatal:
            self.stop_reason = self.stop_reason or ", ".join(health_names(checked.flags))
        elif drive and self.readings.state is not _ENABLED:
            self.stop_reason = self.stop_reason or f"drive reports {self.drive_words}"

    def _send_gated(self, command: Command, checked: Checked, now_s: float) -> None:
        """Through the gate, and out."""
        s = self.setup
        position = checked.sample.motor_position_rad
        safe = gate(command, self._sent, position, checked.motor_age_s, self._period_s, s.limits)
        flags = safe.flags
        if flags & ~self._gate_flags:
            words = ", ".join(gate_names(flags & ~self._gate_flags))
            self._events.add(now_s, s.name, f"gate: {words}")
        self._gate_flags = flags
        if flags & MUST_STOP:
            self.stop_reason = self.stop_reason or f"gate: {', '.join(gate_names(flags & MUST_STOP))}"
        else:
            self._send(safe, now_s)

    def _note(self, flags: int, now_s: float) -> None:
        fresh, gone = flags & ~self._flags, self._flags & ~flags
        self._flags = flags
        if fresh:
            self._events.add(now_s, self.setup.name, ", ".join(health_names(fresh)))
        if gone:
            self._events.add(now_s, self.setup.name, "over: " + ", ".join(health_names(gone)))

    def _record(self, folder: Path, estimate: Estimate, checked: Checked, controlled: bool) -> None:
        sample, command = checked.sample, self._command
        if self.log is None:
            self.log = JointLog(folder, sample, self.readings.others)
            self._keeper = Keeper(folder / SNAPSHOT)
        sent, state, wanted = self._sent, self.degraded, self._last_reference
        self.log.append(
            sample,
            estimate,
            self._offset,
            self.readings.values[len(CHANNELS) :],
            (
                sample.time_s,
                controlled,
                state.phase,
                state.weight,
                checked.flags,
                sent.flags,
                wanted.joint_position_rad,
                wanted.joint_torque_Nm,
                sent.motor_position_rad,
                sent.motor_velocity_rad_s,
                sent.motor_torque_Nm,
                command.deflection_ahead_rad,
                command.joint_torque_Nm,
                min(checked.motor_age_s, 1e9),
                min(checked.load_age_s, 1e9),
                self.step_s,
            ),
        )
