"""The loop: absolute ticks, all joints of one link, from listening through enabling and control to a safe
stop."""

from __future__ import annotations

import gc
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from time import perf_counter

from cablecomp.counting import counted
from cablecomp.errors import DeviceError
from cablecomp.links.link import Link
from cablecomp.links.records import BusState, DriveState, Mode
from cablecomp.runtime.accounts import Accounts
from cablecomp.runtime.clock import Clock, SteppedClock, Tick, Ticker
from cablecomp.runtime.joint_loop import JointLoop, JointSetup
from cablecomp.runtime.log import EventLog
from cablecomp.runtime.priority import QUIET, Granted, Policy, armed
from cablecomp.runtime.timing import TimingReport

TIME_IS_OVER = "time is over"
COLLECT_EVERY = 500  # ticks between two collections of young garbage, in idle time
LOOK_EVERY = 128  # ticks between two looks at the link's counters
STOPS = 3  # times that a run which ends by an error has its stop taken by the bus
DISABLE_GRACE = 20  # ticks after enabling in which an old "disabled" may still be on its way


class RunStage(IntEnum):
    """Where a run stands."""

    LISTENING = 0
    ENABLING = 1
    RUNNING = 2
    STOPPING = 3


@dataclass(frozen=True)
class LoopOptions:
    """How long things may take (s): until data have come that can be believed for `settle_s`, enabling, the
    run itself, watching after the stop, in which the stop is sent again every tick, so that the drive goes on
    telling where it is.

    `begin_s`: the time that the run's clock starts from, for an observer that goes on from a snapshot.
    """

    duration_s: float
    listen_s: float = 2.0
    enable_s: float = 3.0
    settle_s: float = 0.05
    after_s: float = 0.1
    mode: Mode = Mode.IMPEDANCE
    policy: Policy = QUIET
    begin_s: float = 0.0


AfterTick = Callable[[Tick, RunStage], None]
"""Called once a tick after the commands went out: steps a simulated bus, feeds the live view."""


class Loop:
    """Runs joints on a link. `run` returns when the time is over or something asked for a stop; the stop
    command is sent in every case, an unexpected exception included, and all logs are closed; `failures` says
    what of them is incomplete. `prepare` is called once the link is open: nothing is written before.
    """

    def __init__(
        self,
        link: Link,
        setups: tuple[JointSetup, ...],
        clock: Clock,
        period_s: float,
        options: LoopOptions,
        folder: Path | None = None,
        after_tick: AfterTick | None = None,
        prepare: Callable[[], None] | None = None,
    ) -> None:
        self.link = link
        self.options = options
        self.period_s = period_s
        self.stage = RunStage.LISTENING
        self.stop_reason = ""
        self.failures: list[str] = []
        self.accounts = Accounts(period_s)
        self.events = EventLog(None if folder is None else folder / "events.jsonl")
        folders = [None if folder is None else _folder_of(folder, s, len(setups)) for s in setups]
        self.joints = tuple(JointLoop(s, link, f, self.events) for s, f in zip(setups, folders, strict=True))
        self._clock = clock
        self._after = after_tick
        self._prepare = prepare
        self._ticker: Ticker | None = None
        self._granted = Granted()
        self._stage_s = options.begin_s
        self._armed_s = 0.0
        self._asked_to_stop = ""
        self._told = False  # every drive, that it has to let go
        self._unread = ((0, 0), (0, 0))

    @property
    def since_s(self) -> float:
        """Time since control began (0 before), as of the last tick."""
        return max(self.accounts.last_s - self._armed_s, 0.0) if self.stage is RunStage.RUNNING else 0.0

    def ask_to_stop(self, why: str) -> None:
        """End the run at the next tick, safely; may be called from another thread or a signal handler."""
        self._asked_to_stop = why

    def run(self) -> TimingReport:
        """Compile, arm, run, stop; returns how the time was kept. Raises DeviceError if no data come or no
        drive enables."""
        for joint in self.joints:
            compile_all = getattr(joint.setup.compensator.observer, "compile", None)
            if compile_all is not None:
                compile_all()
        self._open()
        try:
            with armed(self.options.policy) as self._granted:
                self._loop()
        finally:
            self._close()
        return self.report()

    def report(self) -> TimingReport:
        """How time and data were kept so far."""
        stepped = isinstance(self._clock, SteppedClock)
        return self.accounts.report(
            self.link.status(), self._skipped, tuple(self._granted.lines), stepped=stepped
        )

    # ---- inside ----------------------------------------------------------------------------------

    @property
    def _skipped(self) -> int:
        return 0 if self._ticker is None else self._ticker.skipped

    def _open(self) -> None:
        """A link that does not open, or a folder that cannot be made, leaves nothing behind."""
        try:
            self.link.open()
            if self._prepare is not None:
                self._prepare()
        except BaseException:
            self.link.close()
            raise

    def _loop(self) -> None:
        ticker = self._ticker = Ticker(self._clock, self.period_s, self.options.begin_s)
        while True:
            tick = ticker.wait()
            begin = perf_counter()
            self.link.poll(tick.now_s)
            polled = perf_counter()
            done = self._tick(tick)
            self._account(tick, begin, polled, perf_counter())
            if self._after is not None:
                self._after(tick, self.stage)
            for joint in self.joints:
                joint.keep(tick.now_s)
            if done:
                return

    def _tick(self, tick: Tick) -> bool:
        """Do what the stage asks for at this tick; returns whether the run is over."""
        now = tick.now_s
        if self.stage is RunStage.LISTENING:
            self._listen(now)
        elif self.stage is RunStage.ENABLING:
            self._enable(now)
        elif self.stage is RunStage.RUNNING:
            self._run(tick)
        else:
            self._told = self.link.stop()
            for joint in self.joints:
                joint.stand(now)
            return now - self._stage_s >= self.options.after_s
        return False

    def _listen(self, now: float) -> None:
        for joint in self.joints:
            joint.listen(now)
        if self._asked_to_stop:
            self._stop(self._asked_to_stop, now)
            return
        over = now - self._stage_s > self.options.listen_s
        unheard = [(j, channel) for j in self.joints for channel in j.taking_up.unheard(j.readings)]
        if all(j.taking_up.known_s(now) >= self.options.settle_s for j in self.joints) and (
            over or not unheard
        ):
            for joint, channel in unheard:
                self.events.add(now, joint.setup.name, f"{channel} has not come; the recording is without it")
            self._go(RunStage.ENABLING, now)
            for joint in self.joints:
                joint.first(now)
        elif over:
            raise DeviceError(f"link `{self.link.config.name}`: {self._what_is_missing(now)}")

    def _what_is_missing(self, now: float) -> str:
        listened = self.options.listen_s
        mute = [j for j in self.joints if j.checked is None or not j.checked.ready]
        if mute:
            silent = ", ".join(self.link.silent(now, listened / 2)) or "a channel that is needed"
            if foreign := self.link.status().foreign:
                silent += f"; {foreign} frames came from other devices on the same identifiers"
            faulty = [j for j in mute if j.readings.state is DriveState.FAULT]
            silent += "".join(f"; the drive of {j.setup.name} reports {j.drive_words}" for j in faulty)
            names = ", ".join(j.setup.name for j in mute)
            return (
                f"nothing from {names} within {listened:g} s (silent: {silent}); "
                "check power, wiring, bitrate and node numbers"
            )
        known = self.options.settle_s
        unknown = [j for j in self.joints if not j.taking_up.known_s(now) >= known]
        why = "; ".join(f"{j.setup.name}: {j.taking_up.why}" for j in unknown)
        return f"within {listened:g} s there was no drive to be sure of for {known:g} s ({why}); none was enabled"

    def _enable(self, now: float) -> None:
        for joint in self.joints:
            joint.enable(now, self.options.mode)
        waited = now - self._stage_s
        why = self._asked_to_stop or self._joint_trouble() or self._bus_trouble()
        grace = DISABLE_GRACE * self.period_s
        if why:
            self._stop(why, now)
        elif all(j.taking_up.held and j.taking_up.enabling_s(now) >= grace for j in self.joints):
            for joint in self.joints:
                joint.begin()
            self._armed_s = now
            self._go(RunStage.RUNNING, now)
        elif waited > self.options.enable_s:
            states = ", ".join(f"{j.setup.name} is {j.drive_words}" for j in self.joints)
            raise DeviceError(
                f"link `{self.link.config.name}`: not every drive enabled within {self.options.enable_s:g} s "
                f"({states}); clear its faults and calibrate it"
            )

    def _run(self, tick: Tick) -> None:
        now = tick.now_s
        since = now - self._armed_s
        # Step by step and not joint by joint: what the processor has just run, it runs twice as fast again.
        for joint in self.joints:
            joint.look(now)
        for joint in self.joints:
            joint.decide(now, since)
        for joint in self.joints:
            joint.act(now)
        for joint in self.joints:
            joint.note(since)
        minute = self.accounts.minute(since, self._skipped, self.link)
        if minute is not None:
            self.events.add(now, "", f"minute {minute.number}: {minute.words()}")
        if tick.number % LOOK_EVERY == 0:
            self._unread = (self._unread[1], self.link.unread)
        if tick.skipped:
            self.events.add(now, "", f"{counted(tick.skipped, 'tick')} skipped")
        why = self._asked_to_stop or self._joint_trouble() or self._bus_trouble()
        if not why and since >= self.options.duration_s:
            why = TIME_IS_OVER
        if why:
            self._stop(why, now)

    def _joint_trouble(self) -> str:
        for joint in self.joints:
            if joint.stop_reason:
                return f"{joint.setup.name}: {joint.stop_reason}{self._flood()}"
            if joint.failure:
                return joint.failure
        return self.events.failure

    def _flood(self) -> str:
        """What is behind data that come too late: frames that nobody waits for, more than can be read."""
        polls, dropped = (now - then for now, then in zip(self.link.unread, self._unread[0], strict=True))
        if polls == dropped == 0:
            return ""
        status = self.link.status()
        return (
            f" (the bus is flooded: {polls} polls could not read all that came, {dropped} frames were dropped by the "
            f"system, {status.ignored + status.foreign} frames were for none of the joints)"
        )

    def _bus_trouble(self) -> str:
        state = self.link.bus
        if state is BusState.ACTIVE or state is BusState.PASSIVE:
            return ""
        return f"bus is {state.name.lower()}: {self.link.status().fault}"

    def _stop(self, why: str, now: float) -> None:
        self.link.stop()
        self.stop_reason = why
        self.events.add(now, "", f"stop: {why}")
        self._go(RunStage.STOPPING, now)

    def _go(self, stage: RunStage, now: float) -> None:
        self.events.add(now, "", f"{self.stage.name.lower()} -> {stage.name.lower()}")
        self.stage, self._stage_s = stage, now

    def _account(self, tick: Tick, begin: float, polled: float, end: float) -> None:
        self.accounts.tick(tick)
        if self.stage is not RunStage.RUNNING:
            return
        self.accounts.cycle(tick, begin, polled, end)
        for joint in self.joints:
            self.accounts.joint(joint.step_s, joint.checked)
        if tick.number % COLLECT_EVERY == 0 and not gc.isenabled() and end - begin < 0.5 * self.period_s:
            gc.collect(0)

    def _stop_for_sure(self) -> None:
        """The stop once more and again, until the bus has taken it often enough for one to get through; no longer than
        is watched after a stop."""
        tries = max(STOPS, round(self.options.after_s / self.period_s))
        taken = 0
        for _ in range(tries):
            taken += self.link.stop()
            if taken == STOPS:
                return
            self._clock.wait_until(self._clock.now() + self.period_s)

    def _close(self) -> None:
        """Stop command, whatever happened; then the link and every log, each one tried."""
        try:
            if self.stage is not RunStage.STOPPING or not self._told:
                self._stop_for_sure()
            if self.stage is not RunStage.STOPPING:
                self.stop_reason = self.stop_reason or "ended by an error"
                self.events.add(self.accounts.last_s, "", f"stop: {self.stop_reason}")
        finally:
            with ExitStack() as all_of_them:
                all_of_them.callback(self.link.close)
                all_of_them.callback(self.events.close)
                for joint in self.joints:
                    all_of_them.callback(self._close_joint, joint)
            if self.events.failure:
                self.failures.append(self.events.failure)

    def _close_joint(self, joint: JointLoop) -> None:
        self.failures += joint.close()


def _folder_of(folder: Path, setup: JointSetup, count: int) -> Path:
    return folder if count == 1 else folder / setup.name
