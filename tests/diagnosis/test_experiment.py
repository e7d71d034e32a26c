"""The next experiment: inside the joint's limits, and what it sets apart differs."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from turning import LIMITED, recorded

from cablecomp.config import JointConfig, with_values
from cablecomp.diagnosis.answer.entries import next_experiment
from cablecomp.diagnosis.explain.experiment import best_experiment, candidates
from cablecomp.diagnosis.locate.covariates import Covariates, covariates
from cablecomp.effects import with_effects
from cablecomp.errors import InputError
from cablecomp.observer import Observer

FLOOR_RAD = 2e-5
MOUNT = with_effects(LIMITED, [("series_compliance", {"compliance_rad_per_Nm": 2e-3})])
BEARING = with_effects(
    LIMITED, [("bearing_friction", {"torque_Nm": 0.05, "load_coefficient": 0.0, "presliding_rad": 2e-4})]
)

NEIGHBOUR = with_effects(LIMITED, [("crosstalk", {"load_coefficient": 0.1, "channel": "other_arm_Nm"})])


@pytest.fixture(scope="module")
def seen() -> Covariates:
    return covariates(recorded(LIMITED))


def test_every_protocol_stays_inside_the_limits(seen: Covariates) -> None:
    limits = LIMITED.limits.model_copy(update={"joint_position_min_rad": -0.5, "joint_position_max_rad": 0.4})
    config = LIMITED.model_copy(update={"limits": limits})
    for protocol in candidates(config, seen):
        asked = [protocol.reference(t) for t in np.linspace(0.0, protocol.duration_s, 500)]
        assert max(abs(a.joint_torque_Nm) for a in asked) <= 1.6 * (1.0 + 1e-9), protocol.name
        assert min(a.joint_position_rad for a in asked) >= -0.5, protocol.name
        assert max(a.joint_position_rad for a in asked) <= 0.4, protocol.name


def test_where_no_limit_is_stated_nothing_goes_beyond_what_was_recorded(seen: Covariates) -> None:
    bare = LIMITED.model_copy(update={"limits": type(LIMITED.limits)()})
    most = float(np.max(np.abs(seen.values["load"])))
    for protocol in candidates(bare, seen):
        asked = [protocol.reference(t).joint_torque_Nm for t in np.linspace(0.0, protocol.duration_s, 500)]
        assert np.max(np.abs(asked)) <= most * (1.0 + 1e-9), protocol.name


def test_a_joint_whose_load_is_neither_recorded_nor_limited_is_only_moved(seen: Covariates) -> None:
    bare = LIMITED.model_copy(update={"limits": type(LIMITED.limits)()})
    free = Covariates(**{**vars(seen), "values": {**seen.values, "load": np.zeros_like(seen.values["load"])}})
    protocols = candidates(bare, free)
    low, high = (f(seen.values["joint_angle"]) for f in (np.min, np.max))
    for protocol in protocols:
        asked = [protocol.reference(t) for t in np.linspace(0.0, protocol.duration_s, 500)]
        assert {a.joint_torque_Nm for a in asked} == {0.0}, protocol.name
        assert low <= min(a.joint_position_rad for a in asked), protocol.name
        assert max(a.joint_position_rad for a in asked) <= high, protocol.name
    loaded = {p.name for p in candidates(bare, seen)}
    assert {p.name for p in protocols} < loaded


def apart(a: JointConfig, b: JointConfig, seen: Covariates) -> float:
    found = best_experiment([a, b], seen, FLOOR_RAD, 20.0)
    assert found is not None
    return found.separation


def test_a_bearing_is_set_apart_from_a_mount_and_nothing_from_itself(seen: Covariates) -> None:
    assert apart(MOUNT, MOUNT, seen) == pytest.approx(0.0, abs=1e-6)
    assert apart(MOUNT, BEARING, seen) > 1.0


def test_nothing_is_proposed_that_sets_no_models_apart(seen: Covariates) -> None:
    """A protocol whose answers are alike costs an afternoon at the bench: a note says what would help."""

    def proposed(final: JointConfig, *others: JointConfig) -> tuple[object, tuple[str, ...]]:
        def fitted(joint: JointConfig) -> Any:
            problem = SimpleNamespace(
                joint=lambda *_: joint, evidence=[SimpleNamespace(columns=recorded(LIMITED))]
            )
            return SimpleNamespace(fit=SimpleNamespace(problem=problem, x=np.zeros(0)))

        rivals = [
            SimpleNamespace(term=SimpleNamespace(name=str(k)), model=fitted(other))
            for k, other in enumerate(others)
        ]
        selection: Any = SimpleNamespace(final=fitted(final), rounds=[SimpleNamespace(tried=rivals)])
        case: Any = SimpleNamespace(
            drive=SimpleNamespace(fit=fitted(MOUNT).fit, floor_rad=FLOOR_RAD), covariates=[seen]
        )
        outcome: Any = SimpleNamespace(weighed=[SimpleNamespace(rivals=[r.term.name for r in rivals])])
        return next_experiment(case, selection, outcome, [])

    experiment, notes = proposed(MOUNT, BEARING)
    assert experiment is not None
    assert not notes
    # a neighbour that is at rest is told from a bearing; of more models it is left out
    assert proposed(BEARING, NEIGHBOUR)[0] is not None
    assert proposed(MOUNT, BEARING, NEIGHBOUR) == (experiment, notes)
    nothing, (note,) = proposed(MOUNT, MOUNT)
    assert nothing is None
    assert "by more than 0.0 noise floors" in note
    assert (
        "a further channel (motor_torque_Nm, tension_h_N, tension_l_N), a closer" in note
    )  # the load was recorded


def test_what_a_straight_line_in_the_load_explains_sets_nothing_apart(seen: Covariates) -> None:
    """A mount that yields differs from the plain drive by just that."""
    assert apart(LIMITED, MOUNT, seen) < 0.01 * apart(LIMITED, BEARING, seen)


def test_a_protocol_that_a_model_cannot_follow_is_not_proposed(seen: Covariates) -> None:
    """A slack cable bears no load: motion without one is left."""
    slack = with_values(LIMITED, {"pretension_N": 1e-3, "EA_N": 1.0})
    with pytest.raises(InputError):
        Observer(slack).run(recorded(LIMITED))
    found = best_experiment([LIMITED, slack], seen, FLOOR_RAD, 20.0)
    assert found is not None
    assert all(found.protocol.reference(t).joint_torque_Nm == 0.0 for t in (0.0, 1.0, 2.0))
