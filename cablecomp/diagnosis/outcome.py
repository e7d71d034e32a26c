"""What the steps of a diagnosis hand on to each other: the case, what a model leaves, what is made of the search."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cablecomp.config import Empirical, JointConfig
from cablecomp.diagnosis.body import Body
from cablecomp.diagnosis.calibration.drive import Calibrated
from cablecomp.diagnosis.describe.empirical import Found
from cablecomp.diagnosis.explain.dependence import Dependence
from cablecomp.diagnosis.explain.model import Model
from cablecomp.diagnosis.explain.weighed import Weighed
from cablecomp.diagnosis.locate.covariates import Covariates
from cablecomp.diagnosis.locate.location import Location, locate
from cablecomp.diagnosis.locate.remainders import sensitivities, series_of
from cablecomp.diagnosis.locate.responses import every_row, responses
from cablecomp.diagnosis.locate.series import Series
from cablecomp.diagnosis.result import Errors
from cablecomp.estimation.least_squares import Fit

SURROGATES: Final = 7
"""Seed of the surrogates that models without an effect are held against."""


@dataclass(frozen=True)
class Remainder:
    """What a model leaves of the joint's angle, and where it lies."""

    series: Series
    location: Location


@dataclass(frozen=True)
class Case:
    """The joint as configured, its recordings, the drive calibrated on them, and the covariates of each recording
    used, on all of its fine rows."""

    config: JointConfig
    body: Body
    drive: Calibrated
    on_every_row: tuple[Covariates, ...]

    @property
    def covariates(self) -> tuple[Covariates, ...]:
        """The same on the judged rows."""
        evidence = self.drive.fit.problem.evidence
        return tuple(c.at(e.rows) for c, e in zip(self.on_every_row, evidence, strict=True))

    def located(self, rng: np.random.Generator) -> Location:
        """Where the calibrated drive's misfit lies, before any name: on every fine row, and by what the drive itself
        makes of laws that change."""
        fit = every_row(self.drive.fit)
        series = series_of(fit, self.on_every_row, self.drive.fine_floor_rad)
        return locate(series, rng, sensitivities(fit), drive=responses(fit))

    def remainder_of(self, fit: Fit, rng: np.random.Generator) -> Remainder:
        """What a fit to these recordings, or some of them, leaves."""
        known = dict(zip((e.name for e in self.drive.fit.problem.evidence), self.covariates, strict=True))
        series = series_of(fit, [known[e.name] for e in fit.problem.evidence], self.drive.floor_rad)
        return Remainder(series, locate(series, rng, sensitivities(fit)))

    def locate(self, fit: Fit) -> Location:
        """Where what such a fit leaves lies, by surrogates that are the same for all fits."""
        return self.remainder_of(fit, np.random.default_rng(SURROGATES)).location


@dataclass(frozen=True)
class Outcome:
    """What is made of a search.

    `weighed`: every effect of its model; `named`: those that are sure enough, in order (`in_order`). `kept`:
    the model to go by, without effects where none is named; `laws`: laws without a name beside it. `baseline`,
    `augmented`: errors of the calibrated drive, and of what is kept. `remainder`: what that leaves; `repeated_rad`:
    what the machine itself repeats; `structured`: what is left is more than noise.
    """

    weighed: tuple[Weighed, ...]
    named: tuple[Weighed, ...]
    kept: Model
    laws: tuple[Found, ...]
    baseline: Errors
    augmented: Errors
    remainder: Remainder
    repeated_rad: float | None
    structured: bool
    verdict: str

    @property
    def names(self) -> list[str]:
        """Names of what is named."""
        return [w.term.name for w in self.named]

    @property
    def told(self) -> list[str]:
        """The same, and of what is kept what the drive's own parameters, or a named effect's, depend on."""
        depends = (t for t in self.kept.terms if isinstance(t, Dependence))
        mine = [d.name for d in depends if d.of_drive or any(d.belongs_to(w.term) for w in self.named)]
        return [*self.names, *mine]

    @property
    def empirical(self) -> list[Empirical]:
        """The laws without a name, as a configuration has them."""
        return [law for f in self.laws for law in f.laws]
