"""`cablecomp replay`: a recording through the observer to prediction.csv, replay.json and report.html."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from cablecomp.config import JointConfig
from cablecomp.recording.atomic import atomic_directory
from cablecomp.recording.reader import Recording
from cablecomp.recording.replay import PredictionCsv, Progress, StreamObserver, replay
from cablecomp.recording.replay_summary import ReplaySummary
from cablecomp.recording.writer import CsvWriter
from cablecomp.report import page, replay_figures
from cablecomp.report.page import Fact, Section
from cablecomp.report.replay_display import Display, DisplaySink


def write_replay(
    recording: Recording,
    config: JointConfig,
    observer: StreamObserver,
    out: Path,
    config_text: str = "",
    progress: Progress | None = None,
) -> ReplaySummary:
    """Replay a recording and write its three files to `out`: all of them, or none if anything fails.

    `config_text` is the joint's TOML as the page shows it. Raises InputError as `replay` does.
    """
    display = DisplaySink()
    with atomic_directory(out) as folder:
        with CsvWriter(folder / "prediction.csv", PredictionCsv.COLUMNS) as writer:
            summary = replay(
                recording, observer, [PredictionCsv(writer.write), display], progress, config=config
            )
        (folder / "replay.json").write_text(summary.to_json(), encoding="utf-8")
        html = replay_page(summary, display.display(), config_text)
        (folder / "report.html").write_text(html, encoding="utf-8")
    return summary


def replay_page(summary: ReplaySummary, display: Display, config_text: str = "") -> str:
    """Return the page of one replay as HTML that opens offline."""
    name = Path(summary.recording).name
    lead = f"Recording {name}: {_count(summary.samples)} samples over {summary.duration_s:.4g} s."
    return page.page(f"Replay: {summary.joint}", lead, _sections(summary, display, config_text))


def _sections(summary: ReplaySummary, display: Display, config_text: str) -> Iterator[Section]:
    yield Section(
        "Summary", page.facts(_facts(summary, display.has("residual_rad"))) + page.bullets(summary.notes)
    )
    yield Section(
        "Deflection over time",
        page.figure(replay_figures.over_time(display, summary)),
        f"Deflection of the joint against the motor, measured and predicted. {_band(display)} "
        "Dots on the load are the instants shown below.",
    )
    if display.has("load_Nm"):
        yield Section("Load–deflection loop", page.figure(replay_figures.loop(display, summary)))
    if display.has("residual_rad") and summary.rmse_rad is not None:
        yield Section(
            "Residual",
            _residual(display, replay_figures.scale(summary.deflection_range_rad)),
            "What the prediction leaves: measured minus predicted.",
        )
    if display.has("tension_h_N"):
        yield Section("Cable tension", page.figure(replay_figures.tensions(display)))
    if summary.snapshots and summary.snapshots[0].profiles:
        yield Section(
            "Tension on each wrap",
            page.figure(replay_figures.profiles(summary.snapshots)),
            "Tension along the wrapped cable at chosen instants: the memory of the joint. "
            "A click on an instant hides it, a double click shows it alone.",
        )
    yield Section("What is assumed about the joint", page.bullets(summary.assumptions))
    if config_text:
        yield Section("Configuration", page.fold(f"{summary.joint}, as used", page.code(config_text)))


def _band(display: Display) -> str:
    if display.has("deflection_low_rad"):
        return (
            "The band holds the truth for every admissible history before the recording; where it is wider than the "
            "curves it is cut."
        )
    return "No guaranteed bounds were computed, or this joint's effects do not allow any."


def _residual(display: Display, unit: replay_figures.Scale) -> str:
    parts = [page.figure(replay_figures.histogram(display, unit))]
    if display.residual_density is not None:
        parts.append(page.figure(replay_figures.spectra(display, unit)))
    else:
        parts.append(
            page.paragraph(
                "No spectrum: the sampling is uneven, some rows lack the joint's angle, or the recording is too short."
            )
        )
    return page.figure(replay_figures.residual_over_time(display, unit)) + page.columns(*parts)


def _facts(summary: ReplaySummary, measured: bool) -> Iterator[Fact]:
    reach = summary.deflection_range_rad
    unit = replay_figures.scale(reach)  # one for all of them, and that of the figures
    if summary.rmse_rad is None:
        why = "the joint's position told the load" if measured else "no joint position was recorded"
        yield Fact("RMS error", "–", why, "warn")
    else:
        share = 100.0 * summary.rmse_rad / reach if reach > 0.0 else float("nan")
        yield Fact(
            "RMS error", _in(unit, summary.rmse_rad), f"{page.number(share)} % of the deflection's range"
        )
        yield Fact(
            "Mean error", _in(unit, summary.mean_rad), f"standard deviation {_in(unit, summary.sd_rad)}"
        )
        yield Fact("Largest error", _in(unit, summary.max_rad))
    if summary.baseline_linear_rmse_rad is not None and summary.rmse_rad:
        gain = summary.baseline_linear_rmse_rad / summary.rmse_rad
        remark = f"{page.number(gain)} × the error of this prediction"
        tone: page.Tone = "good" if gain > 1.0 else "warn"
        yield Fact("Best straight line", _in(unit, summary.baseline_linear_rmse_rad), remark, tone)
    yield Fact("Deflection's range", _in(unit, reach), "measured" if measured else "predicted")
    if summary.bounds_width_last_rad is not None:
        remark = f"{_in(unit, summary.bounds_width_first_rad)} at the start"
        yield Fact("Bounds at the end", _in(unit, summary.bounds_width_last_rad), remark)
    yield Fact(
        "Speed",
        f"{_count(summary.samples_per_s)} /s",
        "samples, reading and writing included",
    )


def _count(value: float) -> str:
    return f"{value:,.0f}".replace(",", " ")


def _in(unit: replay_figures.Scale, value_rad: float | None) -> str:
    return "–" if value_rad is None else page.number(value_rad * unit.factor, unit.unit)
