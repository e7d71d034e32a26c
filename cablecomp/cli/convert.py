"""`cablecomp convert`."""

from __future__ import annotations

from math import inf, isfinite
from pathlib import Path
from typing import Annotated

import typer

from cablecomp.cli.shared import JsonOption, console, each_once, echo_json, warn
from cablecomp.cli.sources import RatioOption, Reading, reads_recordings
from cablecomp.config import load_joint
from cablecomp.counting import counted
from cablecomp.errors import InputError
from cablecomp.recording.convert import convert
from cablecomp.recording.csv_head import number
from cablecomp.recording.progress import progress_bar
from cablecomp.report.inspection import missing_channels


@reads_recordings
def convert_recording(
    *,
    recording: Annotated[Path, typer.Argument(help="recording of any accepted kind")],
    to: Annotated[Path, typer.Argument(help="file to write: .csv, .csv.gz, .parquet, .mcap or .npz")],
    config: RatioOption = None,
    reading: Reading,
    begin: Annotated[float, typer.Option("--from", help="leave out rows before this time, s")] = -inf,
    end: Annotated[float, typer.Option("--to", help="leave out rows after this time, s")] = inf,
    late: Annotated[
        list[str] | None,
        typer.Option(help="CHANNEL=SECONDS: values that come so much later than the others', set right"),
    ] = None,
    ros: Annotated[
        bool, typer.Option("--ros2", help="ROS 2's messages in .mcap, which `ros2 bag play` publishes")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Write a recording in canonical channels: SI units, our signs, one clock."""
    if not begin <= end:
        raise InputError(
            f"--from {begin:g} --to {end:g}: a time, and none before it, in seconds are accepted"
        )
    joint = None if config is None else load_joint(config)
    source = reading(joint).open(recording)
    late_s = each_once("--late", map(_late, late or ()))
    with progress_bar(f"convert {recording.name}") as progress:
        rows = convert(source, to, (begin, end), progress, late_s, ros)
    warn(missing_channels(source.channels, joint))
    if as_json:
        echo_json({"written": to, "rows": rows, "channels": source.channels, "notes": source.notes})
        return
    for note in source.notes:
        console.print(f"note: {note}")
    console.print(f"written: {to} ({counted(rows, 'row')}: {', '.join(source.channels)})", soft_wrap=True)


def _late(word: str) -> tuple[str, float]:
    channel, _, text = word.partition("=")
    seconds = number(text)
    if seconds is None or not isfinite(seconds):
        raise InputError(f"--late {word}: CHANNEL=SECONDS is accepted, such as joint_torque_Nm=0.04")
    if channel.strip() == "time_s":
        raise InputError(f"--late {word}: time_s is the clock that others are late by; give another channel")
    return channel.strip(), seconds
