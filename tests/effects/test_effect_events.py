"""How slips and breaks go: at once, evenly, in steps, by what exceeds a clamp's hold."""

from __future__ import annotations

import numpy as np
import pytest
from effect_cases import joint, run, still

from cablecomp.errors import InputError

LONG = 400.0  # m of free span: the wraps hardly matter beside it


@pytest.mark.parametrize(
    ("effect", "amount"), [("clamp_slip", {"slip_m": 2e-3}), ("strand_break", {"fraction": 0.3})]
)
def test_an_event_that_takes_its_time_goes_evenly(effect: str, amount: dict[str, float]) -> None:
    """Slowly means the same as ever so many sudden ones: after a share of the time the joint stands where that share of
    the amount at once leaves it, while load and motor rest."""
    config = joint(free_length_m=LONG)
    time = np.linspace(0.0, 4.0, 81)
    columns = still(time, np.full(81, 0.4))
    plain = run(config, columns)["deflection_rad"]
    slowly = (
        run(config, columns, (effect, {**amount, "time_s": 1.0, "duration_s": 2.0}))["deflection_rad"] - plain
    )
    for at, share in ((1.5, 0.25), (2.5, 0.75), (3.5, 1.0)):
        part = {name: share * value for name, value in amount.items()}
        once = run(config, columns, (effect, {**part, "time_s": at}))["deflection_rad"] - plain
        k = int(np.argmin(np.abs(time - at)))
        assert slowly[k] == pytest.approx(once[k], rel=1e-3)
        assert abs(once[k]) > 1e-3
    assert slowly[time < 1.0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("effect", "amount"), [("clamp_slip", {"slip_m": 2e-3}), ("strand_break", {"fraction": 0.3})]
)
def test_an_event_in_steps_is_as_many_sudden_ones(effect: str, amount: dict[str, float]) -> None:
    """Three steps, at 1, 2 and 3 s, the second twice and the third five times as large as the first: between them the
    joint stands where that part at once leaves it."""
    config = joint(free_length_m=LONG)
    time = np.linspace(0.0, 4.0, 81) + 0.01
    columns = still(time, np.full(81, 0.4))
    plain = run(config, columns)["deflection_rad"]
    after, size = {"second_after_s": 1.0, "third_after_s": 2.0}, {"second_size": 2.0, "third_size": 5.0}
    course = {"time_s": 1.0, **after, **size}
    steps = run(config, columns, (effect, {**amount, **course}))["deflection_rad"] - plain
    for first, last, share in ((0.0, 1.0, 0.0), (1.0, 2.0, 1 / 8), (2.0, 3.0, 3 / 8), (3.0, 4.0, 1.0)):
        part = {name: share * value for name, value in amount.items()}
        once = run(config, columns, (effect, {**part, "time_s": first}))["deflection_rad"] - plain
        here = (time > first) & (time < last)
        assert steps[here] == pytest.approx(once[here], rel=1e-3, abs=1e-12)


@pytest.mark.parametrize(
    ("effect", "amount"), [("clamp_slip", {"slip_m": 2e-3}), ("strand_break", {"fraction": 0.3})]
)
def test_an_event_may_settle_or_get_quicker(effect: str, amount: dict[str, float]) -> None:
    """After a quarter of its two seconds a sixteenth of it by the square; turned about, all but nine sixteenths."""
    config = joint(free_length_m=LONG)
    time = np.linspace(0.0, 4.0, 81)
    columns = still(time, np.full(81, 0.4))
    plain = run(config, columns)["deflection_rad"]
    k = int(np.argmin(np.abs(time - 1.5)))
    for curve, share in ((0.5, 0.4375), (2.0, 0.0625)):
        course = {"time_s": 1.0, "duration_s": 2.0, "curve": curve}
        found = run(config, columns, (effect, {**amount, **course}))["deflection_rad"] - plain
        part = {name: share * value for name, value in amount.items()}
        once = run(config, columns, (effect, {**part, "time_s": 1.0}))["deflection_rad"] - plain
        assert found[k] == pytest.approx(once[k], rel=1e-3)
        whole = run(config, columns, (effect, {**amount, "time_s": 1.0}))["deflection_rad"] - plain
        assert found[-1] == pytest.approx(whole[-1], rel=1e-3)


def test_steps_whose_size_is_left_out_are_alike() -> None:
    config = joint(free_length_m=LONG)
    time = np.linspace(0.0, 4.0, 401)
    columns = still(time, np.full(401, 0.4))
    course = {"fraction": 0.3, "time_s": 1.0, "second_after_s": 1.5}
    found = run(config, columns, ("strand_break", course))["deflection_rad"]
    jumps = np.diff(found)
    assert time[1:][np.abs(jumps) > 1e-6] == pytest.approx([1.0, 2.5], abs=0.011)
    first, second = jumps[np.abs(jumps) > 1e-6]
    assert second == pytest.approx(first, rel=0.3)  # a softer cable yields more to each further wire


@pytest.mark.parametrize("cable", ["", "_l"])
def test_a_clamp_that_holds_so_much_creeps_by_the_excess(cable: str) -> None:
    """Closed circuit with so long a free span that what is let go is cable: under a steady load ds/dt = r (T - T_c),
    with the tension falling by ds EA/L; nothing while T < T_c."""
    config = joint(free_length_m=LONG)
    stage = config.drive.stage[0]
    time = np.linspace(0.0, 20.0, 2001)
    way = 1.0 if cable == "" else -1.0
    unit = stage.output_radius_m * stage.pretension_N
    holds, rate = 1.1 * stage.pretension_N, 2e-3
    columns = still(time, np.full(len(time), way * 0.6 * unit))
    found = run(config, columns, ("clamp_slip", {f"creep{cable}_m_per_Ns": rate, f"holds{cable}_N": holds}))
    tension = found["tension_h_N" if cable == "" else "tension_l_N"]
    over = tension - holds
    assert over[0] > 0.15 * stage.pretension_N
    assert over[-1] < 0.5 * over[0]
    # both cables share what one lets go: each loses half of it as stretch
    lost = rate * np.concatenate([[0.0], np.cumsum(0.5 * (over[1:] + over[:-1]) * np.diff(time))])
    stiffness = stage.EA_N / (
        LONG + stage.output_radius_m / stage.mu_output + stage.input_radius_m / stage.mu_input
    )
    assert tension[0] - tension == pytest.approx(0.5 * lost * stiffness, rel=0.02, abs=1e-6)
    other = ("clamp_slip", {f"creep{cable}_m_per_Ns": rate, f"holds{cable}_N": 2.0 * stage.pretension_N})
    plain = run(config, columns)["deflection_rad"]
    assert run(config, columns, other)["deflection_rad"] == pytest.approx(plain, abs=1e-15)


def test_a_slip_without_an_instant_is_refused_in_one_line() -> None:
    with pytest.raises(InputError, match="`clamp_slip` lacks key `time_s`, when it slipped"):
        run(joint(), still(np.zeros(3), np.zeros(3)), ("clamp_slip", {"slip_m": 1e-4}))


@pytest.mark.parametrize(
    ("after", "said"),
    [
        (
            {"second_after_s": 2.0, "third_after_s": 1.0},
            "give them in rising order, from `second_after_s` on",
        ),
        (
            {"third_after_s": 1.0},
            "has third_after_s = 1; give them in rising order, from `second_after_s` on",
        ),
        ({"second_after_s": 1.0, "third_size": 2.0}, "`effect.third_after_s`, when that step comes, is not"),
        ({"second_after_s": 1.0, "duration_s": 2.0}, "both are given; leave one of them out"),
    ],
)
def test_steps_out_of_order_or_beside_a_duration_are_refused_in_one_line(
    after: dict[str, float], said: str
) -> None:
    with pytest.raises(InputError, match=said) as told:
        run(
            joint(),
            still(np.zeros(3), np.zeros(3)),
            ("strand_break", {"fraction": 0.1, "time_s": 0.0, **after}),
        )
    assert "\n" not in str(told.value)


def test_a_curve_of_what_happens_at_once_is_refused_in_one_line() -> None:
    sudden = {"slip_m": 1e-4, "time_s": 0.0, "curve": 2.0}
    with pytest.raises(
        InputError, match=r"`effect.duration_s`, the time that it shapes, is 0; give it above 0"
    ):
        run(joint(), still(np.zeros(3), np.zeros(3)), ("clamp_slip", sudden))
