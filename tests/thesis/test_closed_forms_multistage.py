"""Several stages: the equivalent stage against the explicit sum of stages, and stages in series."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from series_forms import series_loading_deflection_rad, series_unloading_deflection_rad

from cablecomp.config import Drive, Stage, ratios_to_last
from cablecomp.errors import InputError
from cablecomp.thesis.closed_forms import closed
from cablecomp.thesis.closed_forms import open as open_
from cablecomp.thesis.closed_forms.stage import (
    equivalent_of,
    equivalent_stage,
    settled_pretensions_N,
)

lengths = st.floats(0.005, 0.2)
frictions = st.floats(0.03, 0.4)
stages = st.builds(
    lambda R, r, length, EA, mu1, mu2, w1, w2: Stage(
        output_radius_m=R,
        input_radius_m=r,
        free_length_m=length,
        EA_N=EA,
        pretension_N=50.0,
        mu_output=mu1,
        mu_input=mu2,
        wrap_output_rad=w1,
        wrap_input_rad=w2,
    ),
    lengths,
    lengths,
    lengths,
    st.floats(5e3, 5e4),
    frictions,
    frictions,
    st.floats(0.5, 15.0),
    st.floats(0.5, 15.0),
)


def settled(drive: Drive) -> Drive:
    tensions = settled_pretensions_N(drive)
    parts = tuple(
        stage.model_copy(update={"pretension_N": float(t)})
        for stage, t in zip(drive.stage, tensions, strict=True)
    )
    return drive.model_copy(update={"stage": parts})


@settings(max_examples=40)
@given(st.lists(stages, min_size=1, max_size=4), st.floats(-0.9, 3.0), st.floats(-0.9, 3.0))
def test_open_equivalent_is_the_explicit_sum(parts: list[Stage], peak: float, now: float) -> None:
    drive = settled(Drive(circuit="open", stage=tuple(parts)))
    one = equivalent_stage(drive)
    M, M_peak = now * one.moment_scale_Nm, peak * one.moment_scale_Nm
    loading, unloading = 0.0, 0.0
    for n, stage in zip(ratios_to_last(drive.stage), drive.stage, strict=True):
        single = equivalent_of(stage)
        loading += n * open_.open_loading_deflection_rad(n * M_peak, single)
        unloading += n * open_.open_unloading_deflection_rad(n * M, n * M_peak, single)
        assert n * M / single.moment_scale_Nm == pytest.approx(now, rel=1e-12, abs=1e-15)  # (5-9)
    assert loading == pytest.approx(
        float(open_.open_loading_deflection_rad(M_peak, one)), rel=1e-10, abs=1e-15
    )
    assert unloading == pytest.approx(
        float(open_.open_unloading_deflection_rad(M, M_peak, one)), rel=1e-9, abs=1e-12
    )
    assert sum(wrap.share for wrap in one.wraps) == pytest.approx(1.0, rel=1e-12)


@settings(max_examples=25)
@given(st.lists(stages, min_size=2, max_size=3), st.floats(0.05, 3.0))
def test_antagonistic_chains_share_their_tensions(parts: list[Stage], m: float) -> None:
    """Kind 1: with the equivalent's tensions both chains' elongations, summed stage by stage,
    cancel (4-1).
    """
    drive = settled(Drive(circuit="closed", arrangement="parallel", stage=tuple(parts)))
    one = equivalent_stage(drive)
    tau = closed.closed_tensions_loading(m, one)
    angles = []
    for t in tau:
        angle = 0.0
        for n, stage in zip(ratios_to_last(drive.stage), drive.stage, strict=True):
            single = equivalent_of(stage)
            angle += n * open_.open_loading_deflection_rad((t - 1.0) * single.moment_scale_Nm, single)
        angles.append(angle)
    if tau.l > 0.0:
        assert angles[0] == pytest.approx(-angles[1], rel=1e-9, abs=1e-13)
    theta = closed.closed_loading_deflection_rad(m * one.moment_scale_Nm, one)
    assert angles[0] == pytest.approx(float(theta), rel=1e-9, abs=1e-14)


@settings(max_examples=25)
@given(stages, st.integers(2, 4), st.floats(0.05, 2.0))
def test_equal_series_stages_reduce_to_one_solution(part: Stage, count: int, m: float) -> None:
    """(5-35): equal stages at pretensions (5-33) have one tension solution, scaled by sum N^2 ...; all m are
    equal.
    """
    drive = Drive(circuit="closed", arrangement="series", stage=(part,) * count)
    tensions = settled_pretensions_N(drive)
    drive = drive.model_copy(
        update={"stage": tuple(part.model_copy(update={"pretension_N": float(t)}) for t in tensions)}
    )
    last = equivalent_of(drive.stage[-1])
    M = m * last.moment_scale_Nm
    shape = closed.closed_loading_normalised(m, last)
    factor = sum(
        n * part.pretension_N / (part.EA_N * last.mu_eff)
        for n, part in zip(ratios_to_last(drive.stage), drive.stage, strict=True)
    )
    assert series_loading_deflection_rad(M, drive) == pytest.approx(float(factor * shape), rel=1e-9)


def test_series_ratios_and_reversal() -> None:
    parts = (
        Stage(output_radius_m=0.03, input_radius_m=0.01, free_length_m=0.05, EA_N=2e4, pretension_N=60.0,
              mu_output=0.12, mu_input=0.15, wrap_output_rad=9.0, wrap_input_rad=14.0),
        Stage(output_radius_m=0.06, input_radius_m=0.012, free_length_m=0.02, EA_N=4e4, pretension_N=150.0,
              mu_output=0.1, mu_input=0.15, wrap_output_rad=9.0, wrap_input_rad=14.0),
    )  # fmt: skip
    drive = Drive(circuit="closed", arrangement="series", stage=parts)
    np.testing.assert_allclose(
        series_unloading_deflection_rad(6.0, 6.0, drive),
        series_loading_deflection_rad(6.0, drive),
        rtol=1e-12,
    )
    assert ratios_to_last(drive.stage) == pytest.approx([0.2, 1.0])
    assert drive.ratio == pytest.approx(0.2 / 3.0)
    with pytest.raises(InputError, match="series"):
        equivalent_stage(drive)
