"""One joint's cycle: readings in, judged, observed, compensated, gated, sent, recorded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import nan
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

from cablecomp.config import JointConfig
from cablecomp.control.command import FULL, Command, Feed, Reference
from cablecomp.control.compensator import Compensator
from cablecomp.control.degrade import NORMAL, DegradeState, DegradeTimes, Phase, degrade, feed_of
from cablecomp.control.gate import MUST_STOP, GateLimits, SafeCommand, gate, gate_names
from cablecomp.links.link import Link
from cablecomp.links.records import CHANNELS, DriveState, MotorCommand, Request
from cablecomp.runtime.health import Checked, Health, health_names
from cablecomp.runtime.log import EventLog, JointLog
from cablecomp.signals import Estimate, Sample

References = Callable[[float], Reference]
"""What is wanted of a joint at a time (s since the run was armed)."""


_NOTHING_NEW = Feed(0.0, True)
_NOT_RUNNING = (DriveState.FAULT, DriveState.DISABLED)


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
    stiffness_Nm_per_rad: float | None = None
    damping_Nms_per_rad: float | None = None


class View(NamedTuple):
    """What the live view shows of a joint."""

    name: str
    time_s: float
    phase: Phase
    sample: Sample
    estimate: Estimate
    command: Command
    reference: Reference
    flags: int


@dataclass
class JointTally:
    """Sums over the run, of cycles under control: position error (measured and predicted) and torque error,
    squared."""

    cycles: int = 0
    position_square: float = 0.0
    position_count: int = 0
    torque_square: float = 0.0
    torque_count: int = 0
    residual_square: float = 0.0
    deflection_square: float = 0.0
    phases: list[int] = field(default_factory=lambda: [0] * len(Phase))

    def phases_by_name(self) -> dict[str, int]:
        """Cycles spent in each phase that came up."""
        return {phase.name.lower(): self.phases[phase] for phase in Phase if self.phases[phase]}


class JointLoop:
    """Runs one joint on one link, cycle by cycle; `stop_reason` says why it wants the run stopped ("" = it
    does not)."""

    def __init__(self, setup: JointSetup, link: Link, folder: Path | None, events: EventLog) -> None:
        self.setup = setup
        self.readings = link.joints[setup.place]
        self.degraded: DegradeState = NORMAL
        self.stop_reason = ""
        self.step_s = nan
        self.tally = JointTally()
        self.log: JointLog | None = None
        self.checked: Checked | None = None
        self._link = link
        self._folder = folder
        self._events = events
        self._seen: tuple[float, Sample, Estimate, Command, Reference, int] | None = None
        self._sent = SafeCommand(nan, 0.0, 0.0, 0)
        self._predicted = nan
        self._flags = 0
        self._gate_flags = 0
        self._period_s = setup.compensator.period_s
        self._offset = setup.config.sensors.joint_position_offset_rad
        self._last_reference = setup.reference(0.0)

    @property
    def view(self) -> View | None:
        """The last cycle, for the eye; None before the first one."""
        seen = self._seen
        if seen is None:
            return None
        now_s, sample, estimate, command, reference, flags = seen
        name, phase = self.setup.name, self.degraded.phase
        return View(name, now_s, phase, sample, estimate, command, reference, flags)

    @property
    def ready(self) -> bool:
        """Whether every channel that is needed has come."""
        return self.checked is not None and self.checked.ready

    @property
    def enabled(self) -> bool:
        """Whether the drive says that it is enabled."""
        return self.readings.state is DriveState.ENABLED

    def listen(self, now_s: float) -> None:
        """Before the drive is enabled: judge what came. A drive left enabled is disabled first; then it gets
        commands, without effect on a disabled drive, because many drives speak only when spoken to."""
        self.checked = self.setup.health.check(self.readings, now_s)
        if self.readings.sent == 0:
            self._link.request(self.setup.place, Request.DISABLE)
        self._send(SafeCommand(self._here(), 0.0, 0.0, 0))

    def hold(self, now_s: float) -> None:
        """While the drive is being enabled: observe and record, and ask it to stay where it is, against the
        pretension of an open circuit."""
        self._cycle(now_s, None)
        self._send(SafeCommand(self._here(), 0.0, -self.setup.compensator.preload_Nm, 0))

    def begin(self) -> None:
        """Control starts from where the motor is."""
        self.setup.compensator.reset()
        here = self._here()
        self._sent = SafeCommand(here, 0.0, -self.setup.compensator.preload_Nm, 0)

    def run(self, now_s: float, since_s: float) -> None:
        """One cycle under control; `since_s` = time since control began."""
        self._cycle(now_s, since_s)
        if not self.stop_reason:
            self._send(self._sent)

    def stand(self, now_s: float) -> None:
        """After the stop: observe and record what has come, command nothing."""
        if self.ready:
            self._cycle(now_s, None)

    def close(self) -> None:
        """Keep the observer's state, finish the logs."""
        save = getattr(self.setup.compensator.observer, "save", None)
        try:
            if save is not None and self._folder is not None and self.log is not None:
                save(self._folder / "observer.snapshot")
        finally:
            if self.log is not None:
                self.log.close()

    # ---- inside ----------------------------------------------------------------------------------

    def _here(self) -> float:
        checked = self.checked
        return 0.0 if checked is None or not checked.ready else checked.sample.motor_position_rad

    def _send(self, safe: SafeCommand) -> None:
        s = self.setup
        command = MotorCommand(
            safe.motor_position_rad,
            safe.motor_velocity_rad_s,
            safe.motor_torque_Nm,
            s.stiffness_Nm_per_rad,
            s.damping_Nms_per_rad,
        )
        self._link.send(s.place, command)

    def _cycle(self, now_s: float, since_s: float | None) -> None:
        s = self.setup
        target = self._sent.motor_position_rad if since_s is not None else nan
        checked = s.health.check(self.readings, now_s, self._predicted + self._offset, target)
        self.checked = checked
        period = self._period_s
        if since_s is not None:
            self._judge(checked, now_s, period)
        reference = s.reference(period + (0.0 if since_s is None else since_s))
        sample = checked.sample
        begin = perf_counter()
        feed = FULL if self.degraded is NORMAL else feed_of(self.degraded)
        if since_s is None and max(checked.motor_age_s, checked.load_age_s) > s.times.fresh_s:
            feed = _NOTHING_NEW
        command = s.compensator.step(sample, reference, feed, joint_ok=checked.joint_ok)
        self.step_s = perf_counter() - begin
        estimate = s.compensator.estimate
        assert estimate is not None
        self._predicted = estimate.joint_position_rad
        if since_s is not None and not self.stop_reason:
            self._pass(command, checked, now_s, period)
        if checked.flags != self._flags:
            self._note(checked.flags, now_s)
        self._count(sample, estimate, since_s)
        self._seen = (now_s, sample, estimate, command, reference, checked.flags)
        if self._folder is not None and s.compensator.observed:
            self._record(self._folder, sample, estimate, command, checked, since_s is not None)
        self._last_reference = reference

    def _judge(self, checked: Checked, now_s: float, period_s: float) -> None:
        before, s = self.degraded.phase, self.setup
        if (
            self.degraded is NORMAL
            and checked.motor_age_s <= s.times.fresh_s
            and checked.load_age_s <= s.times.fresh_s
            and not checked.fatal
            and self.readings.state is DriveState.ENABLED
        ):
            return  # nearly always: nothing is amiss
        self.degraded = degrade(self.degraded, period_s, checked.motor_age_s, checked.load_age_s, s.times)
        phase = self.degraded.phase
        if phase is not before:
            self._events.add(now_s, s.name, f"{before.name.lower()} -> {phase.name.lower()}")
        if phase is Phase.STOPPED:
            words = ", ".join(health_names(checked.flags)) or "data too old"
            self.stop_reason = self.stop_reason or words
        elif checked.fatal:
            self.stop_reason = self.stop_reason or ", ".join(health_names(checked.flags))
        elif self.readings.state in _NOT_RUNNING:
            state = self.readings.state.name.lower()
            self.stop_reason = self.stop_reason or f"drive reports {state} (error {self.readings.error:#x})"

    def _pass(self, command: Command, checked: Checked, now_s: float, period_s: float) -> None:
        s = self.setup
        position = checked.sample.motor_position_rad
        safe = gate(command, self._sent, position, checked.motor_age_s, period_s, s.limits)
        if safe.flags & ~self._gate_flags:
            words = ", ".join(gate_names(safe.flags & ~self._gate_flags))
            self._events.add(now_s, s.name, f"gate: {words}")
        self._gate_flags = safe.flags
        if safe.flags & MUST_STOP:
            self.stop_reason = self.stop_reason or f"gate: {', '.join(gate_names(safe.flags & MUST_STOP))}"
        self._sent = safe

    def _note(self, flags: int, now_s: float) -> None:
        fresh, gone = flags & ~self._flags, self._flags & ~flags
        self._flags = flags
        if fresh:
            self._events.add(now_s, self.setup.name, ", ".join(health_names(fresh)))
        if gone:
            self._events.add(now_s, self.setup.name, "over: " + ", ".join(health_names(gone)))

    def _count(self, sample: Sample, estimate: Estimate, since_s: float | None) -> None:
        tally = self.tally
        tally.phases[self.degraded.phase] += 1
        if since_s is None:
            return
        tally.cycles += 1
        wanted = self._last_reference
        measured = sample.joint_position_rad - self._offset
        if measured == measured:
            error = measured - wanted.joint_position_rad
            residual = measured - estimate.joint_position_rad
            tally.position_square += error * error
            tally.position_count += 1
            tally.residual_square += residual * residual
        tally.deflection_square += estimate.deflection_rad * estimate.deflection_rad
        torque_error = estimate.joint_torque_Nm - wanted.joint_torque_Nm
        if torque_error == torque_error:
            tally.torque_square += torque_error * torque_error
            tally.torque_count += 1

    def _record(
        self,
        folder: Path,
        sample: Sample,
        estimate: Estimate,
        command: Command,
        checked: Checked,
        controlled: bool,
    ) -> None:
        if self.log is None:
            comments = (f"cablecomp run, joint {self.setup.name}, configuration joint.toml",)
            self.log = JointLog(folder, sample, self.readings.others, comments)
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
