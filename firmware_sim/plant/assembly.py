"""From configuration and effects to the records that the compiled plant works on."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from firmware_sim.plant.config import EffectSpec, PlantConfig, StageConfig
from firmware_sim.plant.errors import PlantError
from firmware_sim.plant.mesh import Guides, Resolution, element_lengths, fine_spacing
from firmware_sim.plant.network import winding_in_of, winding_out_of
from firmware_sim.plant.readout import READOUT
from firmware_sim.plant.records import (
    CABLE,
    COUPLING,
    GROOVE_POINTS,
    PLAY,
    PLAYS,
    SHAFT,
    SURROUND,
    TENSILE_POINTS,
    Drive,
    Floats,
    allocate_nodes,
    make_drive,
)

SLACK_RATIO = 1e-6
MIN_PRESLIDING_RAD = 1e-7


@dataclass(frozen=True)
class Tail:
    """A further inertia behind the output pulley, through a spring, a damper and a clearance.

    A chain of them carries encoder and load at its end; a `branch` hangs on the pulley beside them.
    """

    inertia_kgm2: float
    stiffness_Nm_per_rad: float
    damping_Nms_per_rad: float = 0.0
    gap_rad: float = 0.0
    branch: bool = False


Schedule = Callable[[Floats], None]
"""Fills columns of the inputs, one row per sample, from others: what acts over time, whatever the joint does."""

Reading = Callable[[Floats, Floats], None]
"""Changes columns of the outputs by inputs and outputs, one row per sample: what happens between joint and file."""


@dataclass
class Build:
    """What effects may change before the drive is assembled.

    `cables` (output stage first, h before l), `shafts` (motor first), `surround` and `readout` are
    structured arrays; `output` is the index of the output pulley; what `tails` lists comes behind it.
    `schedules` run before a recording is played; of the readings those behind the pulley (`mounts`) come first, then
    `encoders`, then `stamps`. A plant that runs live has none of these.
    """

    config: PlantConfig
    stages: tuple[StageConfig, ...]
    cables: Any
    shafts: Any
    surround: Any
    readout: Any
    plays: Any
    grooves: Floats
    tensile: Floats
    output: int
    dynamic: bool
    tails: list[Tail] = field(default_factory=list)
    extra_compliance: float = 0.0
    gap_rad: float = 0.0
    clock_delay_s: float = 0.0
    schedules: list[Schedule] = field(default_factory=list)
    mounts: list[Reading] = field(default_factory=list)
    encoders: list[Reading] = field(default_factory=list)
    stamps: list[Reading] = field(default_factory=list)

    @property
    def bench_only(self) -> bool:
        """Whether something was asked for that only a recording played on the bench can show."""
        beside = any(tail.branch for tail in self.tails)
        return beside or bool(self.schedules or self.mounts or self.encoders or self.stamps)


@dataclass(frozen=True)
class Joint:
    """An assembled joint: compiled drive, readout record, and what the drivers must know."""

    drive: Drive
    readout: Any
    output: int
    load_shaft: int
    spacing_m: float
    clock_delay_s: float


def settled_stages(config: PlantConfig) -> tuple[StageConfig, ...]:
    """Stages with the pretension that they settle at.

    Where intermediate shafts are held by one cable alone (open circuit, or closed and parallel), their
    balance asks for R_i T0_i = r_{i+1} T0_{i+1}; the output stage's pretension rules (thesis 5-1).
    """
    if len(config.stages) == 1 or (config.circuit == "closed" and config.arrangement == "series"):
        return config.stages
    settled = [config.stages[-1]]
    for stage in reversed(config.stages[:-1]):
        after = settled[0]
        tension = after.pretension_N * after.input_radius_m / stage.output_radius_m
        values = {**stage.__dict__, "pretension_N": tension}
        settled.insert(0, StageConfig(**values))
    return tuple(settled)


def _shaft_plan(config: PlantConfig) -> tuple[list[tuple[int, int, int, int]], int]:
    """(stage, side, shaft_in, shaft_out) of each cable, output stage first, and the number of shafts up to
    the output."""
    n = len(config.stages)
    sides = (0, 1) if config.circuit == "closed" else (0,)
    split = config.circuit == "closed" and config.arrangement == "parallel"
    count = 2 + (n - 1) * (2 if split else 1)
    output = count - 1

    def shaft(position: int, side: int) -> int:
        if position == 0:
            return 0
        if position == n:
            return output
        return 1 + (position - 1) * 2 + side if split else position

    plan = [(s, k, shaft(s, k), shaft(s + 1, k)) for s in reversed(range(n)) for k in sides]
    return plan, count


def start_build(config: PlantConfig, dynamic: bool) -> Build:
    """The plain drive, neutral in every effect."""
    stages = settled_stages(config)
    plan, count = _shaft_plan(config)
    cables = np.zeros(len(plan), dtype=CABLE)
    plays = np.zeros((len(plan), PLAYS), dtype=PLAY)
    for k, (record, (index, side, shaft_in, shaft_out)) in enumerate(zip(cables, plan, strict=True)):
        stage = stages[index]
        # EA_N is stiffness per length of cable in place, as a bench measures it; T = EA (l/l0 − 1) counts
        # from the unstressed length, on which the same cable shows EA_N − T0.
        values = {
            "index": k,
            "shaft_out": shaft_out,
            "shaft_in": shaft_in,
            "side": side,
            "sign": 1.0 - 2.0 * side,
            "R": stage.output_radius_m,
            "r": stage.input_radius_m,
            "wrap_out": stage.wrap_output_rad,
            "wrap_in": stage.wrap_input_rad,
            "free_m": stage.free_length_m,
            "EA": stage.EA_N - stage.pretension_N,
            "EA_whole": stage.EA_N - stage.pretension_N,
            "T0": stage.pretension_N,
            "runout_order": 1.0,
            "guide_count": 1,
            "guide_first": 0.5,
            "drag_exponent": 1.0,
            "drag_speed": 1.0,
            "mu_out": stage.mu_output,
            "mu_in": stage.mu_input,
            "mu_scale": 1.0,
            "guide_scale": 1.0,
            "slack_ratio": SLACK_RATIO,
        }
        plays[k]["zero"] = plays[k]["value"] = plays[k]["tension"] = stage.pretension_N
        for key, value in values.items():
            record[key] = value
    shafts = np.zeros(count, dtype=SHAFT)
    shafts["presliding"] = MIN_PRESLIDING_RAD
    shafts["wall_at"] = math.inf
    last = stages[-1]
    if config.circuit == "open":
        shafts["preload_Nm"][count - 1] = last.output_radius_m * last.pretension_N
    surround = np.zeros(1, dtype=SURROUND)
    surround["is_open"] = config.circuit == "open"
    surround["relax_time_s"] = surround["ageing_count"] = 1.0
    surround["slip_time_s"] = surround["break_time_s"] = math.inf
    readout = np.zeros(1, dtype=READOUT)
    readout["mount_time_s"] = readout["mount_yield_Nm"] = 1.0
    grooves, tensile = np.ones((2 * len(plan), GROOVE_POINTS)), np.zeros((2, TENSILE_POINTS))
    return Build(
        config, stages, cables, shafts, surround, readout, plays, grooves, tensile, count - 1, dynamic
    )


def stage_of(build: Build, cable: int) -> StageConfig:
    """Stage that a cable belongs to (cables are listed output stage first)."""
    per_stage = len(build.cables) // len(build.stages)
    return build.stages[len(build.stages) - 1 - cable // per_stage]


def assemble_joint(build: Build, motor_rad: float, travel_rad: float, resolution: Resolution) -> Joint:
    """Mesh the cables at uniform pretension with the motor at `motor_rad`, and bind everything.

    `travel_rad` is how far the motor may turn from there; a longer way is allowed, less finely resolved.
    """
    _add_tails(build)
    _set_positions(build, motor_rad)
    meshes = [_mesh_cable(build, k, travel_rad, resolution) for k in range(len(build.cables))]
    nodes = allocate_nodes(sum(len(m) + 1 for m in meshes))
    first = 0
    for c, lengths in zip(build.cables, meshes, strict=True):
        count = len(lengths) + 1
        c["first"], c["count"] = first, count
        nodes.y[first + 1 : first + count] = np.cumsum(lengths)
        nodes.l0[first : first + count - 1] = lengths / (1.0 + c["T0"] / c["EA"])
        c["Y"] = nodes.y[first + count - 1]
        c["i_out"], c["i_in"] = first, first + count - 1
        rounding = np.finfo(float).eps * c["Y"] / float(np.min(lengths))
        c["force_tol"] = 1e-9 * c["T0"] + 4.0 * c["EA"] * rounding
        first += count
    nodes.old[:] = nodes.y
    load_shaft = build.output + sum(not tail.branch for tail in build.tails)
    build.surround["load_shaft"], build.surround["output_shaft"] = load_shaft, build.output
    couplings = np.zeros(len(build.tails), dtype=COUPLING)
    for k, tail in enumerate(build.tails):
        couplings[k]["a"] = build.output if tail.branch else build.output + k
        couplings[k]["b"] = build.output + k + 1
        couplings[k]["stiffness"], couplings[k]["damping"] = (
            tail.stiffness_Nm_per_rad,
            tail.damping_Nms_per_rad,
        )
        couplings[k]["gap"] = tail.gap_rad
        # the same loss as the damper gives at a depth of 1e-4 rad
        couplings[k]["flank_loss"] = tail.damping_Nms_per_rad / (tail.stiffness_Nm_per_rad * 1e-4)
    drive = make_drive(
        build.cables,
        build.shafts,
        couplings,
        build.surround,
        nodes,
        build.plays,
        build.grooves,
        build.tensile,
    )
    spacing = min(min(fine_spacing(s, resolution)) for s in build.stages)
    return Joint(drive, build.readout, build.output, load_shaft, spacing, build.clock_delay_s)


def _add_tails(build: Build) -> None:
    build.tails.sort(key=lambda tail: tail.branch)
    extra = np.zeros(len(build.tails), dtype=SHAFT)
    extra["presliding"] = MIN_PRESLIDING_RAD
    extra["wall_at"] = math.inf
    for record, tail in zip(extra, build.tails, strict=True):
        record["inertia"] = tail.inertia_kgm2
    if len(extra) and len(build.shafts) == build.output + 1:
        build.shafts = np.concatenate([build.shafts, extra])


def _set_positions(build: Build, motor_rad: float) -> None:
    """Angles of the rigid drive with the motor at `motor_rad`, and the arcs on the drums."""
    q = build.shafts["q"]
    q[0] = motor_rad
    for c in build.cables[::-1]:
        inside, outside = c["shaft_in"], c["shaft_out"]
        record = _Fields(c)
        whole = winding_out_of(record, 0.0) + winding_in_of(record, 0.0)
        angle = q[inside] * c["r"] / c["R"]
        for _ in range(50):
            error = winding_out_of(record, angle) + winding_in_of(record, q[inside]) - whole
            angle -= c["sign"] * error / c["R"]
        q[outside] = angle
    q[build.output :] = q[build.output]
    for key in ("q_1", "q_2"):
        build.shafts[key] = q
    build.shafts["bristle"] = np.where(build.shafts["friction_kind"] == 0, q, 0.0)


class _Fields:
    """Attribute access to one structured record."""

    def __init__(self, record: Any) -> None:
        self._record = record

    def __getattr__(self, name: str) -> float:
        return float(self._record[name])


def _mesh_cable(build: Build, k: int, travel_rad: float, resolution: Resolution) -> Any:
    c, stage = build.cables[k], stage_of(build, k)
    fields = _Fields(c)
    q = build.shafts["q"]
    on_out = winding_out_of(fields, float(q[c["shaft_out"]]))
    on_in = winding_in_of(fields, float(q[c["shaft_in"]]))
    if on_out < 0.2 * stage.output_radius_m or on_in < 0.2 * stage.input_radius_m:
        raise PlantError(
            f"motor position {q[0]:.3g} rad leaves less than 0.2 rad of cable on a drum; start nearer to zero"
        )
    c["A"] = on_out
    travel_m = 1.05 * travel_rad * stage.input_radius_m * _speed(build, stage) + 0.02 * stage.output_radius_m
    arcs = (on_out, stage.free_length_m + float(c["guide_arc_m"]), on_in)
    guides = Guides(
        int(c["guide_count"]), float(c["guide_first"]), float(c["guide_mu_per_m"] * c["guide_arc_m"])
    )
    return element_lengths(stage, arcs, travel_m, resolution, guides)


def _speed(build: Build, stage: StageConfig) -> float:
    """Turn of a stage's input shaft per turn of the motor."""
    ratio = 1.0
    for other in build.stages:
        if other is stage:
            break
        ratio *= other.input_radius_m / other.output_radius_m
    return ratio


def joint_effects(config: PlantConfig, effects: Sequence[EffectSpec]) -> tuple[EffectSpec, ...]:
    """Effects of the configuration and those given apart, in that order."""
    return (*config.effects, *effects)
