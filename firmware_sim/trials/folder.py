"""A trial's folder: what a diagnosis may see, and beside it the truth."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np

from firmware_sim.plant import EFFECTS, FORMS
from firmware_sim.trials.order import LAWS, Wanted
from firmware_sim.trials.seal import ANGLES, TRUTH, truth_text
from firmware_sim.trials.spoil import UNITS, coarser
from firmware_sim.trials.strangers import STRANGERS
from firmware_sim.trials.world import Hidden, World
from firmware_sim.trials.writing import JOINT_FILE, joint_toml, observer_parameters, write_recording

RECORDINGS, MOTOR_TORQUE = "recordings", "motor_torque_Nm"
IN_MOTOR_TORQUE = frozenset(s.id for s in (*LAWS["mixed"], *STRANGERS) if s.motor_torque)
"""What shows in the motor's torque alone."""


def write_world(folder: Path, world: World, wanted: Wanted) -> None:
    """Write recordings, configuration and truth; the folder appears whole or not at all."""
    spare = folder.with_name(folder.name + ".part")
    shutil.rmtree(spare, ignore_errors=True)
    write_public(spare, world)
    (spare / TRUTH).write_text(truth_text(full_truth(world, wanted)), encoding="utf-8")
    np.savez_compressed(spare / ANGLES, **true_angles(world))
    spare.rename(folder)


def write_public(folder: Path, world: World) -> None:
    """Write what a diagnosis may see: recordings and nominal configuration."""
    for k, leg in enumerate(world.legs):
        path = folder / recording_file(world, k)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_recording(path, leg.recorded.channels)
    (folder / JOINT_FILE).write_text(public_joint(world), encoding="utf-8")


def recording_file(world: World, k: int) -> str:
    """Where recording k stands in the folder: one folder a session, where there are several."""
    name = f"recording-{k + 1}.csv.gz"
    if len({leg.session for leg in world.legs}) == 1:
        return f"{RECORDINGS}/{name}"
    return f"{RECORDINGS}/session-{world.legs[k].session + 1}/{name}"


def public_joint(world: World) -> str:
    """The configuration as the joint's user has it."""
    joint, sensors = world.joint, dict(world.joint.sensors)
    if "quantisation" in world.how and world.how["quantisation"]["stated"]:
        for name, unit in UNITS.items():
            key = f"{name}_resolution_{unit}"
            sensors[key] = float(f"{sensors[key] * coarser(world.how, name):.3e}")
    own: tuple[str, ...] = ()
    case = world.order.case
    conditions = {case.condition: world.other} if case is not None else {}
    if "sessions" in world.how and world.how["sessions"]["declared"]:
        own = ("joint_position_offset_rad", "joint_torque_offset_Nm", "pretension_N")
    return joint_toml(
        joint.with_sensors(sensors),
        joint.nominal,
        tolerance=joint.tolerance,
        session_own=own,
        conditions=conditions,
    )


def full_truth(world: World, wanted: Wanted) -> dict[str, Any]:
    """Everything that is true of a trial, as plain data."""
    joint = world.joint
    return {
        "schema": 1,
        "seed": wanted.seed,
        "trial": world.order.number,
        "kind": world.order.kind,
        "laws": wanted.laws,
        "circuit": joint.true.circuit,
        "loop_rad": world.plain.loop_rad,
        "noise_floor_rad": world.floor_rad,
        "effects": [_effect(h, world.other) for h in world.hidden if not _is_dependence(world, h)],
        "case": case_name(world),
        "partner": world.partner,
        "depends_on": _dependences(world),
        "imperfections": world.how.truth(),
        "recordings": [_recording(world, k) for k in range(len(world.legs))],
        "true": dict(joint.stage.__dict__),
        "nominal": dict(joint.nominal.stages[0].__dict__),
        "tolerance": dict(joint.tolerance),
        "sensors": dict(joint.sensors),
        "load_Nm": joint.load_Nm,
        "travel_rad": joint.travel_rad,
        "other": world.other,
        "plain": dict(world.plain.__dict__),
    }


def case_name(world: World) -> str:
    """Name of the case of a trial of several sessions, or of one that is confounded by design; empty otherwise."""
    case = world.order.case or world.order.tie
    return "" if case is None else case.name


def _recording(world: World, k: int) -> dict[str, Any]:
    leg = world.legs[k]
    return {
        "file": recording_file(world, k),
        "session": str(leg.session + 1),
        "course": leg.course.kind,
        "rows": len(leg.recorded.rows),
        "ends_s": float(leg.course.time_s[-1]),
        "history_s": float(leg.course.seen.time_s[0] - leg.course.time_s[0]),
        "zeros": dict(leg.zeros),
        "pretension_N": leg.drive.stages[0].pretension_N,
    }


def _is_dependence(world: World, hidden: Hidden) -> bool:
    """Whether what is concealed is no effect of its own, but a parameter of the drive that follows a condition."""
    kind = EFFECTS.get(hidden.sized.spec.id)
    return world.order.case is not None and kind is not None and not kind.listed


def _dependences(world: World) -> list[dict[str, Any]]:
    """What depends on what; `size` in shares of the loop where it was sized so."""
    case = world.order.case
    if case is None:
        return []
    sizes = {h.sized.spec.id: h.sized.size for h in world.hidden}
    followed = {"routing_friction.mu_angle": "routing_friction:bending", "pretension_N": "neighbour_tightens"}
    return [
        {
            "parameter": parameter,
            "on": on,
            "size": None if on == "session" else sizes.get(followed[parameter]),
        }
        for parameter, on in case.depends
    ]


def _effect(hidden: Hidden, other: str) -> dict[str, Any]:
    spec = hidden.sized.spec
    kind = EFFECTS.get(spec.id) or FORMS[spec.id]
    return {
        "id": spec.id,
        "effect": kind.effect,
        "form": "catalogue" if kind.listed or kind.form == "bending" else kind.form or "stranger",
        "role": hidden.role,
        "listed": kind.listed,
        "size": hidden.sized.size,
        "parameters": observer_parameters(spec, other),
        "covariates": [c.replace("other:1", other.replace("other_", "other:")) for c in kind.covariates],
        "nearest": [kind.effect] if kind.listed else list(kind.nearest),
        **({"channel": MOTOR_TORQUE} if spec.id in IN_MOTOR_TORQUE else {}),
    }


def true_angles(world: World) -> dict[str, Any]:
    """Noise-free joint angles on the rows of recording k = 1, 2, …, rad, as an encoder without a zero of its own
    shows them: `joint_rad_k` of the drive as it is, `plain_rad_k` without any effect, and of several
    `without_<id>_rad_k` without each. Where something shows in the motor's torque alone, that torque as well (N·m):
    `joint_motor_Nm_k`, …"""
    found: dict[str, Any] = {}
    for k, leg in enumerate(world.legs, start=1):
        found[f"time_s_{k}"] = leg.recorded.channels["time_s"]
        found[f"joint_rad_{k}"], found[f"plain_rad_{k}"] = leg.true_rad, leg.plain_rad
        for name, angle in leg.without.items():
            found[f"without_{name.replace(':', '.')}_rad_{k}"] = angle
        if any(h.sized.spec.id in IN_MOTOR_TORQUE for h in world.hidden):
            for name, torque in leg.motor_Nm.items():
                found[f"{name.replace(':', '.')}_motor_Nm_{k}"] = torque
    return found
