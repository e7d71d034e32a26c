"""What stands in for an effect, and what does not though it predicts as well."""

from __future__ import annotations

import pytest
from turning import JOINT, recorded

from cablecomp.diagnosis.body import gather_body
from cablecomp.diagnosis.explain.hypotheses import hypotheses
from cablecomp.diagnosis.explain.rivals import lesser
from cablecomp.diagnosis.explain.scores import ScoreDifference


@pytest.mark.parametrize(
    ("term", "gain", "z", "stands_back"),
    [
        ("clamp_slip", 0.1, 3.0, True),
        ("clamp_slip", -0.005, -1.5, True),  # a tie, however steady
        ("clamp_slip", -0.05, -0.3, True),  # ahead, as chance has it
        ("clamp_slip", -0.05, -1.2, False),
        ("strand_break", -0.05, -0.3, False),  # claims no less
        ("gravity_load", 0.1, 3.0, False),  # no step
    ],
)
def test_an_event_that_does_no_clearly_better_than_a_step_stands_in_for_none(
    term: str, gain: float, z: float, stands_back: bool
) -> None:
    asked = {h.name: h for h in hypotheses(JOINT, gather_body(JOINT, {"a/1": recorded()}).used)}
    event = "clamp_slip" if term == "strand_break" else "strand_break"
    against = {event: ScoreDifference(gain, z, z), "routing_friction": ScoreDifference(gain, z, z)}
    others = [asked[event], asked["routing_friction"]]
    assert lesser(asked[term], others, against) == ((event,) if stands_back else ())
    assert lesser(asked[term], others, {}) == ()
