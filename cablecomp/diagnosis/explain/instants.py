"""When an event may have happened: where a recording has a before and an after of it."""

from __future__ import annotations

from collections.abc import Sequence

from cablecomp.diagnosis.thresholds import LIMITS
from cablecomp.estimation.evidence import JOINT, Evidence


def instants(evidence: Sequence[Evidence], *, between: bool) -> tuple[float, ...]:
    """Times at which an event is asked for: even over what counts, well inside of a recording, and, if `between`,
    between recordings of one session; between sessions the joint was taken apart."""
    spans = []
    for k, e in enumerate(evidence):
        spans.append(inside_of(e))
        if between and k and evidence[k - 1].session == e.session:
            last = float(evidence[k - 1].columns["time_s"][-1])
            spans.append((last, float(e.columns["time_s"][0])))
    inside = [s for s in spans if s[1] > s[0]]
    length = sum(b - a for a, b in inside)
    found = []
    for a, b in inside:
        count = max(1, round(LIMITS.instants * (b - a) / length))
        found += [a + (b - a) * (k + 0.5) / count for k in range(count)]
    return tuple(found)


def inside_of(e: Evidence) -> tuple[float, float]:
    """From when to when an event in a recording has a before and an after that show it [s]."""
    time = e.columns["time_s"][e.rows[e.counted[JOINT]]] if e.counted[JOINT].any() else e.columns["time_s"]
    margin = LIMITS.edge * float(time[-1] - time[0])
    return float(time[0]) + margin, float(time[-1]) - margin
