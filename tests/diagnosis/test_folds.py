"""What is left out in turn: each row once, and no session without a recording that tells how its drive stood."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cablecomp.diagnosis.folds import kept_for_the_end, kind_of_parts, left_out_in_turn
from cablecomp.estimation.evidence import JOINT, Evidence


def recording(name: str, session: str) -> Evidence:
    time = np.arange(60.0)
    rows = np.arange(60)
    return Evidence(
        name, session, {}, {"time_s": time}, rows, {JOINT: np.ones(60, dtype=np.bool_)}, np.ones(60)
    )


@pytest.mark.parametrize("sessions", ["aabb", "abcd", "aaaa", "aabbc", "aaaaabbbbbc"])
def test_recordings_are_left_out_once_and_never_all_that_tell_a_sessions_drive(sessions: str) -> None:
    evidence = [recording(str(k), s) for k, s in enumerate(sessions)]
    several = {s for s, n in Counter(sessions).items() if n > 1}
    parts = left_out_in_turn(evidence, "recording")
    out = [e.name for part in parts for e in part.out]
    kept = {e.name for e in evidence if len(several) > 1 and e.session not in several}
    assert sorted(out) == sorted({e.name for e in evidence} - kept)
    for part in parts:
        assert {e.name for e in part.out} | {e.name for e in part.rest} == {e.name for e in evidence}
        assert not {e.name for e in part.out} & {e.name for e in part.rest}
        assert part.rest
        if len(several) > 1:
            assert {e.session for e in part.out} <= {e.session for e in part.rest}


@pytest.mark.parametrize("read", [60, 33])
def test_the_end_is_kept_of_what_was_read(read: int) -> None:
    """A recording whose joint's angle is missing from some row on: the last rows that have one are kept."""
    whole = recording("0", "one")
    kept = kept_for_the_end([replace(whole, counted={JOINT: np.arange(60) < read})])
    used, final = (e[0].counted[JOINT] for e in (kept.used, kept.final))
    assert np.flatnonzero(final).tolist() == list(range(int(0.85 * read), read))
    assert np.array_equal(used | final, np.arange(60) < read)
    assert not np.any(used & final)


def test_blocks_are_left_out_once() -> None:
    evidence = [recording(str(k), "one") for k in range(2)]
    parts = left_out_in_turn(evidence, "block")
    for k in range(2):
        counted = np.sum([part.out[k].counted[JOINT] for part in parts], axis=0)
        assert np.array_equal(counted, np.ones(60))
        for part in parts:
            assert not np.any(part.out[k].counted[JOINT] & part.rest[k].counted[JOINT])


@pytest.mark.parametrize("cycles", [2, 3, 4, 5, 6, 10])
def test_no_phase_of_a_motion_is_left_out_in_all_its_cycles(cycles: int) -> None:
    phase = np.arange(60) % (60 // cycles)
    for part in left_out_in_turn([recording("0", "one")], "block"):
        assert set(phase[part.rest[0].counted[JOINT]]) == set(phase)


@pytest.mark.parametrize(
    ("sessions", "own", "what"),
    [
        ("abc", "", "block"),  # too few
        ("abcd", "", "recording"),
        ("abcd", "pretension_N", "block"),  # only its one recording tells how tight a session's cables are
        ("aabb", "pretension_N", "recording"),
        ("abcd", "joint_torque_offset_Nm", "recording"),
    ],
)
def test_what_a_session_alone_tells_is_not_left_out_as_a_whole(sessions: str, own: str, what: str) -> None:
    named = [SimpleNamespace(base=own, session=s) for s in dict.fromkeys(sessions) if own]
    common = SimpleNamespace(base="EA_N", session=None)
    repeated = frozenset(s for s, n in Counter(sessions).items() if n > 1)
    problem: Any = SimpleNamespace(evidence=list(sessions), repeated=repeated, parameters=[common, *named])
    assert kind_of_parts(problem) == what
