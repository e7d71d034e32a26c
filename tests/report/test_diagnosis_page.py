"""Laws of the diagnosis page: every part of the result is on it, nothing is fetched, odd cases do not break it."""

from __future__ import annotations

import io
import re
import sys
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

sys.path.insert(0, str(Path(__file__).parent))

from diagnosis_example import NOISE, example, text_of, without_a_name

from cablecomp.config import load_joint
from cablecomp.diagnosis.result import PROTOCOL, Diagnosis, Law, Traces, Value, report_json, write_diagnosis
from cablecomp.effects import with_effects
from cablecomp.estimation.belief import still_doubted, suspicions
from cablecomp.report import diagnosis_figures as figures
from cablecomp.report.diagnosis_answer import shown_first
from cablecomp.report.diagnosis_page import diagnosis_page
from cablecomp.report.diagnosis_tables import by_recording
from cablecomp.report.diagnosis_terminal import diagnosis_summary
from cablecomp.report.page import number
from cablecomp.report.replay_figures import Scale


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    return example(600)  # two recordings with the judged rows that a diagnosis has in all


def test_its_files_are_utf_8_wherever_they_are_written(
    found: Diagnosis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    joint = found.augmented_joint.model_copy(update={"name": "Größe"})
    with (
        monkeypatch.context() as elsewhere
    ):  # what text is written in where nothing is said, as in a C locale
        elsewhere.setattr(io, "text_encoding", lambda encoding, level=2: encoding or "ascii")
        write_diagnosis(replace(found, augmented_joint=joint), tmp_path)
    assert load_joint(tmp_path / "joint.augmented.toml") == joint
    assert found.next_experiment is not None
    assert (tmp_path / PROTOCOL).read_text(encoding="utf-8") == found.next_experiment[1]


def terminal(d: Diagnosis) -> str:
    """What the command prints."""
    text = StringIO()
    Console(width=200, file=text).print(diagnosis_summary(report_json(d)))
    return text.getvalue()


def test_all_parts_of_the_result_are_on_the_page(found: Diagnosis) -> None:
    text = text_of(diagnosis_page(found, "[[effect]]\ncoefficient_Ns_per_m_rad = 118.4\n"))
    for part in (
        "Partly explained",
        "Viscous slip",
        "97 % sure of the name",
        "and moves the joint by 321 µrad RMS",
        "118.4 ± 3.1",
        "differs between sessions: rig-1 118.4, rig-2 131",
        "33.10 ± 0.22",
        "clock skew 21 % viscous_slip takes off more",
        "takes off less than 6 %",
        "z = 1.2: chance does as much",
        "series compliance / nonlinear cable",
        "load hold 5 s",
        "(3.1e-06 ± 4e-07) rad/(N·m)² M²",
        "ripple_by_motor_angle",
        "0.0041 N·m",
        "clamp slip slip_m could be any size",
        "coefficient_Ns_per_m_rad = 118.4",
        "bench-07.csv",
        "EA_N ended on its bound",
        "kept for the end",
    ):
        assert part in text, part


def test_of_several_channels_a_share_is_said_to_be_of_the_one_in_which_it_shows_most(
    found: Diagnosis,
) -> None:
    said = "mean square in the channel in which it shows most; probability"
    assert said in text_of(diagnosis_page(found))
    assert said not in text_of(diagnosis_page(replace(found, channels={})))


def test_a_name_beside_a_far_larger_one_says_what_it_takes_off_of_what_that_leaves(found: Diagnosis) -> None:
    first = replace(found.named[0], evidence={"gain": 0.97})
    second = replace(found.named[0], heldout_gain=0.0031, evidence={"gain": 0.447})
    text = text_of(diagnosis_page(replace(found, named=(first, second))).split("</section>")[0])
    assert re.search(r"takes 0.3 % off the held-out square.* \(45 % of what the others leave\)", text)
    assert "of what the others leave" not in text_of(diagnosis_page(replace(found, named=(first,))))


def test_of_a_name_that_the_others_do_without_no_negative_share_is_said(found: Diagnosis) -> None:
    missed, spare = (replace(found.named[0], evidence={"gain": gain}) for gain in (0.97, -0.09))
    text = text_of(diagnosis_page(replace(found, named=(missed, spare))).split("</section>")[0])
    assert re.search(r"off the held-out square.* \(the others predict as well without it\)", text)
    assert "-9 %" not in text


def test_the_answer_stands_before_everything_else(found: Diagnosis) -> None:
    """Verdict, name, confidence, error before and after, what remains: all in the first section."""
    first = text_of(diagnosis_page(found).split("</section>")[0])
    for part in ("Partly explained", "Viscous slip", "97 %", "→", "What remains", "Kept for the end"):
        assert part in first, part


def test_a_square_of_which_something_is_left_is_not_said_to_be_removed_whole(found: Diagnosis) -> None:
    left = replace(found.augmented, heldout_rmse_rad=0.04 * found.baseline.heldout_rmse_rad)
    assert "Square removed 99.8 %" in text_of(diagnosis_page(replace(found, augmented=left)))


def test_the_answer_says_what_a_law_without_a_name_takes_off_the_rest(found: Diagnosis) -> None:
    law = Law("wave_by_motor_angle", "motor_angle", 0.91, 21.0)
    for d in (
        replace(found, empirical=(law,)),
        replace(without_a_name(found, "unexplained"), empirical=(law,)),
    ):
        first = text_of(diagnosis_page(d).split("</section>")[0])
        assert "Of that one's square, laws without a name take off wave by motor angle 91 %" in " ".join(
            first.split()
        )


@pytest.mark.parametrize(
    ("missing", "said"), [((0.7, 0.9), True), ((0.0, 0.3), False), ((0.8, 0.801), False)]
)
def test_the_answer_speaks_of_shading_where_the_end_that_it_shows_is_shaded(
    missing: tuple[float, float], said: bool, found: Diagnosis
) -> None:
    """Nothing fitted to a part of the end; to the beginning alone (an unknown history); to a reading set aside."""
    begin, end = missing

    def traced(t: Traces) -> Traces:
        place = np.linspace(0.0, 1.0, len(t.counted))
        return replace(t, counted=~((place >= begin) & (place <= end)))

    first = diagnosis_page(replace(found, traces=tuple(traced(t) for t in found.traces))).split("</section>")[
        0
    ]
    assert ("Shaded" in text_of(first)) is said


def test_what_was_not_read_is_drawn_nowhere_and_is_in_no_number(found: Diagnosis) -> None:
    """The joint's encoder silent for a while that the drive went on in: a gap in the line, and no row of any table."""
    trace = found.traces[0]
    silent = (np.arange(len(trace.counted)) >= 420) & (np.arange(len(trace.counted)) < 480)
    gap = replace(
        trace, measured_rad=np.where(silent, np.nan, trace.measured_rad), counted=trace.counted & ~silent
    )
    unit = Scale(1e3, "mrad")
    lines = {line.name: np.asarray(line.y) for line in figures.at_a_glance(gap, unit).data}
    shown = silent[-len(lines["measured"]) :]
    assert shown.any()
    for name in ("measured", "error before", "error after"):
        np.testing.assert_array_equal(np.isnan(lines[name]), shown)
    assert np.isfinite(lines["after"]).all()
    assert not figures.end_is_shaded(replace(gap, counted=~silent))  # nothing was kept from the fit there
    along = figures.along([gap], "load", NOISE, unit)
    assert all(np.isfinite(np.asarray(line.y)).all() for line in along.data)
    before, _ = (m.z for m in figures.energy_map([gap], "load", NOISE).data)
    assert np.isfinite(before).any()
    whole, cut = (re.findall(r"<td[^>]*>(.*?)</td>", by_recording([t], unit)) for t in (trace, gap))
    rest = ~trace.counted  # from 0.85 on, where nothing is silent
    assert whole[-2:] == cut[-2:]
    rms = float(np.sqrt(np.mean(figures.residual(trace, "before_rad")[rest] ** 2)))
    assert number(1e3 * rms, "mrad") in cut
    loud = replace(gap, name="loud", measured_rad=gap.measured_rad + 1e-3)
    first = shown_first(replace(found, traces=(gap, loud)))
    assert first is not None
    assert first.name == "loud"
    assert "Before and after" in text_of(diagnosis_page(replace(found, traces=(gap,))))


def test_the_terminal_answers_first(found: Diagnosis) -> None:
    lines = terminal(found).splitlines()
    assert lines[0].strip() == "Partly explained: viscous slip"
    text = " ".join(" ".join(lines).split())
    for part in (
        "viscous_slip 97 %",
        "118.4 ± 3.1",
        "kept for the end",
        "what remains",
        "candidate: clock_skew",
    ):
        assert part in text, part


def test_a_sign_that_is_doubted_stands_before_any_name(found: Diagnosis) -> None:
    """And once, on the page as in the terminal; other warnings stay where they were."""
    line = "b.csv: the angles seem to turn against each other"
    doubted = replace(found, mend_first=(line,), warnings=(line, "EA_N ended on its bound"))
    name = found.named[0].effect.replace("_", " ")
    for text in (text_of(diagnosis_page(doubted, "")), terminal(doubted)):
        assert text.count(line) == 1
        assert text.index(line) < text.lower().index(name) < text.index("ended on its bound")
    assert report_json(doubted)["mend_first"] == [line]


def test_a_late_channel_is_said_beside_a_delay_that_has_no_name(found: Diagnosis) -> None:
    """A candidate's delay, fitted beside the effects that have names, is the very lateness that the check saw."""
    time = np.arange(0.0, 20.0, 0.02)
    turns = np.where(time < 10.0, 0.2 * time, 2.0 + 0.6 * (time - 10.0))
    motor = np.sin(2.0 * np.pi * turns) * (1.0 - np.exp(-time))
    angle = found.config.drive.ratio * np.interp(time - 0.1, time, motor)
    columns = {"time_s": time, "motor_position_rad": motor, "joint_position_rad": angle}
    columns["joint_torque_Nm"] = np.zeros_like(time)
    said = suspicions(found.config, columns)
    assert [s.numbers["late_s"] for s in said] == [pytest.approx(0.1, abs=0.01)]
    late = with_effects(found.config, [("clock_skew", {"delay_s": 0.1})])
    (skew,) = found.candidates
    assert skew.effect == "clock_skew"
    nameless = replace(found, augmented_joint=late)
    assert still_doubted(said, nameless.in_time, columns) == said
    for known in (replace(nameless, config=late), replace(nameless, named=(skew,))):
        assert still_doubted(said, known.in_time, columns) == ()


def test_recalibrate_gives_old_and_new_values(found: Diagnosis) -> None:
    d = without_a_name(found, "recalibrate")
    text = " ".join(terminal(d).split())
    assert "pretension_N 33.54 33.10 0.22" in text
    assert "pretension_N 33.54 33.10 0.22" in text_of(diagnosis_page(d).split("</section>")[0])


def test_the_page_fetches_nothing(found: Diagnosis) -> None:
    html = diagnosis_page(found)
    assert not re.findall(r"<(?:script|link|img)[^>]+(?:src|href)=", html)
    assert len(html.encode()) < 2_000_000


def test_no_two_elements_share_an_id(found: Diagnosis) -> None:
    ids = re.findall(r'\bid="([^"]+)"', diagnosis_page(found))
    assert len(ids) == len(set(ids))


@pytest.mark.parametrize("verdict", ["consistent", "recalibrate", "unexplained"])
def test_every_verdict_has_a_page(found: Diagnosis, verdict: str) -> None:
    d = without_a_name(found, verdict)
    text = text_of(diagnosis_page(d))
    assert verdict.capitalize() in text
    assert "What was missing" not in text
    assert ("What remains:" in text) == (verdict == "unexplained")
    assert terminal(d).startswith(verdict.capitalize())


def test_a_page_without_series_or_mismatch_still_stands(found: Diagnosis) -> None:
    bare = replace(
        found,
        traces=(),
        location=replace(found.location, mismatch=()),
        remainder_location=replace(found.location, mismatch=()),
        calibration=(),
        repeatability_rad=None,
        could_be_unseen=(),
    )
    text = text_of(diagnosis_page(bare))
    assert "Viscous slip" in text
    assert "Before and after" not in text


def test_nothing_is_shaded_where_the_mismatch_is_what_chance_does(found: Diagnosis) -> None:
    by_chance = tuple(replace(m, p_value=0.5) for m in found.location.mismatch)
    assert "where the mismatch sits" in text_of(diagnosis_page(found))
    calm = replace(found, location=replace(found.location, mismatch=by_chance))
    assert "where the mismatch sits" not in text_of(diagnosis_page(calm))


def test_the_first_that_is_beyond_chance_is_said_to_hold_the_mismatch(found: Diagnosis) -> None:
    first, second, *rest = found.location.mismatch
    ranked = (replace(first, p_value=0.2), replace(second, p_value=0.01, share=0.3125), *rest)
    text = text_of(diagnosis_page(replace(found, location=replace(found.location, mismatch=ranked))))
    assert "accounts for 31 % of the calibrated drive's mismatch" in text
    assert "nothing that was asked stands out" not in text


def test_repeats_are_said_where_they_limit_what_a_model_can_do(found: Diagnosis) -> None:
    assert "The machine repeats to" in text_of(diagnosis_page(found))
    assert "the machine itself repeats to" in terminal(found)
    for other_rad in (3.0 * found.augmented.rmse_rad, 0.4 * found.noise_floor_rad):
        apart = replace(found, repeatability_rad=other_rad)
        assert "The machine repeats to" not in text_of(diagnosis_page(apart))
        assert "the machine itself repeats to" not in terminal(apart)


def test_a_joint_without_load_is_drawn_over_its_motor(found: Diagnosis) -> None:
    trace = found.traces[0]
    free = replace(trace, covariates={**trace.covariates, "load": np.zeros(len(trace.measured_rad))})
    assert "motor angle" in figures.loops(free, Scale(1e3, "mrad")).layout.xaxis.title.text
    assert "Before and after" in text_of(diagnosis_page(replace(found, traces=(free,))))


def test_names_are_escaped(found: Diagnosis) -> None:
    d = replace(found, config=found.config.model_copy(update={"name": "<b>x</b>"}))
    assert "<b>x</b>" not in diagnosis_page(d)


def test_the_law_that_ties_sessions_is_drawn_at_their_values(found: Diagnosis) -> None:
    """A parameter that grows with a condition: base + rate times the condition, at each value of it."""
    by_bend = {"parameter": "mu_output", "on": "bend", "per_unit": 0.2}
    calibration = (*found.calibration, Value("mu_output~bend", 0.2, 0.01))
    d = replace(found, calibration=calibration)
    assert "mu_output grows by 0.2 per unit of bend" in text_of(diagnosis_page(d))
    fig = figures.dependence({"0": 0.1132, "2": 0.1132 + 2 * 0.2}, by_bend["parameter"], "bend")
    (line,) = fig.data
    assert line.mode == "lines"  # dots would pass for values that were found one by one
    assert (line.y[1] - line.y[0]) / (line.x[1] - line.x[0]) == pytest.approx(0.2)


def test_a_sessions_own_value_is_said_to_differ_between_sessions_whatever_their_names(
    found: Diagnosis,
) -> None:
    own = tuple(Value(f"mu_output@run~{k}", 0.1 * k, 0.01, session=f"run~{k}") for k in (1, 2))
    d = replace(found, calibration=(*found.calibration, *own))
    text = text_of(diagnosis_page(d))
    assert "mu_output differs between sessions: run~1 0.1, run~2 0.2" in text
    first_screen = text[: text.index("RMS error of the joint angle, before → after")]
    assert "mu_output differs between sessions run~1 0.1, run~2 0.2" in first_screen
    assert "per unit of" not in text
