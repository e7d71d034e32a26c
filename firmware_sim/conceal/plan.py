"""Which trials: pieces of the recordings, of each one twin with nothing concealed and one trial of every
physics, sizes in turn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from firmware_sim.conceal.physics import (
    JOINT,
    NEIGHBOUR,
    PHYSICS,
    TIME,
    WARMTH,
    Change,
    Floats,
    Physics,
    Table,
)
from firmware_sim.errors import SimError

TWIN = "twin"


@dataclass(frozen=True)
class Trial:
    """One trial: its round, what is concealed (`twin`: nothing), the recordings as a diagnosis sees them."""

    number: int
    round: int
    physics: Physics | None
    share: float
    change: Change | None
    recordings: tuple[dict[str, Floats], ...]

    def truth(self) -> dict[str, Any]:
        """Everything that is true of it, as plain data."""
        p, numbers = self.physics, {} if self.change is None else dict(self.change.numbers)
        return {
            "trial": self.number,
            "round": self.round,
            "physics": TWIN if p is None else p.id,
            "named": [] if p is None else list(p.named),
            "shows_in": [] if p is None else list(p.shows_in),
            "calibrates": p is not None and p.calibrates,
            "share": self.share,
            "size": None if p is None else numbers["size"] * p.per_unit,
            "unit": "" if p is None else p.unit,
            "words": "nothing" if p is None else p.words,
            "numbers": numbers,
        }


def trials_of(
    pieces: Sequence[Sequence[Table]], seed: int, only: Sequence[str] = ()
) -> tuple[list[Trial], dict[str, str]]:
    """All trials of these pieces (one round each), and why a physics cannot be concealed in them, by its id.

    `only`: ids of the physics that are concealed, where not all are. What is concealed depends on seed, round and
    piece, not on the other trials. In every round each physics has another of its sizes, so that as many rounds as
    there are sizes hold every one once; first comes the third. Raises SimError for an unknown physics.
    """
    known = [p.id for p in PHYSICS]
    for name in only:
        if name not in known:
            raise SimError(f"physics is {name!r}; {', '.join(known)} are accepted")
    found: list[Trial] = []
    missing: dict[str, str] = {}
    for r, piece in enumerate(pieces):
        tables = _with_companions(np.random.default_rng([seed, 31, r]), piece)
        found.append(Trial(len(found), r, None, 0.0, None, tables))
        for k, physics in enumerate(PHYSICS):
            if only and physics.id not in only:
                continue
            share = physics.shares[_turn(r, k)]
            change = physics.make(np.random.default_rng([seed, 32, r, k]), tables, share)
            if change is None:
                missing[physics.id] = _WHY.get(physics.id, "its torque would need a joint torque that varies")
                continue
            found.append(Trial(len(found), r, physics, share, change, _changed(tables, change)))
    return found, missing


_WHY = {
    "drift": "a temperature that stands still moves nothing",
    "play": "it would need a joint torque that changes its sign",
}


def _turn(round_: int, place: int) -> int:
    """Which size a physics has in a round: the third first, then the others, each physics in an order of its own."""
    others = (0, 1, 3)
    return (2, *others[place % 3 :], *others[: place % 3])[round_ % 4]


def _changed(tables: Sequence[Table], change: Change) -> tuple[dict[str, Floats], ...]:
    found = []
    for t, added in zip(tables, change.added, strict=True):
        found.append({**t, change.channel: t[change.channel] + added})
    return tuple(found)


def _with_companions(rng: np.random.Generator, piece: Sequence[Table]) -> tuple[dict[str, Floats], ...]:
    """The piece with a neighbour's channel, and a temperature where none was recorded: in twins and trials alike."""
    found = []
    for table in piece:
        time = table[TIME]
        mine = {NEIGHBOUR: _holds(rng, time) + 0.002 * rng.standard_normal(len(time))}
        if WARMTH not in table:
            mine[WARMTH] = _swing(rng, time)
        found.append({**table, **mine})
    return tuple(found)


def _holds(rng: np.random.Generator, time: Floats) -> Floats:
    """Holds and smooth changes between −1 and 1, each a second or a few long."""
    knots = [float(time[0])]
    while knots[-1] < time[-1]:
        knots.append(knots[-1] + float(rng.uniform(0.6, 3.0)))
    values = rng.uniform(-1.0, 1.0, len(knots))
    place = np.clip(np.searchsorted(knots, time, side="right") - 1, 0, len(knots) - 2)
    since = time - np.asarray(knots)[place]
    share = np.clip(since / 0.4, 0.0, 1.0)
    ease = share**3 * (10.0 + share * (6.0 * share - 15.0))
    before = np.concatenate([values[:1], values])[place]
    return np.asarray(before + ease * (values[place] - before))


def _swing(rng: np.random.Generator, time: Floats) -> Floats:
    phase = (time - time[0]) / max(float(time[-1] - time[0]), 1e-9)
    wave = np.sin(2.0 * np.pi * (phase * rng.uniform(0.8, 1.6) + rng.uniform()))
    return np.asarray(22.0 + 4.0 * wave + 0.02 * rng.standard_normal(len(time)))


def usable(piece: Sequence[Mapping[str, Floats]]) -> bool:
    """Whether a joint's angle can be changed in every recording of a piece."""
    return bool(piece) and all(JOINT in t and np.count_nonzero(np.isfinite(t[JOINT])) > 10 for t in piece)
