"""From a joint configuration to the kernel's arrays."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any, TypeAlias

import numpy as np

from cablecomp.config import JointConfig, Stage, ratios_to_last
from cablecomp.errors import InputError
from cablecomp.mechanics import records
from cablecomp.mechanics.change import Change, law_tables
from cablecomp.mechanics.drive import Drive, named
from cablecomp.mechanics.profile import Floats, Ints
from cablecomp.mechanics.records import floats
from cablecomp.mechanics.tables import ELSEWHERE, IN_H, IN_L, ON_H, ON_L

Row: TypeAlias = tuple[Any, ...]
"""A record by the order of its fields."""

_FIELDS = {
    record: itemgetter(*(record.names or ()))
    for record in (records.CIRCUIT, records.CABLE, records.SIZES, records.TERM, records.SENSOR)
}
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
    circuits, chains = _circuits(config)
    cables = [row for sign, group in chains for row in _chain(group, sign, config, extra)]
    size = _places(len(circuits), len(cables), config.observer.max_pieces, extra)
    fixed = np.concatenate(
        [
            np.array(circuits, records.CIRCUIT).view("f8"),
            np.array(cables, records.CABLE).view("f8"),
            [parameter for term in extra.terms for parameter in term.parameters],
            _sensor(config),
        ]
    )
    layout = np.concatenate(
        [
            np.array([_row(records.SIZES, **size)], records.SIZES).view("i8"),
            np.array(_terms(extra, size), records.TERM).view("i8"),
        ]
    )
    memory = np.zeros(size["spare_at"] + size["steps_at"])
    context = memory[size["context_at"] : size["filter_at"]].view(records.CONTEXT)
    context["radius"] = config.drive.stage[-1].output_radius_m
    heights = np.zeros(size["stacks"], dtype=np.int64)
    return Model(fixed, layout, memory, heights, law_tables(extra, config))


def _circuits(config: JointConfig) -> tuple[list[Row], list[tuple[float, list[Stage]]]]:
    """Records of the circuits in series, and the chains of cables in them, each with its sign."""
    stages = config.drive.stage
    closed = int(config.drive.circuit == "closed")
    chained = closed == 0 or config.drive.arrangement == "parallel"
    groups = [list(stages)] if chained else [[stage] for stage in stages]
    ratios = ratios_to_last(stages)
    if chained:
        _check_pretensions(config, ratios)
    rows: list[Row] = []
    chains: list[tuple[float, list[Stage]]] = []
    first = 0
    for group, ratio in zip(groups, ratios, strict=False):
        rows.append(
            _row(
                records.CIRCUIT,
                first=(first, first + closed * len(group)),
                count=len(group),
                chains=1 + closed,
                ratio=math.prod(stage.ratio for stage in group),
                share=1.0 if chained else ratio,
                radius=group[-1].output_radius_m,
                slack=SLACK * group[-1].pretension_N,
            )
        )
        chains += [(1.0, group), (-1.0, group)][: 1 + closed]
        first += len(group) * (1 + closed)
    return rows, chains


def _places(circuits: int, cables: int, capacity: int, extra: Change) -> dict[str, int]:
    """How much there is of everything, and where it begins in the flat arrays: the fields of `records.SIZES`."""
    stacks = (3 if extra.guide_angle > 0.0 else 2) * cables
    grids = 2 * cables if extra.viscous_Ns_per_m_rad > 0.0 else 0
    # without grids the room of their heads is left, as snapshots have it
    grids_room = grids * floats(records.GRID) if grids else 2 * cables * BEFORE_NODES
    cables_at = circuits * floats(records.CIRCUIT)
    parameters_at = cables_at + cables * floats(records.CABLE)
    context_at = cables * floats(records.STATE)
    filter_at = context_at + floats(records.CONTEXT)
    grids_at = filter_at + floats(records.FILTER) + sum(term.state_size for term in extra.terms)
    spans = cables if extra.play_spread > 0.0 else 0
    plays_at = grids_at + grids_room
    steps_at = plays_at + spans * records.PLAYS * floats(records.PLAY)
    guides = cables if extra.guide_angle > 0.0 else 0
    guides_at = steps_at + 2 * cables * floats(records.STEP)
    profiles_at = guides_at + guides * floats(records.GUIDE)
    return {
        "circuits": circuits,
        "cables": cables,
        "stacks": stacks,
        "terms": len(extra.terms),
        "capacity": capacity,
        "grids": grids,
        "spans": spans,
        "guides": guides,
        "cables_at": cables_at,
        "sensor_at": parameters_at + sum(len(term.parameters) for term in extra.terms),
        "context_at": context_at,
        "filter_at": filter_at,
        "grids_at": grids_at,
        "plays_at": plays_at,
        "steps_at": steps_at,
        "guides_at": guides_at,
        "profiles_at": profiles_at,
        "spare_at": profiles_at + stacks * capacity * floats(records.POINT),
    }


def _terms(extra: Change, size: Mapping[str, int]) -> list[Row]:
    """Records of the terms, their parameters one behind the other before the sensor, their states before the grids."""
    parameters_at = size["cables_at"] + size["cables"] * floats(records.CABLE)
    state_at = size["filter_at"] + floats(records.FILTER)
    rows = []
    for term in extra.terms:
        end_at = state_at + term.state_size
        rows.append(
            _row(
                records.TERM,
                address=term.address,
                parameters_at=parameters_at,
                state_at=state_at,
                ring_at=end_at - term.ring_size,
                end_at=end_at,
            )
        )
        parameters_at += len(term.parameters)
        state_at = end_at
    return rows


def _sensor(config: JointConfig) -> Row:
    """Record of the torque sensor and of the input filter."""
    return _row(
        records.SENSOR,
        gain=config.sensors.joint_torque_gain,
        offset=config.sensors.joint_torque_offset_Nm,
        cutoff=2.0 * np.pi * config.observer.input_filter_Hz,
    )


def _row(record: np.dtype[Any], **values: Any) -> Row:
    """One record by the names of its fields; setting them one by one in numpy's records took most of the time."""
    row: Row = _FIELDS[record](values)
    return row


def _chain(group: Sequence[Stage], sign: float, config: JointConfig, extra: Change) -> list[Row]:
    """Records of the cables of one chain, input side first."""
    last = group[-1]
    return [
        _row(
            records.CABLE,
            radius=(stage.output_radius_m, stage.input_radius_m),
            mu=(stage.mu_output, stage.mu_input),
            wrap=(stage.wrap_output_rad, stage.wrap_input_rad),
            law=_laws(stage, sign, config, extra),
            length=stage.free_length_m * (1.0 - extra.guide_spread) + extra.extra_length_m,
            EA=stage.EA_N,
            T0=stage.pretension_N,
            scale=n_i * last.output_radius_m / stage.output_radius_m,
            weight=n_i / stage.output_radius_m,
            sign=sign,
            ratio=stage.ratio,
            guide=extra.guide_angle * (1.0 + sign * extra.guide_skew),
            guide_length=extra.guide_length_m + extra.guide_spread * stage.free_length_m,
            guide_place=extra.guide_place,
            play_share=extra.play_share,
            play_yield=extra.play_yield_N,
            play_time=extra.play_time_s,
            play_spread=extra.play_spread,
            play_grading=extra.play_grading,
            play_pressed=extra.play_pressed,
            viscous=extra.viscous_Ns_per_m_rad,
            viscous_on=(1.0 + extra.viscous_skew, 1.0 - extra.viscous_skew),
            merge=config.observer.merge_tolerance,
            per_breaking=0.0 if stage.breaking_force_N is None else 1.0 / stage.breaking_force_N,
        )
        for stage, n_i in zip(group, ratios_to_last(group), strict=True)
    ]


def _laws(stage: Stage, sign: float, config: JointConfig, extra: Change) -> tuple[int, int]:
    """Law tables of a cable's output drum and of its input drum: the joint's and the motor's have their own where their
    grooves are uneven."""
    first, last = config.drive.stage[0], config.drive.stage[-1]
    on_joint, on_motor = (ON_H, IN_H) if sign > 0.0 else (ON_L, IN_L)
    uneven_out = stage is last and extra.joint_angle_factor is not None
    uneven_in = stage is first and extra.motor_angle_factor is not None
    return on_joint if uneven_out else ELSEWHERE, on_motor if uneven_in else ELSEWHERE


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
