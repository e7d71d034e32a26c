"""From a joint configuration to the kernel's arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cablecomp.config import JointConfig, Stage
from cablecomp.errors import InputError
from cablecomp.mechanics import layout as o
from cablecomp.mechanics.profile import ROWS, Floats, Ints
from cablecomp.mechanics.viscous import W_HEAD

WET_NODES = 96  # grid nodes of a drum with viscous slip
SLACK = 1e-6  # tension, as a share of T0, below which a cable counts as slack


@dataclass(frozen=True)
class Term:
    """A compiled term: its address, its parameters, the size of its state."""

    address: int
    parameters: tuple[float, ...]
    state_size: int


@dataclass(frozen=True)
class Extension:
    """What effects change in the drive's own parameters; every default is neutral."""

    terms: tuple[Term, ...] = ()
    law: NDArray[np.float64] | None = None
    guide_angle: float = 0.0
    guide_length_m: float = 0.0
    extra_length_m: float = 0.0
    play_share: float = 0.0
    play_yield_N: float = 0.0
    viscous_Ns_per_m_rad: float = 0.0


@dataclass(frozen=True)
class Model:
    """The kernel's arrays for one joint: P and I never change, S and J are the initial state, L the law tables (None = plain)."""

    P: Floats
    I: Ints
    S: Floats
    J: Ints
    L: Any  # law tables, or None for the plain drive: the compiler tells the two apart


def stage_ratios(stages: Sequence[Stage]) -> list[float]:
    """N_ik = product over j = i+1..k of r_j/R_j (thesis 5-22), for every stage i."""
    ratios = [1.0]
    for stage in reversed(stages[1:]):
        ratios.insert(0, ratios[0] * stage.input_radius_m / stage.output_radius_m)
    return ratios


def assemble(config: JointConfig, extension: Extension | None = None) -> Model:
    """Arrays of the joint in `config` with the physics of `extension`; raises InputError for pretensions that cannot settle."""
    extra = extension or Extension()
    stages = config.drive.stage
    closed = int(config.drive.circuit == "closed")
    chained = closed == 0 or config.drive.arrangement == "parallel"
    groups = [list(stages)] if chained else [[stage] for stage in stages]
    ratios = stage_ratios(stages)
    if chained:
        _check_pretensions(config, ratios)
    n_circuits, n_cables = len(groups), len(stages) * (1 + closed)
    joints: list[float] = []
    cables: list[list[float]] = []
    structure: list[int] = []
    for ic, group in enumerate(groups):
        last = group[-1]
        rigid = float(np.prod([s.input_radius_m / s.output_radius_m for s in group]))
        joints += [rigid, ratios[ic] if not chained else 1.0, last.output_radius_m, SLACK * last.pretension_N]
        inner = stage_ratios(group)
        first_h = len(cables)
        for sign in (1.0, -1.0)[: 1 + closed]:
            for n_i, stage in zip(inner, group, strict=True):
                cables.append(_cable(stage, n_i, last, sign, config, extra))
        structure += [first_h, len(group), closed, first_h + len(group) * closed]
    s_cable = 0
    s_context = o.CABLE_STATE * n_cables
    s_filter = s_context + o.CONTEXT
    s_term = s_filter + o.FILTER
    s_wet = s_term + sum(t.state_size for t in extra.terms)
    nodes = WET_NODES if extra.viscous_Ns_per_m_rad > 0.0 else 0
    s_meet = s_wet + (W_HEAD + 4 * nodes) * 2 * n_cables
    s_profile = s_meet + o.MEET * 2 * n_cables
    capacity = config.observer.max_pieces
    n_stacks = (3 if extra.guide_angle > 0.0 else 2) * n_cables
    s_spare = s_profile + n_stacks * ROWS * capacity
    S = np.zeros(s_spare + s_meet)
    p_terms = len(joints) + o.CABLE * n_cables
    p_sensor = p_terms + sum(len(t.parameters) for t in extra.terms)
    header = [
        n_circuits, n_cables, capacity, len(extra.terms), n_stacks, s_profile, s_cable, s_context, s_term, s_wet, nodes,
        s_filter, s_meet, s_spare, p_sensor,
    ]  # fmt: skip
    parameters: list[float] = []
    for term in extra.terms:
        structure += [term.address, p_terms + len(parameters), s_term]
        parameters += term.parameters
        s_term += term.state_size
    sensors = [
        config.sensors.joint_torque_gain,
        config.sensors.joint_torque_offset_Nm,
        2.0 * np.pi * config.observer.input_filter_Hz,
    ]
    P = np.array([*joints, *np.ravel(cables), *parameters, *sensors])
    I = np.array(header + structure, dtype=np.int64)
    S[s_context + o.X_RADIUS] = stages[-1].output_radius_m
    return Model(P, I, S, np.zeros(n_stacks, dtype=np.int64), extra.law)


def _cable(
    stage: Stage, n_i: float, last: Stage, sign: float, config: JointConfig, extra: Extension
) -> list[float]:
    """Parameters of one cable, in the order of the layout."""
    row = [0.0] * o.CABLE
    row[o.R_OUT], row[o.R_IN] = stage.output_radius_m, stage.input_radius_m
    row[o.LENGTH], row[o.EA], row[o.T0] = (
        stage.free_length_m + extra.extra_length_m,
        stage.EA_N,
        stage.pretension_N,
    )
    row[o.MU_OUT], row[o.MU_IN] = stage.mu_output, stage.mu_input
    row[o.W_OUT], row[o.W_IN] = stage.wrap_output_rad, stage.wrap_input_rad
    row[o.SCALE] = n_i * last.output_radius_m / stage.output_radius_m
    row[o.WEIGHT] = n_i / stage.output_radius_m
    row[o.SIGN] = sign
    row[o.RATIO] = stage.input_radius_m / stage.output_radius_m
    row[o.GUIDE], row[o.GUIDE_LENGTH] = extra.guide_angle, extra.guide_length_m
    row[o.PLAY_SHARE], row[o.PLAY_YIELD] = extra.play_share, extra.play_yield_N
    row[o.VISCOUS] = extra.viscous_Ns_per_m_rad
    row[o.JOINT_DRUM] = float(stage is config.drive.stage[-1])
    row[o.MERGE] = config.observer.merge_tolerance
    row[o.PER_BREAKING] = 0.0 if stage.breaking_force_N is None else 1.0 / stage.breaking_force_N
    return row


def _check_pretensions(config: JointConfig, ratios: Sequence[float]) -> None:
    """Cables hanging one behind the other settle at T0_i = T0_k N_ik R_k/R_i (thesis 5-1)."""
    last = config.drive.stage[-1]
    for number, (stage, ratio) in enumerate(zip(config.drive.stage, ratios, strict=True), start=1):
        settled = last.pretension_N * ratio * last.output_radius_m / stage.output_radius_m
        if abs(stage.pretension_N - settled) > 1e-3 * settled:
            raise InputError(
                f"{config.name}: key `drive.stage.{number - 1}.pretension_N` is {stage.pretension_N:g}; cables in a chain settle at "
                f"{settled:.6g} N there, given the output stage's pretension; write that value"
            )
