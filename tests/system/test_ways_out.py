"""Every way out of a run, as processes: what a listener on the wire reads, and what lies on the disk afterwards."""

from __future__ import annotations

import json
import os
import pty
import signal
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import polars as pl
import pytest
from fault_runs import JOINT
from live_rig import RATE_HZ, Host, LiveRun

from cablecomp.config import load_joint
from cablecomp.observer import Observer
from cablecomp.recording.reader import open_recording
from cablecomp.runtime.folder import RunFolder
from cablecomp.runtime.ways_out import WaysOut

S = signal.Signals
UNDER_CONTROL = 60  # commands: taking up is over by then


@pytest.fixture(scope="module")
def host() -> Iterator[Host]:
    made = Host()
    yield made
    made.close()


@pytest.fixture
def run(host: Host, tmp_path: Path) -> Iterator[LiveRun]:
    made = LiveRun(host, tmp_path)
    yield made
    made.close()


def let_go_at_last(run: LiveRun) -> None:
    """The drive was told to let go, and nothing after that."""
    heard = run.joint.heard
    run.wait_for(lambda: [h.word for h in heard[-2:]] == ["leave", "leave"])
    last = max(k for k, h in enumerate(heard) if not h.word)
    assert [h.word for h in heard[last + 1 :]].count("leave") >= 2
    assert {h.word for h in heard[last + 1 :]} == {"leave"}
    assert not run.joint.enabled


def nothing_is_lost(folder: Path) -> None:
    """The snapshot is the state after the last row of the recording."""
    config = load_joint(folder / "joint.toml")
    taken_up, replayed = Observer(config), Observer(config)
    if (folder / "start.snapshot").exists():
        replayed.load(folder / "start.snapshot")
    for block in open_recording(folder / "recording.csv").blocks():
        replayed.run(block.columns)
    taken_up.load(folder / "observer.snapshot")
    assert taken_up.snapshot() == replayed.snapshot()


@pytest.mark.parametrize(
    "signals",
    [
        (S.SIGINT,),
        (S.SIGTERM,),
        (S.SIGHUP,),
        (S.SIGINT, S.SIGINT),
        (S.SIGTERM, S.SIGTERM, S.SIGHUP, S.SIGINT),
    ],
    ids=lambda signals: "-".join(s.name for s in signals),
)
def test_a_signal_stops_the_drive_and_leaves_everything_whole(run: LiveRun, signals: tuple[S, ...]) -> None:
    run.start()
    run.wait_for_commands(UNDER_CONTROL)
    for number in signals:
        run.signal(number)
        time.sleep(0.03)
    assert run.wait() == 0, run.said()
    let_go_at_last(run)
    nothing_is_lost(run.out)
    said = json.loads((run.out / "run.json").read_text())
    assert said["stop_reason"].startswith("asked by the user")
    assert signals[0] is S.SIGINT or signals[0].name in said["stop_reason"]
    assert (run.out / "report.html").exists()
    assert "Traceback" not in run.said()


def test_a_run_loads_no_tools_of_loop_design_before_a_gain_is_to_be_designed(host: Host) -> None:
    """They take as long to import as all else."""
    assert host.design_tools == []


def test_a_terminal_that_is_closed_stops_the_drive_and_leaves_everything_whole(run: LiveRun) -> None:
    """Nor does one that nobody reads from, as when its output is paused, hold the loop up."""
    ours, theirs = pty.openpty()
    run.start(terminal=os.ttyname(theirs))
    os.close(theirs)
    run.wait_for_commands(UNDER_CONTROL)
    os.close(ours)
    assert run.wait() == 0
    let_go_at_last(run)
    nothing_is_lost(run.out)
    assert "SIGHUP" in json.loads((run.out / "run.json").read_text())["stop_reason"]
    assert (run.out / "report.html").exists()


def test_a_killed_run_loses_a_second_at_most_and_the_next_one_goes_on_from_there(run: LiveRun) -> None:
    """Nothing can be sent any more: the drive lets go by itself, and history lies on the disk."""
    run.start()
    run.wait_for_commands(UNDER_CONTROL + 2 * RATE_HZ)
    run.signal(S.SIGKILL)
    assert run.wait() == -S.SIGKILL
    run.wait_for(lambda: not run.joint.enabled)
    commands = len(run.joint.commands)
    rows = len(pl.read_csv(run.out / "recording.csv", comment_prefix="#"))
    assert rows >= commands - RATE_HZ
    config = load_joint(run.out / "joint.toml")
    kept = Observer(config)
    kept.load(run.out / "observer.snapshot")
    at_s = float(kept.vector()[-1])
    recorded = pl.read_csv(run.out / "recording.csv", comment_prefix="#")["time_s"].to_numpy()
    assert recorded[-1] - at_s < 1.0
    assert (commands - rows) / RATE_HZ + recorded[-1] - at_s < 1.0

    del run.joint.heard[:]
    snapshot = run.out / "observer.snapshot"
    run.start("--resume", str(snapshot), "--duration", "0.3")
    assert run.wait() == 0, run.said()
    let_go_at_last(run)
    nothing_is_lost(run.out)
    went_on = pl.read_csv(run.out / "recording.csv", comment_prefix="#")["time_s"]
    assert at_s < went_on[0] < at_s + 0.5
    # and what was there of the first run lies aside, whole
    assert len(pl.read_csv(run.out / "earlier-1" / "recording.csv", comment_prefix="#")) == rows


def test_a_run_that_was_halted_goes_on_without_a_leap_or_stops(run: LiveRun) -> None:
    run.start("--duration", "1.2")
    run.wait_for_commands(UNDER_CONTROL)
    run.signal(S.SIGSTOP)
    time.sleep(0.5)
    run.signal(S.SIGCONT)
    assert run.wait() in (0, 3), run.said()
    let_go_at_last(run)
    nothing_is_lost(run.out)
    commands = run.joint.commands
    assert max(abs(b.position - a.position) for a, b in pairwise(commands)) <= 30.0 / RATE_HZ + 1e-9


def test_a_drive_that_dies_stops_the_run_by_its_true_reason(run: LiveRun) -> None:
    run.start()
    run.wait_for_commands(UNDER_CONTROL)
    run.joint.mute = True
    assert run.wait() == 3
    assert "motor position is stale" in json.loads((run.out / "run.json").read_text())["stop_reason"]
    nothing_is_lost(run.out)
    let_go_at_last(run)


@pytest.mark.parametrize("stated", ["", "command_timeout_s = 0.0", "command_timeout_s = 0.001"])
def test_a_drive_without_a_timeout_of_its_own_is_refused_unless_told_so(run: LiveRun, stated: str) -> None:
    path = run.folder / "link.toml"
    lines = path.read_text().splitlines()
    kept = [stated if line.startswith("command_timeout_s") else line for line in lines]
    path.write_text("\n".join(kept) + "\n")
    run.start("--duration", "0.2")
    assert run.wait() == 2
    assert "command_timeout_s" in run.said()
    assert not run.joint.heard
    assert not run.out.exists()
    if stated != "command_timeout_s = 0.001":
        run.start("--duration", "0.2", "--without-drive-timeout")
        assert run.wait() == 0, run.said()


def test_two_runs_at_once_do_not_mix_their_files(run: LiveRun) -> None:
    first = RunFolder(run.out, ["joint-1"])
    (run.out / "recording.csv").write_text("the first one's\n")
    run.start()
    assert run.wait() == 2
    first.close()
    assert "another run writes into it" in run.said()
    assert not run.joint.commands
    assert [p.name for p in run.out.iterdir()] == ["recording.csv"]


def test_a_snapshot_that_is_damaged_is_refused_before_anything_moves(run: LiveRun, tmp_path: Path) -> None:
    observer = Observer(load_joint(JOINT))
    path = tmp_path / "s.snapshot"
    observer.save(path)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(bytes(data))
    run.start("--resume", str(path))
    assert run.wait() == 2
    assert "checksum" in run.said()
    assert not run.joint.heard


@pytest.mark.parametrize("name", ["SIGQUIT", "SIGTSTP", "SIGUSR1", "SIGALRM", "SIGXCPU", "SIGTERM", "SIGHUP"])
def test_every_signal_that_ends_a_process_asks_what_runs_and_cuts_nothing_short(name: str) -> None:
    number, asked = S[name], []
    before = signal.signal(number, signal.SIG_DFL)  # whoever started this may have had it ignored
    try:
        with WaysOut() as ways_out, ways_out.asking(asked.append):
            for _ in range(3):
                os.kill(os.getpid(), number)
            time.sleep(0.0)
        assert signal.getsignal(number) == signal.SIG_DFL
    finally:
        signal.signal(number, before)
    assert asked[0] == f"asked by the user ({name})"
    assert set(asked) == {asked[0]}


def test_where_nothing_runs_a_signal_ends_at_once_and_what_was_asked_before_holds() -> None:
    asked: list[str] = []
    with WaysOut() as ways_out:
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(S.SIGTERM)
        signal.raise_signal(S.SIGTERM)
        with ways_out.asking(asked.append):
            pass
    assert asked == ["asked by the user (SIGTERM)"]


def test_a_signal_that_is_ignored_stays_ignored() -> None:
    """As after nohup."""
    asked: list[str] = []
    before = signal.signal(S.SIGHUP, signal.SIG_IGN)
    try:
        with WaysOut() as ways_out, ways_out.asking(asked.append):
            signal.raise_signal(S.SIGHUP)
    finally:
        signal.signal(S.SIGHUP, before)
    assert not asked
