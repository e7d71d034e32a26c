"""Viscous slip: friction between cable and pulley that grows with slip speed (Snow's time-dependent deflection)."""

from __future__ import annotations

from collections.abc import Mapping

from cablecomp.config import JointConfig
from cablecomp.effects.base import Change, Effect, Parameter


def _change(values: Mapping[str, float], config: JointConfig) -> Change:
    return Change(
        viscous_Ns_per_m_rad=max(values["coefficient_Ns_per_m_rad"], 0.0), viscous_skew=values["drum"]
    )


def _unit(config: JointConfig) -> float:
    """The coefficient at which the stretch diffuses over one radian of the output pulley in one second: EA/R."""
    stage = config.drive.stage[-1]
    return stage.EA_N / stage.output_radius_m


EFFECT = Effect(
    id="viscous_slip",
    statement="Where cable slides on a pulley, friction grows with slip speed, so "
    "that deflection lags the load, creeps on "
    "while the load holds, and the drive is stiffer the faster it is loaded.",
    equation="|dT/dtheta| = mu T + c v while sliding at speed v, mu and the stretch by whatever laws they have: it "
    "diffuses through the sliding zone, R d(eps)/dt = dv/dtheta; c (1 + s) on output drums, c (1 - s) on input drums",
    source="Snow 1993, sections 3.3 and 4.3 (observed, unexplained)",
    parameters=(
        Parameter(
            "coefficient_Ns_per_m_rad",
            "N s/(m rad)",
            0.0,
            1e-5,
            1e3,
            "viscous coefficient",
            log=True,
            scale=_unit,
        ),
        Parameter(
            "drum",
            "-",
            0.0,
            -1.0,
            1.0,
            "s, on which drums: 1 the output's alone, -1 the input's alone",
            role="shape",
            omitted=0.0,
            minimum=-1.0,
            maximum=1.0,
            tries=(-1.0, 1.0),
        ),
    ),
    acts_through=("dwell", "load_rate", "load_direction", "velocity"),
    rates=True,
    saturates=True,
    bounded=False,
    change=_change,
)
