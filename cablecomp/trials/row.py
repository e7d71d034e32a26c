"""One blind trial's row of the score: names, values, bounds against the truth, and what they add up to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import nan

VISIBLE = 1.5  # mean square over the noise floor from which unknown physics can be seen at all


@dataclass(frozen=True)
class Named:
    """An effect that was weighed: its confidence and evidence, and whether it is true. It is a name given from
    `LIMITS.name` on."""

    effect: str
    confidence: float
    right: bool
    evidence: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Estimate:
    """A stated value against the truth; `z` in stated standard deviations."""

    what: str
    true: float
    value: float
    sd: float

    @property
    def z(self) -> float:
        """Deviation in stated standard deviations; NaN where none is stated."""
        return (self.value - self.true) / self.sd if self.sd > 0.0 else nan


@dataclass(frozen=True)
class Bound:
    """How large an effect that was concealed and not named could be, as stated (None: any size), against what
    is true."""

    what: str
    true: float
    below: float | None

    @property
    def held(self) -> bool:
        """Whether the truth lies below."""
        return self.below is None or abs(self.true) <= self.below


@dataclass(frozen=True)
class Row:
    """The score of one trial.

    `laws`, `forms`: whose laws the concealed effects follow, and each effect's `id:form`; `imperfections` by name;
    `named`: names given, `weighed`: all effects of the final model, named or not, with their evidence;
    `decidable`: the true laws beat the recalibrated drive beyond what an effect has to bring; `located`: the
    first covariate of the calibrated drive's residual, before any name, or an interval, is what the concealed
    effect acts through (None if nothing is concealed that shows in the joint's angle); `bounds`: of what was
    concealed and not named; `depends`: true dependences found, of all (None: there are none to be found),
    `depends_wrongly`: those
    stated that are not true; `final_rad`: RMSE after modelling on data kept for the end; `empirical`: laws
    without a name; `said_tied`, `proposed`, `settled`: of confounded trials (None otherwise); `heldout_rad`,
    `baseline_rad`, `true_rad`, `floor_rad`: RMSE after modelling, of the recalibrated drive, of the true angle
    (the recording's own noise), of noise as the verdict states it; `failed`: why there is no verdict.
    """

    number: int
    kind: str
    case: str
    label: str
    excitation: str
    size: float
    truth: tuple[str, ...]
    laws: str
    forms: tuple[str, ...]
    imperfections: tuple[str, ...]
    decidable: bool
    baseline_rad: float
    true_rad: float
    verdict: str = "failed"
    named: tuple[Named, ...] = ()
    weighed: tuple[Named, ...] = ()
    tied: tuple[tuple[str, ...], ...] = ()
    located: bool | None = None
    covariate: str = ""
    said_tied: bool | None = None
    proposed: bool | None = None
    settled: bool | None = None
    depends: tuple[int, int] | None = None
    depends_wrongly: int = 0
    short_by: float | None = None
    estimates: tuple[Estimate, ...] = ()
    bounds: tuple[Bound, ...] = ()
    empirical: tuple[str, ...] = ()
    heldout_rad: float = nan
    final_rad: float = nan
    floor_rad: float = nan
    seconds: float = nan
    failed: str = ""

    @property
    def first(self) -> str:
        """The first name; empty if none was given."""
        return self.named[0].effect if self.named else ""

    @property
    def first_right(self) -> bool:
        """Whether the first name is what the trial is about."""
        return self.first in self.truth

    @property
    def wrong(self) -> bool:
        """Whether any name given is not true."""
        return any(not n.right for n in self.named)

    @property
    def all_right(self) -> bool:
        """Whether all that the trial is about is named, and nothing wrong."""
        return set(self.truth) <= {n.effect for n in self.named} and not self.wrong

    @property
    def visible(self) -> bool:
        """Whether the recalibrated drive leaves clearly more than noise."""
        return self.baseline_rad**2 > VISIBLE * self.true_rad**2

    @property
    def outcome(self) -> str:
        """What stands in the confusion matrix: the first name, or the verdict where none was given."""
        if self.failed:
            return "failed"
        return self.first or (f"tied ({self.verdict})" if self.tied else self.verdict)
