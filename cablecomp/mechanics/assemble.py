"""From a joint configuration to the kernel's arrays."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cablecomp.config import JointConfig, Stage, ratios_to_last
from cablecomp.errors import InputError
from cablecomp.mechanics import records
from cablecomp.mechanics.change import Change, law_tables
from cablecomp.mechanics.drive import Drive, named
from cablecomp.mechanics.profile import Floats, Ints
from cablecomp.mechanics.records import floats
from cablecomp.mechanics.tables import ELSEWHERE, ON_H, ON_L

BEFORE_NODES = 8  # numbers of a grid before its nodes
SLACK = 1e-6  # tension, as a share of T0, below which a cable counts as slack


@dataclass(frozen=True)
class Model:
    """The kernel's arrays for one joint; `named` says what lies in them.

    `fixed` (its parameters) and `layout` (how much there is of everything, and where) never change; `memory` (all
    numbers) and `heights` (points in use of every profile) are the initial state.
    """

    fixed: Floats
    layout: Ints
    memory: Floats
    heights: Ints
    laws: Any  # law tables (`tables.py`), or None for the plain drive: the compiler tells the two apart

    def named(self, memory: Floats, heights: Ints) -> Drive:
        """The records of this joint in the state `memory`, `heights`; what is written to them is written there."""
        return named(self.fixed, self.layout, memory, heights)


def assemble(config: JointConfig, change: Change | None = None) -> Model:
    """Arrays of the joint in `config` with the physics of `change`; raises InputError for pretensions that
    cannot settle."""
    extra = change or Change()
    stages = config.drive.stage
    closed = int(config.drive.circuit == "closed")
    chained = closed == 0 or config.drive.arrangement == "parallel"
    groups = [list(stages)] if chained else [[stage] for stage in stages]
    ratios = ratios_to_last(stages)
    if chained:
        _check_pretensions(config, ratios)
    circuits = np.zeros(len(groups), records.CIRCUIT)
    chains: list[tuple[float, list[Stage]]] = []  # of cables, each with its sign
    first = 0
    for circuit, group, ratio in zip(circuits, groups, ratios, strict=False):
        circuit.first = first, first + closed * len(group)
        circuit.count, circuit.chains = len(group), 1 + closed
        circuit.ratio = math.prod(stage.ratio for stage in group)
        circuit.share = 1.0 if chained else ratio
        circuit.radius = group[-1].output_radius_m
        circuit.slack = SLACK * group[-1].pretension_N
        chains += [(1.0, group), (-1.0, group)][: 1 + closed]
        first += len(group) * (1 + closed)
    cables = np.concatenate([_chain(group, sign, config, extra) for sign, group in chains])
    sensor = np.zeros(1, records.SENSOR)
    sensor["gain"] = config.sensors.joint_torque_gain
    sensor["offset"] = config.sensors.joint_torque_offset_Nm
    sensor["cutoff"] = 2.0 * np.pi * config.observer.input_filter_Hz
    size = np.zeros(1, records.SIZES)[0]
    size.circuits, size.cables, size.terms = len(circuits), len(cables), len(extra.terms)
    size.stacks = (3 if extra.guide_angle > 0.0 else 2) * len(cables)
    size.capacity = config.observer.max_pieces
    size.grids = 2 * len(cables) if extra.viscous_Ns_per_m_rad > 0.0 else 0
    size.cables_at = len(circuits) * floats(records.CIRCUIT)
    size.sensor_at = (
        size.cables_at + len(cables) * floats(records.CABLE) + sum(len(t.parameters) for t in extra.terms)
    )
    size.context_at = len(cables) * floats(records.STATE)
    size.filter_at = size.context_at + floats(records.CONTEXT)
    size.grids_at = size.filter_at + floats(records.FILTER) + sum(t.state_size for t in extra.terms)
    # without grids the room of their heads is left, as snapshots have it
    size.steps_at = size.grids_at + (
        size.grids * floats(records.GRID) if size.grids else 2 * len(cables) * BEFORE_NODES
    )
    size.profiles_at = size.steps_at + 2 * len(cables) * floats(records.STEP)
    size.spare_at = size.profiles_at + size.stacks * size.capacity * floats(records.POINT)
    terms = np.zeros(len(extra.terms), records.TERM)
    parameters: list[float] = []
    state_at = size.filter_at + floats(records.FILTER)
    for call, term in zip(terms, extra.terms, strict=True):
        call.address = term.address
        call.parameters_at = size.cables_at + len(cables) * floats(records.CABLE) + len(parameters)
        call.state_at = state_at
        parameters += term.parameters
        state_at += term.state_size
    fixed = np.concatenate([circuits.view("f8"), cables.view("f8"), parameters, sensor.view("f8")])
    layout = np.concatenate([size.reshape(1).view("i8"), terms.view("i8")])
    model = Model(
        fixed,
        layout,
        np.zeros(size.spare_at + size.steps_at),
        np.zeros(size.stacks, dtype=np.int64),
        law_tables(extra, config),
    )
    model.named(model.memory, model.heights).context.radius = stages[-1].output_radius_m
    return model


def _chain(group: Sequence[Stage], sign: float, config: JointConfig, extra: Change) -> NDArray[Any]:
    """Records of the cables of one chain, input side first."""
    cables = np.zeros(len(group), records.CABLE)
    last = group[-1]
    for cable, stage, n_i in zip(cables, group, ratios_to_last(group), strict=True):
        cable.radius = stage.output_radius_m, stage.input_radius_m
        cable.mu = stage.mu_output, stage.mu_input
        cable.wrap = stage.wrap_output_rad, stage.wrap_input_rad
        cable.law = ELSEWHERE, ELSEWHERE
        if stage is config.drive.stage[-1]:
            cable.law = (ON_H if sign > 0.0 else ON_L), ELSEWHERE
        cable.length = stage.free_length_m + extra.extra_length_m
        cable.EA, cable.T0 = stage.EA_N, stage.pretension_N
        cable.scale = n_i * last.output_radius_m / stage.output_radius_m
        cable.weight = n_i / stage.output_radius_m
        cable.sign = sign
        cable.ratio = stage.ratio
        cable.guide, cable.guide_length = extra.guide_angle, extra.guide_length_m
        cable.play_share, cable.play_yield = extra.play_share, extra.play_yield_N
        cable.viscous = extra.viscous_Ns_per_m_rad
        cable.merge = config.observer.merge_tolerance
        cable.per_breaking = 0.0 if stage.breaking_force_N is None else 1.0 / stage.breaking_force_N
    return cables


def _check_pretensions(config: JointConfig, ratios: Sequence[float]) -> None:
    """Cables hanging one behind the other settle at T0_i = T0_k N_ik R_k/R_i (thesis 5-1)."""
    last = config.drive.stage[-1]
    for number, (stage, ratio) in enumerate(zip(config.drive.stage, ratios, strict=True), start=1):
        settled = last.pretension_N * ratio * last.output_radius_m / stage.output_radius_m
        if abs(stage.pretension_N - settled) > 1e-3 * settled:
            raise InputError(
                f"{config.name}: key `drive.stage.{number - 1}.pretension_N` is "
                f"{stage.pretension_N:g}; cables in a chain settle at "
                f"{settled:.6g} N there, given the output stage's pretension; write that value"
            )
