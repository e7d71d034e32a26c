"""Pages as a browser draws them, wide and narrow, light, dark and on paper.

Needs a headless Chromium (`chromium`, `chromium-browser` or `google-chrome` on the path); skipped without one.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from plotly.subplots import make_subplots

sys.path.insert(0, str(Path(__file__).parent))

from browser import (
    BLANK,
    CUT,
    DESKTOP,
    OVERLAPPING,
    PHONE,
    SIDEWAYS,
    SPILT,
    TWICE,
    browser,
    drawn,
    needs_browser,
)
from diagnosis_example import example

from cablecomp.config import load_joint
from cablecomp.control.design import design_loop
from cablecomp.control.options import load_control
from cablecomp.guide.page import guide_page
from cablecomp.observer import Observer
from cablecomp.recording.reader import open_recording
from cablecomp.recording.writer import write_canonical
from cablecomp.report import page, style
from cablecomp.report.concealed_page import found_by_size
from cablecomp.report.design_page import design_page
from cablecomp.report.diagnosis_page import diagnosis_page
from cablecomp.report.page import Section
from cablecomp.report.replay_page import write_replay

CONFIGS = Path(__file__).parents[2] / "configs"
pytestmark = needs_browser
MOST_BYTES = 2_000_000


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    with browser() as found:
        yield found


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """One page of each kind that needs no run."""
    joint = load_joint(CONFIGS / "joints/wrist-capstan.toml")
    control = load_control(CONFIGS / "control/wrist-capstan.toml")
    return {
        "diagnosis": diagnosis_page(example()),
        "replay": replayed(tmp_path_factory.mktemp("replay")),
        "design": design_page(design_loop(joint, 1000.0, control)),
        "guide": guide_page(),
    }


def replayed(folder: Path) -> str:
    """The page of a replay with bounds far wider than the deflection."""
    joint = load_joint(CONFIGS / "joints/snow-closed-rig.toml")
    time = np.linspace(0.0, 10.0, 2_000)
    columns = {
        "time_s": time, "motor_position_rad": np.zeros_like(time), "joint_torque_Nm": 1.5 * np.sin(2.0 * time),
    }  # fmt: skip
    found = Observer(joint).run(columns)
    noise = 2e-5 * np.random.default_rng(1).standard_normal(len(time))
    write_canonical(folder / "r.csv", {**columns, "joint_position_rad": found["joint_position_rad"] + noise})
    write_replay(open_recording(folder / "r.csv"), joint, Observer(joint, bounds=True), folder / "out")
    return (folder / "out/report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("width", [DESKTOP, PHONE])
@pytest.mark.parametrize("kind", ["diagnosis", "replay", "design", "guide"])
def test_everything_stands_and_nothing_is_cut(
    chromium: Any, pages: dict[str, str], kind: str, width: int, tmp_path: Path
) -> None:
    """Marks in every figure, ids unique, no text cut or on another, nothing that scrolls sideways."""
    assert len(pages[kind].encode()) < MOST_BYTES
    with drawn(chromium, pages[kind], tmp_path, width) as seen:
        assert seen.evaluate(SIDEWAYS) <= 0
        for what in (TWICE, BLANK, CUT, OVERLAPPING, SPILT):
            assert seen.evaluate(what) == [], what


def test_figures_follow_the_reader_into_the_dark_and_onto_paper(
    chromium: Any, pages: dict[str, str], tmp_path: Path
) -> None:
    """Ground and ink of page and figures change together; on paper they are light and no wider than a sheet."""
    ground = """[getComputedStyle(document.querySelector('section')).backgroundColor,
      document.querySelector('.plot').layout.template.layout.paper_bgcolor]"""
    with drawn(chromium, pages["design"], tmp_path, color_scheme="dark") as seen:
        dark = seen.evaluate(ground)
        assert dark == ["rgb(21, 27, 36)", "#151b24"]
        seen.evaluate("dispatchEvent(new Event('beforeprint'))")
        seen.emulate_media(media="print", color_scheme="dark")
        assert seen.evaluate(ground)[1] == style.PAPER
        assert (
            seen.evaluate(
                "Math.max(...[...document.querySelectorAll('.main-svg')].map((s) => s.clientWidth))"
            )
            <= 700
        )
        seen.evaluate("dispatchEvent(new Event('afterprint'))")
        assert seen.evaluate(ground)[1] == dark[1]
        seen.emulate_media(media="screen", color_scheme="light")
        # the figures are drawn anew after the change, not within it
        light = f'JSON.stringify({ground}) === \'["rgb(255, 255, 255)","{style.PAPER}"]\''
        seen.wait_for_function(light, timeout=20_000)


def test_the_name_of_an_axis_stays_out_of_the_column_before_it(chromium: Any, tmp_path: Path) -> None:
    fig = make_subplots(rows=1, cols=2, horizontal_spacing=0.12)
    for column, name in ((1, "tension / N"), (2, "load / N·m")):
        fig.add_scatter(x=[0.0, 1.0], y=[-100.0, 100.0], row=1, col=column)
        style.axes(fig, "time / s", name, row=1, col=column)
    text = page.page("A page", "", [Section("Figure", page.figure(fig))])
    edges = """(() => { const plot = document.querySelector('.plot'), first = plot._fullLayout.xaxis;
      return [first._offset + first._length,
        document.querySelector('.y2title').getBoundingClientRect().left - plot.getBoundingClientRect().left]; })()"""
    with drawn(chromium, text, tmp_path, PHONE) as seen:
        ends, begins = seen.evaluate(edges)
    assert begins >= ends


@pytest.mark.parametrize("width", [DESKTOP, PHONE])
def test_curves_of_what_was_concealed_leave_room_for_their_words(
    chromium: Any, width: int, tmp_path: Path
) -> None:
    """Of one physics, of two, of eight."""
    rate = {"share": 0.5, "interval_95": [0.2, 0.8], "hits": 1, "of": 2}
    points = [{"size": size, "found": rate, "wrong_name": rate} for size in (0.1, 1.0)]
    curve = {"words": "joint channel late", "unit": "ms", "points": points}
    figures = [Section(f"Found {k}", page.figure(found_by_size({"curves": [curve] * k}))) for k in (1, 2, 8)]
    with drawn(chromium, page.page("A page", "", figures), tmp_path, width) as seen:
        for what in (BLANK, CUT, OVERLAPPING):
            assert seen.evaluate(what) == [], what


def test_a_table_of_long_names_is_no_wider_than_its_card(chromium: Any, tmp_path: Path) -> None:
    heads = ["switched on", *(f"true, loading/unloading, M_pk {k}" for k in range(10))]
    table = page.table(heads, [["pressure_dependent_friction", *["1.093"] * 10]])
    table_of = "[document.querySelector('table').scrollWidth, document.querySelector('.scroll').clientWidth]"
    with drawn(chromium, page.page("A page", "", [Section("Numbers", table)]), tmp_path) as seen:
        wide, card = seen.evaluate(table_of)
        assert wide <= card
        assert seen.evaluate("document.querySelector('td').textContent") == "pressure_dependent_friction"


def test_a_sentence_in_a_table_keeps_a_width_that_it_can_be_read_at(chromium: Any, tmp_path: Path) -> None:
    fig = style.figure(300)
    style.curve(fig, np.arange(3.0), np.arange(3.0), "line", style.PREDICTED, 1.0)
    row = [*["position_dependent_friction"] * 4, "because it was " * 20]
    body = page.figure(fig) + page.table(["one", "two", "three", "four", "why"], [row])
    with drawn(chromium, page.page("A page", "", [Section("Table", body)]), tmp_path, PHONE) as seen:
        assert seen.evaluate("document.querySelector('td:last-child').clientWidth") > 0.5 * PHONE
        assert seen.evaluate(SIDEWAYS) <= 0


def test_bounds_do_not_flatten_what_they_bound(chromium: Any, pages: dict[str, str], tmp_path: Path) -> None:
    """The predicted deflection takes more than half of its axis, however wide the band is."""
    ask = """(() => { const plot = document.querySelector('.plot'), [low, high] = plot.layout.yaxis.range;
      const y = Array.from(plot.data.find((t) => t.name === 'predicted').y);
      return (Math.max(...y) - Math.min(...y)) / (high - low); })()"""
    with drawn(chromium, pages["replay"], tmp_path) as seen:
        assert 0.5 < seen.evaluate(ask) < 1.0


def test_long_axes_arrive_as_they_were(chromium: Any, tmp_path: Path) -> None:
    """What is packed in 16 bits comes out within half a step, gaps included; figures alike are both drawn."""
    x, y = np.linspace(0.0, 9.0, 200), np.sin(np.linspace(0.0, 9.0, 200))
    y[50] = np.nan
    fig = style.figure(300)
    style.curve(fig, x, y, "sine", style.PREDICTED, 1.0)
    html = page.page("x", "", [Section("a", page.figure(fig) + page.figure(fig))])
    ask = "[...document.querySelectorAll('.plot')].map((p) => [p.data[0].x.at(-1), p.data[0].y[3], p.data[0].y[50]])"
    with drawn(chromium, html, tmp_path) as seen:
        first, second = seen.evaluate(ask)
        assert seen.evaluate(BLANK) == []
    assert first == second
    assert first[:2] == [pytest.approx(9.0, abs=1e-4), pytest.approx(y[3], abs=2e-5)]
    assert first[2] is None
