"""Effects between the pulley and its encoder."""

from __future__ import annotations

import numpy as np
import pytest
from effect_cases import excitation, joint, run, still

from cablecomp.effects import with_effects
from cablecomp.errors import InputError
from cablecomp.observer import Observer
from cablecomp.signals import Sample

JOINTS = ("snow-closed-rig", "snow-open-rig", "two-stage-series")


@pytest.mark.parametrize("name", JOINTS)
def test_series_compliance_adds_in_proportion(name: str) -> None:
    config = joint(name)
    columns = excitation(config)
    plain = run(config, columns)
    found = run(config, columns, ("series_compliance", {"compliance_rad_per_Nm": 3e-3}))
    expected = plain["deflection_rad"] + 3e-3 * columns["joint_torque_Nm"]
    assert found["deflection_rad"] == pytest.approx(expected, abs=1e-12)
    assert found["tension_h_N"] == pytest.approx(plain["tension_h_N"], rel=1e-12)


def test_a_mount_that_rests_on_a_stop_yields_one_way() -> None:
    config = joint()
    columns = excitation(config)
    load, plain = columns["joint_torque_Nm"], run(config, columns)["deflection_rad"]
    for skew, soft, hard in ((1.0, 2.0, 0.0), (-0.4, 0.6, 1.4)):
        mount = ("series_compliance", {"compliance_rad_per_Nm": 3e-3, "skew": skew})
        gave = run(config, columns, mount)["deflection_rad"] - plain
        assert gave == pytest.approx(3e-3 * np.where(load > 0.0, soft, hard) * load, abs=1e-12)


def test_a_coupling_stiffens_from_its_own_slope_to_a_contacts() -> None:
    """In proportion to small loads, as their 2/3 power (Hertz) to large ones."""
    config = joint()
    columns = excitation(config)
    load, plain = columns["joint_torque_Nm"], run(config, columns)["deflection_rad"]
    for stiffening, expected in (
        (1e-6, 3e-3 * load),
        (1e6, 3e-3 * np.cbrt(load * load / 1e6) * np.sign(load)),
    ):
        mount = ("series_compliance", {"compliance_rad_per_Nm": 3e-3, "stiffening_per_Nm": stiffening})
        gave = run(config, columns, mount)["deflection_rad"] - plain
        assert gave == pytest.approx(expected, rel=1e-6, abs=1e-12)


def test_a_seat_softens_from_its_own_slope_to_the_loads_square() -> None:
    config = joint()
    columns = excitation(config)
    load, plain = columns["joint_torque_Nm"], run(config, columns)["deflection_rad"]
    for softening, expected in ((1e-6, 3e-3 * load), (1e4, 30.0 * load * np.abs(load))):
        law = {"compliance_rad_per_Nm": 3e-3, "stiffening_per_Nm": softening, "power": 2.0}
        mount = ("series_compliance", law)
        gave = run(config, columns, mount)["deflection_rad"] - plain
        assert gave == pytest.approx(expected, rel=1e-6, abs=1e-6)


def test_rubber_gives_way_exponentially_to_a_step_of_load_and_lags_a_ramp() -> None:
    config, lag = joint(), 0.3
    time = np.linspace(0.0, 3.0, 601)
    mount = ("series_compliance", {"late_rad_per_Nm": 2e-3, "lag_s": lag})
    for load, expected in (
        (np.where(time > 0.5, 0.4, 0.0), 0.4 * (1.0 - np.exp(-np.maximum(time - 0.5, 0.0) / lag))),
        (0.1 * time, 0.1 * (time - lag * (1.0 - np.exp(-time / lag)))),
    ):
        columns = still(time, load)
        late_by = run(config, columns, mount)["deflection_rad"] - run(config, columns)["deflection_rad"]
        step = load[1] - load[0] == 0.0
        assert late_by == pytest.approx(2e-3 * expected, abs=2e-3 * (0.4 * 0.005 / lag if step else 1e-9))


def test_plastic_goes_on_giving_way_over_decades() -> None:
    """Two decades about 0.5 s: a third each with 0.05, 0.5 and 5 s."""
    config = joint()
    time = np.linspace(0.0, 20.0, 2001)
    columns = still(time, np.where(time > 0.5, 0.4, 0.0))
    mount = ("series_compliance", {"late_rad_per_Nm": 2e-3, "lag_s": 0.5, "decades": 2.0})
    late_by = run(config, columns, mount)["deflection_rad"] - run(config, columns)["deflection_rad"]
    since = np.maximum(time - 0.505, 0.0)
    expected = np.mean([1.0 - np.exp(-since / lag) for lag in (0.05, 0.5, 5.0)], axis=0)
    assert late_by == pytest.approx(8e-4 * expected, abs=8e-4 * 0.035)
    assert late_by[-1] == pytest.approx(8e-4 * expected[-1], rel=1e-3)


def test_compliance_and_clearance_see_what_passes_the_load_path() -> None:
    """A moment that enters beside the torque channel bends the mount as well."""
    config = joint()
    columns = excitation(config)
    leak = ("crosstalk", {"channel": "other_neighbour_Nm", "load_coefficient": 0.5})
    path = columns["joint_torque_Nm"] + 0.5 * columns["other_neighbour_Nm"]
    without = run(config, columns, leak)["deflection_rad"]
    bent = run(config, columns, ("series_compliance", {"compliance_rad_per_Nm": 1e-3}), leak)[
        "deflection_rad"
    ]
    loose = run(config, columns, ("termination_backlash", {"gap_rad": 2e-3}), leak)["deflection_rad"]
    far = np.abs(path) > 0.05
    assert bent - without == pytest.approx(1e-3 * path, abs=1e-12)
    assert (loose - without)[far] == pytest.approx(1e-3 * np.sign(path)[far], abs=1e-9)


@pytest.mark.parametrize("compliance", [1.0e-4, 4.0474e-4, 1.5176e-3, 0.03, 0.3])
def test_the_load_is_found_behind_a_mount_of_any_softness(compliance: float) -> None:
    """Newton's steps by the cables alone go back and forth where the mount yields as much as they do."""
    config = joint()
    columns = excitation(config, 120, moving=False)
    soft = with_effects(config, [("series_compliance", {"compliance_rad_per_Nm": compliance})])
    observer = Observer(soft)
    observer.run({key: value[:90] for key, value in columns.items()})
    for load in (-0.9, -0.2, 0.05, 0.3, 0.9):
        sample = Sample(float(columns["time_s"][90]), 0.0, load, temperature_degC=21.0)
        reading = observer.peek(sample).joint_position_rad
        asked = sample._replace(joint_position_rad=reading, joint_torque_Nm=float("nan"))
        assert observer.inverse(asked).joint_torque_Nm == pytest.approx(load, abs=1e-6)


def test_backlash_jumps_by_its_gap_at_zero_load() -> None:
    config = joint()
    time = np.linspace(0.0, 1.0, 801)
    columns = still(time, np.sin(12.0 * time))
    step = run(config, columns, ("termination_backlash", {"gap_rad": 5e-4}))["deflection_rad"]
    step -= run(config, columns)["deflection_rad"]
    load = columns["joint_torque_Nm"]
    unit = config.drive.stage[0].output_radius_m * config.drive.stage[0].pretension_N
    assert step[load > 0.02 * unit] == pytest.approx(2.5e-4, rel=1e-6)
    assert step[load < -0.02 * unit] == pytest.approx(-2.5e-4, rel=1e-6)
    assert np.all(np.diff(step[np.argsort(load)]) >= -1e-15)


def test_a_coupling_of_two_stages_has_a_slope_in_each() -> None:
    config = joint()
    columns = excitation(config)
    load, plain = columns["joint_torque_Nm"], run(config, columns)["deflection_rad"]
    first = 0.4 * float(np.max(np.abs(load)))
    for beyond, second in ((0.2, 6e-4), (5.0, 1.5e-2)):
        law = {"compliance_rad_per_Nm": 3e-3, "stage_Nm": first, "beyond": beyond}
        gave = run(config, columns, ("series_compliance", law))["deflection_rad"] - plain
        at = np.array([-5.0 * first, -first, first, 5.0 * first])
        curve = np.array([-1.0, 0.0, 0.0, 1.0]) * 4.0 * first * second + 3e-3 * np.clip(at, -first, first)
        assert gave == pytest.approx(np.interp(load, at, curve), abs=1e-12)
    assert np.max(np.abs(load)) > 2.0 * first


def test_a_mount_is_softer_and_a_gap_wider_at_some_angles_than_at_others() -> None:
    """Of order 2, the more the further the joint stands from 0.3 rad; 1.5 and 0.5 of it at most and at least."""
    config = joint()
    columns = excitation(config)
    plain, load = run(config, columns), columns["joint_torque_Nm"]
    aside = plain["joint_position_rad"] - 0.3
    factor = 1.5 * np.sin(aside) ** 2 + 0.5 * np.cos(aside) ** 2
    wave = {"swing": 0.5, "order": 2.0}
    soft = ("series_compliance", {"compliance_rad_per_Nm": 1e-3, **wave, "softest_rad": 0.6 - np.pi})
    bent = run(config, columns, soft)["deflection_rad"] - plain["deflection_rad"]
    assert bent == pytest.approx(1e-3 * load * factor, abs=1e-12)
    worn = ("termination_backlash", {"gap_rad": 2e-3, **wave, "widest_rad": 0.6 - np.pi})
    loose = run(config, columns, worn)["deflection_rad"] - plain["deflection_rad"]
    far = np.abs(load) > 0.05
    assert loose[far] == pytest.approx((1e-3 * np.sign(load) * factor)[far], abs=1e-9)
    assert np.ptp(factor) > 0.4


def test_springs_close_a_gap_bit_by_bit_about_their_preload() -> None:
    config = joint()
    time = np.linspace(0.0, 1.0, 801)
    columns = still(time, 0.6 * np.sin(12.0 * time))
    key = ("termination_backlash", {"gap_rad": 5e-4, "closes_Nm": 0.1, "preload_Nm": 0.2})
    step = run(config, columns, key)["deflection_rad"] - run(config, columns)["deflection_rad"]
    expected = 2.5e-4 * np.tanh((columns["joint_torque_Nm"] - 0.2) / 0.1)
    assert step == pytest.approx(expected, abs=1e-12)


def test_of_two_gaps_in_a_row_one_opens_at_its_preload() -> None:
    config = joint()
    time = np.linspace(0.0, 1.0, 801)
    columns = still(time, 0.6 * np.sin(12.0 * time))
    law = {"gap_rad": 5e-4, "preload_Nm": 0.2, "preloaded": 0.3}
    step = run(config, columns, ("termination_backlash", law))["deflection_rad"]
    step -= run(config, columns)["deflection_rad"]
    load = columns["joint_torque_Nm"]
    apart = np.minimum(np.abs(load), np.abs(load - 0.2)) > 0.02
    expected = 2.5e-4 * (0.7 * np.sign(load) + 0.3 * np.sign(load - 0.2))
    assert step[apart] == pytest.approx(expected[apart], abs=1e-9)


def test_a_key_that_wedges_leaves_its_flank_only_where_it_is_drawn_out() -> None:
    config = joint()
    time = np.linspace(0.0, 3.0, 1201)
    columns = still(time, np.where(time < 1.5, 0.6, 0.15) * np.cos(9.0 * time))
    step = run(config, columns, ("termination_backlash", {"gap_rad": 5e-4, "wedges_Nm": 0.2}))[
        "deflection_rad"
    ]
    step -= run(config, columns)["deflection_rad"]
    flank, expected = 1.0, []
    for load in columns["joint_torque_Nm"]:
        if abs(load) >= 0.2:
            flank = np.sign(load)
        expected.append(2.5e-4 * flank)
    assert np.ptp(expected) > 0.0
    assert np.all(np.diff(expected[605:]) == 0.0)  # not drawn out again
    assert step == pytest.approx(np.array(expected), abs=1e-9)


def test_a_gap_has_one_law() -> None:
    both = with_effects(
        joint(), [("termination_backlash", {"gap_rad": 1e-3, "drag_Nm": 0.1, "closes_Nm": 0.1})]
    )
    with pytest.raises(InputError, match="leave out either"):
        Observer(both)


def test_a_greased_gap_is_crossed_at_the_loads_speed() -> None:
    """b M/J: under a load that turns over and stays, the key comes over after J/M seconds."""
    config = joint()
    time = np.linspace(0.0, 2.0, 2001)
    columns = still(time, np.where(time < 0.5, 0.4, -0.4))
    gap, impulse = 5e-4, 0.2
    greased = ("termination_backlash", {"gap_rad": gap, "impulse_Nms": impulse})
    step = run(config, columns, greased)["deflection_rad"] - run(config, columns)["deflection_rad"]
    over = np.clip(0.4 * (time - 0.5) / impulse, 0.0, 1.0)
    assert step == pytest.approx(gap * (0.5 - over), abs=gap * 3e-3)


def test_a_link_that_drags_stands_still_while_the_pulley_turns_under_it() -> None:
    """Unloaded, the motor back and forth: the joint is the play of the gap's width over the pulley, from amid it on."""
    config = joint()
    time = np.linspace(0.0, 6.0, 1201)
    columns = still(time, np.zeros(1201), motor=0.4 * np.sin(2.0 * time))
    gap = 2e-2
    drags = ("termination_backlash", {"gap_rad": gap, "drag_Nm": 0.05})
    pulley = run(config, columns)["joint_position_rad"]
    link = run(config, columns, drags)["joint_position_rad"]
    place, expected = 0.0, []
    for before, now in zip([pulley[0], *pulley[:-1]], pulley, strict=True):
        place = min(max(place - (now - before), -0.5 * gap), 0.5 * gap)
        expected.append(now + place)
    assert link == pytest.approx(np.array(expected), abs=1e-9)
    assert np.mean(np.abs(np.diff(link)) < 1e-12) > 0.05
