"""What the evidence amounts to: consistent, recalibrate, explained, unexplained; names, and how surely."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cablecomp.diagnosis.final import Final
from cablecomp.diagnosis.fitting import INFLATION, Model
from cablecomp.diagnosis.hidden import grouped
from cablecomp.diagnosis.hypotheses import all_rows, floor_of
from cablecomp.diagnosis.judge import compare
from cablecomp.diagnosis.locate import Location
from cablecomp.diagnosis.rivals import SURE, Rival
from cablecomp.diagnosis.selection import Selection
from cablecomp.diagnosis.setting import Setting
from cablecomp.signal.smoothing import FloatArray

LEFT = 0.01  # share of the mismatch's energy beyond noise that a named effect may leave over
MOST = 1 / 3  # share of it that is no explanation, however small the mismatch
STRUCTURED = 1.5  # mean square over the floor beyond which a located remainder counts
CERTAIN = 2.25  # mean square over the floor that is no noise, wherever it sits
QUIET = 0.4  # mean square over the floor, less 1, up to which nothing is left
# share of names without a rival that were true in blind trials other than those of the README: where nothing
# was left, and where something was
CONFIDENCE = (0.97, 0.80)
WEAK = 3.0  # sds below which a fitted amplitude is no finding


@dataclass(frozen=True)
class Findings:
    """Verdict and the names it rests on.

    `named`: indices into `Final.effects` with confidence; `tied`: groups of names the data cannot separate,
    with the reason.
    """

    verdict: str
    named: tuple[tuple[int, float], ...]
    tied: tuple[tuple[tuple[str, ...], str], ...]
    excess_before: float
    excess_after: float


def energy(residual_rad: FloatArray, setting: Setting) -> float:
    """Mean square over the noise floor's."""
    kept = setting.layout.heldout | setting.layout.training
    return float(np.mean((residual_rad[kept] / setting.problem.sigma[kept]) ** 2))


def weigh(
    setting: Setting, selection: Selection, final: Final, before: Location, rng: np.random.Generator
) -> Findings:
    """Weigh the rounds of the selection.

    An effect is named only if held-out data support it, no rival is left, and what it leaves over is noise.
    """
    start = energy(selection.baseline.residual_rad, setting)
    whole = float(np.mean((selection.model.residual * INFLATION) ** 2))
    end = min(energy(selection.final.residual_rad, setting), whole)
    floor = floor_of(setting.problem, selection.model) if selection.model.forms else 1.0
    excess, left = max(start - 1.0, 0.0), max(end / floor - 1.0, 0.0)
    accepted = [r for r in selection.rounds if r.accepted is not None]
    hiding = tuple(grouped(selection.hidden))
    if not final.effects:
        located = start > CERTAIN or (bool(before.significant(0.01)) and start > STRUCTURED)
        if located:
            return Findings("unexplained", (), (), excess, excess)
        return Findings(_plain(setting, selection, rng), (), hiding, excess, excess)
    tied, named = [], []
    for k, (form, entry, _) in enumerate(final.effects):
        rivals: Sequence[Rival] = next(
            (r.rivals for r in accepted if r.accepted is not None and r.accepted.name == form.name), ()
        )
        if final.strength[k] < WEAK:
            continue
        if rivals:
            names = (entry.id, *(r.name.partition(":")[0] for r in rivals))
            tied.append((tuple(dict.fromkeys(names)), _reason(rivals)))
        else:
            named.append((k, CONFIDENCE[int(left > QUIET)]))
    if left > max(LEFT * excess, 1.0) or left > max(MOST * excess, QUIET):
        return Findings("unexplained", (), tuple(tied), excess, left)
    if not named and not tied:
        return Findings(_plain(setting, selection, rng), (), hiding, excess, left)
    return Findings("explained", tuple(named), tuple(tied), excess, left)


def _reason(rivals: Sequence[Rival]) -> str:
    leads = ", ".join(f"{r.name} by {r.z:.1f} standard errors" for r in rivals)
    return f"they explain these data alike: the best one leads {leads}; {SURE:.1f} are asked for"


def _plain(setting: Setting, selection: Selection, rng: np.random.Generator) -> str:
    """Nothing missing: were the nominal parameters good enough?"""
    unit = setting.problem.sigma * INFLATION
    nominal: Model = setting.nominal
    gain = compare(nominal.residual * unit, selection.baseline.residual_rad, all_rows(selection.layout), rng)
    return "recalibrate" if gain.z > gain.margin and gain.heldout_gain > 0.1 else "consistent"
