"""The thesis's theory figures for one joint, on one page that opens offline."""

from __future__ import annotations

from pathlib import Path

from cablecomp.config import JointConfig
from cablecomp.recording.atomic import atomic_directory
from cablecomp.report import page, theory_closed, theory_models, theory_open, theory_wrap
from cablecomp.report.theory_common import Subject, subject_of

CHAPTERS = (
    ("Wrapped cable", "Chapter 2: one wrap on a pulley that does not turn.", theory_wrap.figures),
    ("Open circuit", "Chapter 3: one cable between two pulleys, the input pulley held.", theory_open.figures),
    ("Closed circuit", "Chapter 4: two antagonistic cables, the input pulley held.", theory_closed.figures),
    ("Approximate models", "Chapter 4.2.6: what the simpler formulas are worth.", theory_models.figures),
)
"""Title, words and figures of each part of the page."""


def write_theory_figures(config: JointConfig, out_dir: Path, load_max_Nm: float | None = None) -> Path:
    """Write figures 2.7, 2.8, 3.2 to 3.4, 4.4, 4.5, 4.7 to 4.15 of the thesis, drawn for this joint, to
    `out_dir`/theory.html; returns its path.

    `load_max_Nm`: greatest load, N m (default: `[limits] joint_torque_max_Nm`). plotly.js is embedded once; the page
    needs no network. Nothing is left behind on failure. Raises InputError where neither load is known, and where
    `out_dir` cannot be written.
    """
    subject = subject_of(config, load_max_Nm)
    html = page.page(f"Theory of {config.name}", _lead(subject), _sections(subject))
    with atomic_directory(out_dir) as folder:
        (folder / "theory.html").write_text(html, encoding="utf-8")
    return out_dir / "theory.html"


def _sections(subject: Subject) -> list[page.Section]:
    sections = []
    for title, lead, draw in CHAPTERS:
        shown = [
            f'<h3 style="margin: 14px 0 0">{figure.number} · {figure.title}</h3>'
            + page.figure(figure.figure, figure.caption)
            for figure in draw(subject)
        ]
        sections.append(page.Section(title, page.columns(*shown), lead + _remark(title, subject)))
    return sections


def _remark(title: str, subject: Subject) -> str:
    if title == "Open circuit" and subject.circuit == "closed":
        return " This joint is a closed circuit: shown is one of its cables by itself."
    if title in {"Closed circuit", "Approximate models"} and subject.circuit == "open":
        return " This joint is an open circuit: shown is what it would be with a second, antagonistic cable."
    return ""


def _lead(subject: Subject) -> str:
    stage = subject.stage
    return (
        f"The theory figures of Snow's thesis (MIT/WHOI, 1993) with {subject.name} drawn into them: "
        f"{subject.what}, GF = {stage.GF:.3g}, mu_eff = {stage.mu_eff:.3g}, T0 = {stage.pretension_N:.3g} "
        f"N, loads up to {subject.m_peak * stage.moment_scale_Nm:.3g} N·m (m = {subject.m_peak:.3g}). Axes "
        "are dimensionless as in the thesis; point at this joint's curves for values in units. Thin curves: "
        "wraps that never end; this joint's own curves: wraps as they are."
    )
