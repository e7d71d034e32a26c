"""What each of a series of trials is to hold: kinds, effects and forms in turn, in orders drawn from the seed.

A trial's order depends on the seed and its number alone, not on how many trials are made.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from firmware_sim.plant import PlantError
from firmware_sim.trials import confounded
from firmware_sim.trials.forms_cable import CABLE
from firmware_sim.trials.forms_friction import FRICTION
from firmware_sim.trials.forms_joint import JOINT
from firmware_sim.trials.forms_loads import LOADS
from firmware_sim.trials.forms_motor import MOTOR, MOTOR_FORMS
from firmware_sim.trials.strangers import STRANGERS
from firmware_sim.trials.suspects import CATALOGUE, Suspect
from firmware_sim.trials.tabletop import Case, case_in_turn

T = TypeVar("T")

KINDS = ("single", "pair", "none", "stranger", "sessions", "confounded", "motor")
"""What a trial holds; `motor`: an effect that shows in the motor's torque alone."""
IMPERFECTIONS = ("none", "some", "all", "vague")
"""Of the world; `vague`: all of them, and the drive known by order of magnitude only, in the same recordings."""
ALIKE = frozenset({
    "bearing_friction:by_moment",
    "clamp_slip:gradual", "clamp_slip:in_steps", "clamp_slip:other_cable", "clamp_slip:overload",
    "clamp_slip:unequal_steps", "clock_skew:drift", "crosstalk:dragged", "crosstalk:lagged",
    "crosstalk:posed", "crosstalk:quadratic", "crosstalk:rubbing", "crosstalk:touching",
    "gravity_load:leaning_base", "gravity_load:picked_up", "gravity_load:tilting_base",
    "inertial_load:flexible_link", "inertial_load:folding_arm", "inertial_load:half_filled", "nonlinear_cable:s_shaped",
    "position_dependent_friction:input_drum", "position_dependent_friction:patch",
    "position_dependent_friction:threaded",
    "pressure_dependent_friction:floor", "pressure_dependent_friction:worn_through",
    "pretension_relaxation:exponential", "pretension_relaxation:in_two",
    "pretension_relaxation:power_law", "pretension_relaxation:warm_creep", "pulley_runout:oval",
    "routing_friction:unlike_paths", "series_compliance:anisotropic", "series_compliance:bushing",
    "series_compliance:one_way", "series_compliance:rubber", "series_compliance:softening", "series_compliance:staged",
    "strand_break:accelerating", "strand_break:fraying", "strand_break:in_steps", "strand_break:other_cable",
    "strand_break:unequal_steps", "strand_friction:graded", "strand_friction:masing", "strand_friction:proportional",
    "strand_friction:rate_dependent", "termination_backlash:dragging_link", "termination_backlash:greased",
    "termination_backlash:sprung", "termination_backlash:two_clearances", "termination_backlash:wedged",
    "thermal_pretension:lagged", "thermal_pretension:quadratic", "thermal_pretension:sticking",
    "viscous_slip:one_drum",
})  # fmt: skip
"""Forms that the catalogue has by now, as shapes of its own laws: they count as the catalogue's."""
FORMS = (*FRICTION, *CABLE, *JOINT, *LOADS)
OTHER_FORMS = (*(s for s in FORMS if s.id not in ALIKE), *MOTOR_FORMS)
"""What can be concealed of laws that the catalogue does not hold."""
CATALOGUE_FORMS = (*CATALOGUE, *(s for s in FORMS if s.id in ALIKE), *MOTOR)
"""What can be concealed of laws that it holds."""
LATEST = frozenset({
    "clamp_slip:ratcheting",
    "clock_skew:resynchronised",
    "crosstalk:let_go",
    "gravity_load:sorted",
    "inertial_load:turning_base",
    "position_dependent_friction:fleet_angle",
    "pressure_dependent_friction:ploughed",
    "pretension_relaxation:stretched",
    "pulley_runout:idler",
    "routing_friction:wiper",
    "series_compliance:diaphragm",
    "strand_break:bent_over_drums",
    "strand_friction:bouc_wen",
    "termination_backlash:loosening",
    "viscous_slip:eyring",
})  # fmt: skip
"""Forms that joined last: nothing was tuned on them before they were judged."""
LAWS = {
    "catalogue": CATALOGUE_FORMS,
    "other": OTHER_FORMS,
    "mixed": (*CATALOGUE_FORMS, *OTHER_FORMS),
    "latest": tuple(s for s in OTHER_FORMS if s.id in LATEST),
}
"""What can be concealed, by whose laws are asked for."""


@dataclass(frozen=True)
class Wanted:
    """What was asked for: a seed, kinds of trials, whose laws, how imperfect the world."""

    seed: int
    kinds: tuple[str, ...]
    laws: str
    imperfections: str

    def __post_init__(self) -> None:
        for what, given, known in (
            ("kind", self.kinds, KINDS),
            ("laws", (self.laws,), tuple(LAWS)),
            ("imperfections", (self.imperfections,), IMPERFECTIONS),
        ):
            for name in given:
                if name not in known:
                    raise PlantError(f"{what} is {name!r}; {', '.join(known)} are accepted")
        if self.seed < 0 or not self.kinds:
            raise PlantError(f"seed is {self.seed}; a seed of 0 or more and at least one kind are accepted")


@dataclass(frozen=True)
class Order:
    """What one trial is to hold; `suspects` in no order of size, `case` of one of several sessions, `tie` of
    one in which two explanations coincide."""

    number: int
    kind: str
    suspects: tuple[Suspect, ...]
    case: Case | None = None
    tie: confounded.Case | None = None


def order(wanted: Wanted, number: int, again: int = 0) -> Order:
    """What trial `number` (from 0) is to hold: kinds in turn as they were given (one given twice comes twice as
    often), and each kind's effects in turn. `again`: another pair than those before, which no joint could show."""
    turn, within = divmod(number, len(wanted.kinds))
    kind = wanted.kinds[within]
    place = turn * wanted.kinds.count(kind) + wanted.kinds[:within].count(kind)
    if kind == "sessions":
        return Order(number, kind, (), case_in_turn(wanted.seed, place))
    if kind == "confounded":
        return Order(number, kind, (), tie=_in_turn(wanted.seed, place, confounded.CASES, 1))
    if kind == "none":
        return Order(number, kind, ())
    if kind == "stranger":
        return Order(number, kind, (_in_turn(wanted.seed, place, STRANGERS, 3),))
    if kind == "single":
        effect = _in_turn(wanted.seed, place, CATALOGUE, 4)
        return Order(number, kind, (form_of(wanted, effect, place),))
    if kind == "motor":
        return Order(number, kind, (form_of(wanted, MOTOR[0], place),))
    return Order(number, kind, _pair(wanted, place, again))


def concealable(laws: str) -> tuple[Suspect, ...]:
    """What can be concealed of these laws, and of an effect that has none of them its other forms."""
    there = {_effect(s) for s in LAWS[laws]}
    return (*LAWS[laws], *(s for s in OTHER_FORMS if _effect(s) not in there))


def form_of(wanted: Wanted, effect: Suspect, place: int) -> Suspect:
    """The law by which an effect goes the `place`-th time: the catalogue's, or one of its other forms in turn, of the
    latest of them where it has any and they are asked for."""
    rng = np.random.default_rng([wanted.seed, 5, place])
    laws = wanted.laws
    if laws == "mixed":
        laws = "catalogue" if rng.uniform() < 0.5 else "other"
    forms = [s for s in concealable(laws) if _effect(s) == effect.id]
    return forms[int(rng.integers(len(forms)))]


def _effect(suspect: Suspect) -> str:
    return suspect.id.partition(":")[0]


def _in_turn(seed: int, place: int, pool: Sequence[T], stream: int) -> T:
    """Every one once in each round, in a new order each round."""
    turn, within = divmod(place, len(pool))
    return pool[int(np.random.default_rng([seed, stream, turn]).permutation(len(pool))[within])]


def _pair(wanted: Wanted, place: int, again: int) -> tuple[Suspect, ...]:
    """Two different effects that one course can show."""
    rng = np.random.default_rng([wanted.seed, 2, place, again] if again else [wanted.seed, 2, place])
    while True:
        first, second = (CATALOGUE[int(k)] for k in rng.choice(len(CATALOGUE), 2, replace=False))
        pair = (form_of(wanted, first, 2 * place), form_of(wanted, second, 2 * place + 1))
        if set(pair[0].courses) & set(pair[1].courses):
            return pair
