"""The simulated joint as a process of its own: it says where it listens, serves, and ends when told to."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import can
import pytest
import serial
from sim_process import SimProcess
from sim_two_mass import TwoMass

from firmware_sim.cli import main
from firmware_sim.errors import SimError
from firmware_sim.wire.frame import Frame
from firmware_sim.wire.serial_records import RecordReader, encode_record

ROOT = Path(__file__).resolve().parents[2]
CONFIG = str(ROOT / "configs" / "joints" / "snow-closed-rig.toml")
LIGHT = (
    "import sys; from sim_two_mass import TwoMass; from firmware_sim.cli import main; "
    "sys.exit(main(make_plant=lambda n: TwoMass()) or ('can' in sys.modules and 'python-can was loaded'))"
)
ENTER = b"\xff" * 7 + b"\xfc"
ZERO = bytes.fromhex("7FFF7FF0000007FF")


@contextmanager
def light(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    """The command line with the small linear plant, which needs no compiling."""
    path = os.pathsep.join((str(ROOT), str(Path(__file__).parent)))
    command = [sys.executable, "-c", LIGHT, "--config", CONFIG, *arguments]
    child = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": path},
    )  # fmt: skip
    try:
        yield child
    finally:
        child.kill()
        child.wait()
        for pipe in (child.stdin, child.stdout, child.stderr):
            if pipe is not None and not pipe.closed:
                pipe.close()


def told(child: subprocess.Popen[str]) -> dict[str, object]:
    assert child.stdout is not None
    return json.loads(child.stdout.readline())


@pytest.mark.parametrize("way", ["SIGTERM", "SIGINT", "stdin"])
def test_it_ends_cleanly(way: str) -> None:
    with light("--bus", "serial", "--until-stdin-closes") as child:
        where = told(child)
        assert where["listening"] is True
        assert Path(str(where["channel"])).exists()
        if way == "stdin":
            assert child.stdin is not None
            child.stdin.close()
        else:
            child.send_signal(getattr(signal, way))
        assert child.wait(10.0) == 0
        ended = told(child)
        assert ended["ended"] is True
        assert not child.stderr.read()


def test_stepped_slcan_across_processes() -> None:
    with light("--bus", "slcan", "--stepped", "--joints", "2") as child:
        where = told(child)
        assert where["pace"] == "stepped by command"
        with can.Bus(
            interface="slcan", channel=str(where["channel"]), bitrate=1_000_000, sleep_after_open=0.0
        ) as bus:
            bus.send(can.Message(arbitration_id=2, data=ENTER, is_extended_id=False))
            sequences: list[int] = []
            for _ in range(30):
                bus.send(can.Message(arbitration_id=2, data=ZERO, is_extended_id=False))
            end = time.monotonic() + 5.0
            while len(sequences) < 30 and time.monotonic() < end:
                message = bus.recv(0.5)
                if message is not None and message.arbitration_id == 0x682:
                    sequences.append(message.data[7])
        assert sequences == list(range(30))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--bus", "virtual", "--fault", "fly"], "unknown name 'fly'"),
        (["--bus", "virtual", "--joints", "0"], "1 to 32 is accepted"),
        (["--bus", "virtual", "--drive-rate", "1500"], "whole multiple"),
        (["--bus", "virtual", "--protocol", "smoke"], "invalid choice"),
    ],
    ids=["fault", "joints", "rate", "protocol"],
)
def test_wrong_arguments_are_one_line_and_exit_2(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    given = ["--config", CONFIG, "--until-stdin-closes"]  # taken by mistake, it would end by itself
    with pytest.raises(SystemExit) as ended:
        sys.exit(main([*given, *arguments], make_plant=lambda _: TwoMass()))
    out, error = capsys.readouterr()
    assert ended.value.code == 2
    assert out == ""
    assert said in error
    assert error.strip().count("\n") == 0


def test_a_process_with_a_bus_that_cannot_be_opened_says_one_line_and_ends_with_2() -> None:
    with light("--bus", "carrier_pigeon:1") as child:
        out, error = child.communicate(timeout=20.0)
        assert child.returncode == 2
        assert out == ""
        assert "cannot be opened" in error
        assert error.strip().count("\n") == 0


def test_the_real_plant_in_a_process_of_its_own(tmp_path: Path) -> None:
    link = tmp_path / "joint"
    scenario = str(ROOT / "configs" / "scenarios" / "load_changes.toml")
    arguments = [
        "--config",
        CONFIG,
        "--scenario",
        scenario,
        "--bus",
        "serial",
        "--link",
        str(link),
        "--stepped",
    ]
    with SimProcess(arguments) as sim:
        assert sim.where["channel"] == str(link)
        with serial.Serial(str(link), timeout=0.5) as line:
            reader, frames = RecordReader(), []
            line.write(encode_record(Frame(1, ENTER)) + encode_record(Frame(1, ZERO)) * 100)
            end = time.monotonic() + 20.0
            while sum(f.identifier == 0x680 for f in frames) < 100 and time.monotonic() < end:
                frames += reader.feed(line.read(max(line.in_waiting, 1)))
        states = [f for f in frames if f.identifier == 0x680]
        assert [f.data[7] for f in states] == list(range(100))
        torques = {f.data[4:7] for f in states}
        assert len(torques) > 5  # a changing load, in steps of the sensor's resolution
        assert sim.alive
    assert not sim.alive
    assert not link.exists()
    assert sim.ended["simulated_s"] == pytest.approx(0.1)


def test_a_process_that_cannot_start_says_why(tmp_path: Path) -> None:
    with pytest.raises(SimError, match="cannot be read"):
        SimProcess(["--config", str(tmp_path / "none.toml"), "--bus", "virtual"])
