"""What is left out: here, and nowhere else, recordings and their rows become parts, blocks and folds.

Kept for the end: what nothing is chosen or fitted on (`kept_for_the_end`). Left out in turn: rows of a fit's residual
while models are compared (`make_groups`), recordings or blocks of them for the errors that are reported
(`left_out_in_turn`). Of a residual alone: blocks longer than it remembers (`blocks_by_memory`), and every second block
(`alternate_blocks`).
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.problem import Problem
from cablecomp.signal.autocorrelation import integrated_time_of_parts
from cablecomp.signal.smoothing import BoolArray, FloatArray, IntArray


def cut(length: int, count: int) -> IntArray:
    """The block of each of `length` rows: `count` blocks one after the other, as long as each other to one row."""
    return np.arange(length, dtype=np.int64) * count // length


# --- kept for the end -------------------------------------------------------------------------------------------------


class KeptForTheEnd(NamedTuple):
    """`used`: what is fitted and chosen on; `final`: what nothing is fitted or chosen on; `by`: "recording" or
    "block", what the final ones are."""

    used: tuple[Evidence, ...]
    final: tuple[Evidence, ...]
    by: str


def kept_for_the_end(found: Sequence[Evidence]) -> KeptForTheEnd:
    """Whole recordings where there are enough of them and their sessions have others, else the end of each, by the rows
    on which its joint's angle counts."""
    if len(found) >= LIMITS.final_from:
        final = [e for k, e in enumerate(found) if k % LIMITS.final_every == LIMITS.final_every // 2]
        used = [e for e in found if e not in final]
        lost = {e.session for e in final} - {e.session for e in used}
        used += [e for e in final if e.session in lost]
        final = [e for e in final if e.session not in lost]
        if final:
            return KeptForTheEnd(tuple(used), tuple(final), "recording")
    used, final = [], []
    for e in found:
        counts = e.counted[JOINT].astype(np.int64)
        early = np.cumsum(counts) - counts < int((1.0 - LIMITS.final_share) * counts.sum())
        used.append(_counting(e, early))
        final.append(_counting(e, ~early))
    return KeptForTheEnd(tuple(used), tuple(final), "block")


def _counting(e: Evidence, some: BoolArray) -> Evidence:
    """The recording with only some of its judged rows counted."""
    return replace(e, counted={k: v & some for k, v in e.counted.items()})


# --- left out in turn while models are compared -----------------------------------------------------------------------


@dataclass(frozen=True)
class Groups:
    """Which group each row of the residual belongs to, channel by channel as the residual goes (-1: a penalty
    row, in none). Where whole recordings are left out, how far a recording's zero departs from its session's is a
    row of its own: an offset that follows the load is a compliance, and not the encoder's matter.

    `fold`: groups that are left out together (a recording; a block where there are few recordings). `by`: what the
    folds are.
    """

    block: IntArray
    fold: IntArray
    by: str
    channel: IntArray
    """Number of the output channel that each row belongs to."""

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return int(self.block.max()) + 1

    @property
    def folds(self) -> int:
        """Number of folds."""
        return int(self.fold.max()) + 1


def make_groups(fit: Fit) -> Groups:
    """Blocks of a few memories of the remainder's, within recordings; folds of whole recordings where there are enough
    of them, else of alternating blocks."""
    problem = fit.problem
    owners = [problem.owners(c) for c in problem.channels]
    counts = np.bincount(owners[0], minlength=len(problem.evidence))
    by = kind_of_parts(problem)
    each = _blocks_of_each(fit, owners[0], counts)
    alone = _alone(problem.evidence, by)
    blocks, folds, channels = [], [], []
    for number, (c, own) in enumerate(zip(problem.channels, owners, strict=True)):
        block = np.full(len(own), -1, dtype=np.int64)
        first = 0
        departs, in_fold = (np.full(problem.bases[c].penalty_rows, -1, dtype=np.int64) for _ in range(2))
        zeros = len(problem.evidence) if problem.departs and by != "block" else 0
        for k in range(len(problem.evidence)):
            here = own == k
            # by time, so that a block holds all channels of its time
            block[here] = first + np.linspace(0, each[k], int(here.sum()), endpoint=False).astype(np.int64)
            if k < zeros:
                departs[k] = first + each[k] // 2
            first += each[k]
        in_fold[:zeros] = np.where(alone[:zeros], -1, _fold_of(np.arange(zeros), departs[:zeros], by))
        blocks += [block, departs]
        folds += [np.where(alone[own], -1, _fold_of(own, block, by)), in_fold]
        channels.append(np.full(len(own) + len(departs), number, dtype=np.int64))
    return Groups(np.concatenate(blocks), np.concatenate(folds), by, np.concatenate(channels))


def _blocks_of_each(fit: Fit, owners: IntArray, counts: IntArray) -> list[int]:
    """How many blocks each recording is cut into, by how long the first channel's remainder remembers."""
    first_rows = fit.residual[fit.problem.spans()[fit.problem.channels[0]]]
    parts = [first_rows[owners == k] for k in range(len(counts)) if counts[k] > 8]
    memory = integrated_time_of_parts(parts)
    least, most = LIMITS.blocks
    total = int(np.clip(counts.sum() / (LIMITS.memory * memory), least, most))
    return [max(1, round(total * n / max(counts.sum(), 1))) for n in counts]


def shown_apart(problem: Problem, by: str) -> Collection[str]:
    """Sessions of which what is left shows a value of their own while another part is left out."""
    return problem.sessions if by == "block" else problem.repeated


def kind_of_parts(problem: Problem) -> str:
    """What is left out in turn: whole recordings ("recording") where there are enough, else blocks of rows; blocks,
    too, where sessions have values of their own, zeros apart, that nothing but their one recording tells."""
    own = any(p.session and "_offset_" not in p.base for p in problem.parameters)
    enough = len(problem.evidence) >= LIMITS.recordings
    return "recording" if enough and (not own or len(problem.repeated) > 1) else "block"


def _alone(evidence: Sequence[Evidence], by: str) -> BoolArray:
    """Recordings that alone show how their session's drive stands, where other sessions have several: they are not
    left out, or nothing would tell that session's own values."""
    count = Counter(e.session for e in evidence)
    several = {s for s, n in count.items() if n > 1}
    whole = by == "recording" and len(several) > 1
    return np.array([whole and e.session not in several for e in evidence], dtype=np.bool_)


def _fold_of(own: IntArray, block: IntArray, by: str) -> IntArray:
    return own if by == "recording" else np.asarray(block % LIMITS.folds, dtype=np.int64)


# --- left out in turn for the errors that are reported ----------------------------------------------------------------


class Part(NamedTuple):
    """One of the parts that are left out in turn: `rest`, what is fitted; `out`, what is then predicted."""

    rest: list[Evidence]
    out: list[Evidence]


def left_out_in_turn(evidence: Sequence[Evidence], by: str) -> list[Part]:
    """A few parts of whole recordings (`by` "recording"), or of blocks of each recording ("block")."""
    count = LIMITS.parts
    if by == "recording":
        turn = ~_alone(evidence, by)
        place = np.where(turn, (np.cumsum(turn) - 1) % count, -1)
        return [
            Part(
                [e for e, p in zip(evidence, place, strict=True) if p != k],
                [e for e, p in zip(evidence, place, strict=True) if p == k],
            )
            for k in range(min(count, int(turn.sum())))
        ]
    fold = [_out_of_step(cut(len(e.rows), LIMITS.part_blocks), count) for e in evidence]
    return [
        Part(
            [_counting(e, f != k) for e, f in zip(evidence, fold, strict=True)],
            [_counting(e, f == k) for e, f in zip(evidence, fold, strict=True)],
        )
        for k in range(count)
    ]


def _out_of_step(block: IntArray, count: int) -> IntArray:
    """The part of each block: every round of `count` begins two further on, or a recording of as many cycles as there
    are rounds would lose one phase of all of them, and its load or end of travel with it."""
    return np.asarray((block + 2 * (block // count)) % count, dtype=np.int64)


# --- blocks of a residual ---------------------------------------------------------------------------------------------


def blocks_by_memory(
    parts: Sequence[FloatArray], taus: float = 8.0, fewest: int = 20, most: int = 60
) -> IntArray:
    """The block of every sample of a residual (one part a recording): contiguous, within one recording, about `taus`
    integrated times long.

    The number of blocks stays between `fewest` and `most` as far as the recordings allow; with a memory
    longer than that, blocks are dependent and their evidence is to be taken with care.
    """
    samples = sum(len(part) for part in parts)
    tau = integrated_time_of_parts([part / np.std(part) if np.std(part) > 0 else part for part in parts])
    total = int(np.clip(samples / (taus * tau), fewest, most))
    blocks, first = [], 0
    for part in parts:
        count = max(1, round(total * len(part) / samples))
        blocks.append(first + cut(len(part), count))
        first += count
    return np.concatenate(blocks)


@dataclass(frozen=True)
class Layout:
    """Which samples are fitted and which are held out.

    `block`: number of the block of each sample, contiguous, within one recording; `heldout`, `training`: whether the
    sample's block is held out or fitted.
    """

    block: IntArray
    heldout: BoolArray
    training: BoolArray


def alternate_blocks(starts: IntArray, samples: int, direction: FloatArray) -> Layout:
    """Cut recordings into an even number of alternating training and held-out blocks.

    Each block holds about two reversals of the load (of `direction`: -1, 0, +1 per sample) if the recording
    has enough of them, so that either half has seen loading and unloading; there are 16 to 40 blocks in all.
    A recording alone is cut into at least 4 blocks if it has 40 samples or more.

    Raises InputError if there are fewer than 40 samples.
    """
    if samples < 40:
        raise InputError(f"judging needs 40 samples or more, found {samples}; record longer")
    turns = np.flatnonzero(np.diff(direction) != 0.0)
    wanted = 2 * ((int(np.clip(len(turns) // 2, 16, 40)) + 1) // 2)
    blocks, first = [], 0
    for a, b in itertools.pairwise(np.append(starts, samples)):
        least = 4 if b - a >= 40 else 1
        count = int(np.clip(round(wanted * (b - a) / samples), least, max(1, (b - a) // 10)))
        blocks.append(first + cut(int(b - a), count))
        first += count
    block = np.concatenate(blocks)
    return Layout(block, block % 2 == 1, block % 2 == 0)
