"""What the diagnosis page shows: the contents of diagnosis.json, and the series behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True)
class RecordingView:
    """One recording, before and after what was missing is modelled.

    `covariates`: public name -> values (at least `time` and `load`; `load_direction` if known);
    `measured_rad`: joint angle; `before_rad`, `after_rad`: predicted by the calibrated drive and by the
    augmented one (offsets included); `rigid_rad`: joint angle of a rigid drive, so that deflection =
    angle - rigid; `heldout`: samples that no fit has seen (all False if none).
    """

    name: str
    covariates: Mapping[str, FloatArray]
    measured_rad: FloatArray
    before_rad: FloatArray
    after_rad: FloatArray
    rigid_rad: FloatArray
    heldout: BoolArray

    @property
    def residual_before(self) -> FloatArray:
        """Measured minus predicted, calibrated drive, in rad."""
        return self.measured_rad - self.before_rad

    @property
    def residual_after(self) -> FloatArray:
        """Measured minus predicted, augmented drive, in rad."""
        return self.measured_rad - self.after_rad


@dataclass(frozen=True)
class EffectNote:
    """How an effect is explained: `title`, `statement` in plain words, `equation`, `source`, unit of
    each parameter.
    """

    title: str
    statement: str
    equation: str
    source: str = ""
    units: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Hypothesis:
    """One hypothesis that was asked: effects joined by " + ".

    `heldout_gain` ± `gain_sd`: share of the baseline's held-out mean square that it removes; `score`:
    gain in predictive log-likelihood (nats, dependence counted), NaN if it was ruled out before a full
    fit; `p_value` corrected for all hypotheses; `outcome`: "named", "not needed", "not supported",
    "screened out", ...; `why` in plain words; `baseline`: what it was compared with.
    """

    name: str
    heldout_gain: float
    gain_sd: float
    score: float
    p_value: float
    outcome: str
    why: str = ""
    baseline: str = "the calibrated drive"


@dataclass(frozen=True)
class Limit:
    """How large an effect could still be, unseen, in these data: parameter `name` below `value` (95 %),
    in `unit`.
    """

    effect: str
    name: str
    value: float
    unit: str


@dataclass(frozen=True)
class DiagnosisView:
    """Everything on the page. `result` is diagnosis.json as written; the rest may be empty where it
    does not apply.

    `notes`: effect id -> how it is explained; `hypotheses`: all that were asked, best first; `limits`:
    what *consistent* means; `law`: equation of an unexplained structure; `warnings`: such as parameters
    at a bound; `augmented_toml`: the file's text.
    """

    joint: str
    result: Mapping[str, Any]
    recordings: Sequence[RecordingView]
    notes: Mapping[str, EffectNote] = field(default_factory=dict)
    hypotheses: Sequence[Hypothesis] = ()
    limits: Sequence[Limit] = ()
    law: str = ""
    warnings: Sequence[str] = ()
    augmented_toml: str = ""
