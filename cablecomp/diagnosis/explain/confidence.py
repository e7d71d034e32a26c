"""How probable it is that a name is right: a logistic model of the evidence of the case.

p = 1/(1 + exp(-(b + sum_k w_k (f_k - centre_k)/scale_k))). The features are those below; weights, centres and
scales are in `confidence.json` beside this file, with the trials that set them. Effects that stood out in a round and
did not come into the final model have a model of their own (`tried`), of what a round knows of them.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

FEATURES: Final = ("log_gain", "selected_in", "lead", "unfollowed_rest", "tries_rest")
"""What is learnt from. How many effects there are, and how large each is beside the others, stands in the evidence
and is not learnt from: in trials that is as it was drawn, in a machine as it is. Nor are rivals counted, what is still
followed, how much is left, how steady an amount is, whether it is on a bound: beside these five they say next to no
more of laws left out (seven sets of trials, seeds 685 to 706: Brier score 0.108; with `form_z`, `form_margin_z` and
`tries` in place of `lead` and `tries_rest`, and `share_left` besides, 0.116; boosted trees that ask for all, 0.105).
Whether a larger effect acts first through the same covariate says more there (0.103), and would have cost a jaw the
name of its path: frictions that trade places each take off little as the last to come. Learnt anew on 1483 effects of
fifteen sets (685 to 715) `lead` and `tries_rest` weigh what they did on 762, within a tenth, and the score is 0.106."""
OF_TRIED: Final = ("log_gain", "log_z", "selected_in")
_FILE: Final = Path(__file__).with_name("confidence.json")


@dataclass(frozen=True)
class Logistic:
    """Weights of the standardised features."""

    bias: float
    weight: Mapping[str, float]
    centre: Mapping[str, float]
    scale: Mapping[str, float]

    def probability(self, evidence: Mapping[str, float]) -> float:
        """Probability that the name is right."""
        total = self.bias
        for name, w in self.weight.items():
            total += w * (evidence[name] - self.centre[name]) / self.scale[name]
        return 1.0 / (1.0 + math.exp(-min(max(total, -30.0), 30.0)))


@cache
def learnt() -> Logistic:
    """The model that ships."""
    return logistic(_shipped())


@cache
def learnt_of_tried() -> Logistic | None:
    """The model for what did not come into the final one; None where trials were too few to say."""
    data = _shipped()["tried"]
    return None if data is None else logistic(data)


def logistic(data: Mapping[str, Any]) -> Logistic:
    """The model as a file holds it."""
    return Logistic(float(data["bias"]), data["weight"], data["centre"], data["scale"])


@cache
def learnt_level() -> float | None:
    """Standard errors behind the best up to which an explanation is not excluded; None where trials were too
    few to say."""
    level = _shipped()["conformal"]["level"]
    return None if level is None else float(level)


@cache
def _shipped() -> Mapping[str, Any]:
    found: Mapping[str, Any] = json.loads(_FILE.read_text(encoding="utf-8"))
    return found


def features_of_tried(gain: float, z: float, selected_in: float) -> dict[str, float]:
    """The evidence of what did not come into the final model, as `features`."""
    return {"log_gain": _log_gain(gain), "log_z": _log_z(z), "selected_in": selected_in}


def _log_gain(gain: float) -> float:
    return math.log10(max(gain, 1e-3))


def _log_z(z: float) -> float:
    return math.log10(max(z, 0.1))


def features(
    *,
    gain: float,
    selected_in: float,
    form_z: float,
    form_margin_z: float,
    share_left: float,
    share_total: float,
    rivals: int,
    unfollowed: float,
    follows: float,
    unsteady: float,
    at_bound: bool,
    tries: int,
    terms: int,
) -> dict[str, float]:
    """The evidence of one name.

    `gain`: of the model over the one without the effect, on data left out, where the other laws of either may have
    other forms (`discrepancy`). `selected_in`: share of resampled data in which it is the best of its round.
    `form_z`: standard errors of that gain where the effect itself may have another form, too (not an event);
    `form_margin_z`: over the nearest rival in its place, which may as well. `share_left`: mean square left by the
    final model beyond noise over the calibrated drive's. `share_total`: share of the calibrated drive's square that
    it takes off. `rivals`: effects in its model confidence set. `unfollowed`: p-value of what is left without it
    following a covariate that the effect acts through: the residual's own word, in which the effect's law has no
    part. `follows`: share of the remainder that still follows what it acts through. `unsteady`: difference of its
    amount between halves of the data, in units of it. `at_bound`: one of its parameters, lengths and shares apart, is
    on a bound. `tries`: points that it was asked at (an event: many instants), the best of which counts. `terms`:
    effects in the final model. Further ones are `derived`.
    """
    found = {
        "log_gain": _log_gain(gain),
        "selected_in": selected_in,
        "form_z": _bounded_z(form_z),
        "form_margin_z": _bounded_z(form_margin_z),
        "share_left": min(max(share_left, 0.0), 1.0),
        "share_total": min(max(share_total, 0.0), 1.0),
        "rivals": float(min(rivals, 4)),
        "unfollowed": unfollowed,
        "follows": follows,
        "unsteady": unsteady,
        "at_bound": float(at_bound),
        "tries": math.log10(max(tries, 1)),
        "terms": float(terms),
    }
    return {**found, **derived(found)}


def derived(evidence: Mapping[str, float]) -> dict[str, float]:
    """What is learnt from and follows from other evidence.

    `lead`: the lesser of `form_z` and `form_margin_z`, for a name has to beat both. `unfollowed_rest`, `tries_rest`:
    `unfollowed` and `tries` times the share that is left beside the effect: where it takes off nearly all, that the
    rest follows nothing, or that it was looked for in many places, says little against it.
    """
    rest = 1.0 - min(10.0 ** evidence["log_gain"], 1.0)
    return {
        "lead": min(evidence["form_z"], evidence["form_margin_z"]),
        "unfollowed_rest": rest * evidence["unfollowed"],
        "tries_rest": rest * evidence["tries"],
    }


def _bounded_z(z: float) -> float:
    return min(max(z, -3.0), 10.0)
