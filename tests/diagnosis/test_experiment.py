"""The next experiment: inside the joint's limits, and what it sets apart differs."""

from __future__ import annotations

import numpy as np
import pytest
from turning import LIMITED, recorded

from cablecomp.config import JointConfig, with_values
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


def apart(a: JointConfig, b: JointConfig, seen: Covariates) -> float:
    found = best_experiment([a, b], seen, FLOOR_RAD, 20.0)
    assert found is not None
    return found.separation


def test_a_bearing_is_set_apart_from_a_mount_and_nothing_from_itself(seen: Covariates) -> None:
    assert apart(MOUNT, MOUNT, seen) == pytest.approx(0.0, abs=1e-6)
    assert apart(MOUNT, BEARING, seen) > 1.0


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
