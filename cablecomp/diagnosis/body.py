"""Several recordings as one body of evidence: sessions, conditions, one clock, what is kept for the end."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path, PurePath
from typing import Literal

import numpy as np

from cablecomp.config import JointConfig, claimed_by
from cablecomp.diagnosis.folds import kept_for_the_end
from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.errors import InputError
from cablecomp.estimation.departures import FEWEST
from cablecomp.estimation.evidence import JOINT, MOTOR, OUTPUTS, Evidence, load_channel
from cablecomp.estimation.gather import gather, rows_for
from cablecomp.estimation.parallel import in_processes
from cablecomp.estimation.standing import ONE_CLAIM, apart_of, claimed_as, stated_of
from cablecomp.signal.smoothing import FloatArray

Sessions = Literal["folder", "each", "one"]
Columns = Mapping[str, FloatArray]


@dataclass(frozen=True)
class Body:
    """`names`: all recordings, in order; `used`, `final`, `final_by`: as `KeptForTheEnd` has them."""

    names: tuple[str, ...]
    used: tuple[Evidence, ...]
    final: tuple[Evidence, ...]
    final_by: str

    @property
    def whole_for_the_end(self) -> tuple[Evidence, ...]:
        """Recordings of which nothing is used before the end."""
        return tuple(f for f in self.final if f.name not in {u.name for u in self.used})

    @property
    def clock_s(self) -> dict[str, float]:
        """When recordings that start their own clock begin it on that of all together."""
        return {e.name: e.shift_s for e in (*self.used, *self.whole_for_the_end) if e.shift_s}

    @property
    def sessions(self) -> dict[str, list[str]]:
        """Recordings of each session."""
        found: dict[str, list[str]] = {}
        for e in (*self.used, *self.whole_for_the_end):
            found.setdefault(e.session, []).append(e.name)
        return found


def session_names(config: JointConfig, names: Sequence[str], mode: Sessions | None = None) -> dict[str, str]:
    """The session of each recording: as `[[session]]` claims it (one that is a part of a mounting: that), else its
    folder (`each`: its own, `one`: all together). Raises InputError for one that several claim."""
    found = {}
    paths = {name: PurePath(name) for name in names}
    files, folders = _told_apart(set(paths.values())), _told_apart({p.parent for p in paths.values()})
    for name, path in paths.items():
        claimed = claimed_by(config, Path(name), ONE_CLAIM) if mode is None else None
        if claimed:
            found[name] = claimed.mounting or claimed.name
        elif mode == "each":
            found[name] = files[path]
        else:
            found[name] = "all" if mode == "one" else (folders[path.parent] or "all")
    return found


def short(recording: str) -> str:
    """A recording's name with the folder that it is in."""
    return "/".join(recording.replace("\\", "/").split("/")[-2:])


def paths_apart(recordings: Sequence[str]) -> dict[str, str]:
    """Each recording's name with the folder that it is in, and with as many above as tell it from the others."""
    parts = {name: name.replace("\\", "/").split("/") for name in recordings}
    found = {}
    for name, mine in parts.items():
        ends = (mine[-k:] for k in range(2, len(mine)))
        alone = (end for end in ends if sum(p[-len(end) :] == end for p in parts.values()) == 1)
        found[name] = "/".join(next(alone, mine))
    return found


def _told_apart(paths: Set[PurePath]) -> dict[PurePath, str]:
    """Each by its last part, or whole where another has the same."""
    count = Counter(p.name for p in paths)
    return {p: p.name if count[p.name] == 1 else str(p) for p in paths}


def gather_body(
    config: JointConfig,
    recordings: Mapping[str, Columns],
    mode: Sessions | None = None,
    rows: int | None = None,
) -> Body:
    """Clean and thin all recordings, those of one clock in order of time; raises InputError for one that lacks what is
    needed."""
    names = list(recordings)
    if not names:
        raise InputError("no recording was given; a diagnosis needs one or more")
    _need_alike(config, recordings)
    sessions = session_names(config, names, mode)
    samples = [len(recordings[n]["time_s"]) for n in names]
    wanted = LIMITS.rows if rows is None else rows
    fine, judged = rows_for(samples, max(wanted, LIMITS.rows_each * len(names)))

    def gathered(k: int) -> Evidence:
        name = names[k]
        e = gather(config, name, recordings[name], sessions[name], fine_rows=fine[k], judged_rows=judged[k])
        return replace(e, condition=_conditions(config, e))

    found = []
    after = -np.inf
    for e in _in_order(in_processes(gathered, range(len(names)))):
        begin, end = float(e.columns["time_s"][0]), float(e.columns["time_s"][-1])
        if begin < after:  # every recording starts its own clock: one goes on after the other
            shift = after + 1.0 - begin
            e = replace(e, columns={**e.columns, "time_s": e.columns["time_s"] + shift}, shift_s=shift)
            end += shift
        after = end
        stated = stated_of(config, Path(e.name), recordings[e.name])
        motor_is_load = load_channel(config, e.columns) == MOTOR
        apart = apart_of(config, stated, shift_s=e.shift_s, motor_is_load=motor_is_load)
        found.append(replace(e, apart=apart, claimed=claimed_as(config, Path(e.name))))
    return Body(tuple(e.name for e in found), *kept_for_the_end(found))


def _in_order(evidence: Iterable[Evidence]) -> list[Evidence]:
    """In order of time where none begins before another has ended, as recordings of one clock; else as given."""
    given = list(evidence)
    by_time = sorted(given, key=lambda e: float(e.columns["time_s"][0]))
    apart = all(a.columns["time_s"][-1] <= b.columns["time_s"][0] for a, b in pairwise(by_time))
    return by_time if apart else given


def read_by_all(config: JointConfig, evidence: Sequence[Evidence]) -> tuple[str, ...]:
    """Output channels that are fitted: those that count somewhere in every recording, and in one of them at enough
    instants to tell what is left of them, but for that of the load."""
    load = load_channel(config, evidence[0].columns)
    return tuple(c for c in OUTPUTS if c != load and (c == JOINT or _counts(c, evidence)))


def _counts(channel: str, evidence: Sequence[Evidence]) -> bool:
    count = [int(e.counted[channel].sum()) if channel in e.counted else 0 for e in evidence]
    return min(count) > 0 and max(count) > FEWEST


def read_by_some(config: JointConfig, evidence: Sequence[Evidence]) -> dict[str, list[str]]:
    """Output channels that are left out because some recordings lack them, with those recordings that have them: where
    they count or, if they count nowhere, where they were read."""
    load, fitted = load_channel(config, evidence[0].columns), read_by_all(config, evidence)
    some = {}
    for c in (c for c in OUTPUTS if c not in (load, *fitted)):
        read = [e for e in evidence if c in e.counted]
        some[c] = [short(e.name) for e in [e for e in read if e.counted[c].any()] or read]
    return {c: names for c, names in some.items() if names}


def spread(evidence: Sequence[Evidence], most: int) -> tuple[Evidence, ...]:
    """At most about `most` recordings, even in order, every session and condition among them."""
    if len(evidence) <= most:
        return tuple(evidence)
    chosen = {int(k) for k in np.linspace(0, len(evidence) - 1, most)}
    seen = {(evidence[k].session, *evidence[k].condition.values()) for k in chosen}
    for k, e in enumerate(evidence):
        key = (e.session, *e.condition.values())
        if key not in seen:
            seen.add(key)
            chosen.add(k)
    return tuple(e for k, e in enumerate(evidence) if k in chosen)


def _need_alike(config: JointConfig, recordings: Mapping[str, Columns]) -> None:
    """Raise InputError for a recording without times, or without the channel that is others' load."""
    loads = {n: load_channel(config, c) for n, c in recordings.items()}
    load = MOTOR if MOTOR in loads.values() else "joint_torque_Nm"
    loaded = {n for n, channel in loads.items() if channel == load}
    for name, columns in recordings.items():
        if not len(columns.get("time_s", ())):
            raise InputError(f"{name}: channel `time_s` is missing or empty; record it")
        if loaded and name not in loaded:
            raise InputError(
                f"{name}: channel `{load}` is missing, which {min(loaded)} has for its load; diagnose recordings with "
                "and without it on their own"
            )


def _conditions(config: JointConfig, e: Evidence) -> dict[str, float]:
    values = {}
    for condition, channel in config.condition.items():
        if channel not in e.columns:
            raise InputError(
                f"{e.name}: channel `{channel}` is missing, which [condition] `{condition}` names; record it, or take "
                "that line out of the joint"
            )
        values[condition] = float(np.median(e.columns[channel]))
    return values
