"""Histories and detours that nobody recorded, against the plant's: what any of them adds lies within what is estimated
of it."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from joints import LONG, closed

from cablecomp.config import parse_joint
from cablecomp.estimation import history
from cablecomp.estimation.evidence import JOINT, Evidence
from cablecomp.estimation.gather import gather
from cablecomp.estimation.history import Forgotten, forgotten, histories, zero_by_history
from cablecomp.estimation.least_squares import Fit
from cablecomp.estimation.parameter import of_drive
from cablecomp.estimation.problem import Problem, Weighing
from cablecomp.signal.smoothing import FloatArray
from firmware_sim.plant import PlantConfig, simulate

STEP_S, NOISE_RAD = 0.05, 2e-5
LOAD_Nm, STROKE_rad = 1.4, 0.6
NESTED = (
    [(0.0, 0.45), (0.0, -0.3)],
    [(0.0, -0.8), (0.0, 0.4)],
    [(0.4, 0.6), (0.4, -0.2), (0.0, -0.2)],
    [(-0.7, -0.5), (0.2, -0.5), (0.2, 0.3)],
)
"""What went before: the motor's angle and the load one after another, in what the recording reaches."""


def joined(corners: list[tuple[float, float]], rows: int = 40) -> FloatArray:
    return np.concatenate([np.linspace(a, b, rows) for a, b in pairwise(corners)])


def visible(circuit: str) -> tuple[FloatArray, FloatArray]:
    """Motor angle [rad] and load [N m] of a recording that loads the joint ever more, its motor turning."""
    time = np.arange(0.0, 30.0, STEP_S)
    swell = 0.3 + 0.7 * time / time[-1]
    return STROKE_rad * swell * np.sin(0.45 * time), torque(circuit, swell * np.sin(1.3 * time))


def torque(circuit: str, share: FloatArray | float) -> FloatArray:
    """Load [N m] of a share of its reach; an open circuit is pulled one way mostly, or its cable goes slack."""
    return LOAD_Nm * np.asarray(0.35 + 0.65 * share if circuit == "open" else share)


def nested(circuit: str) -> tuple[dict[str, Any], PlantConfig, FloatArray, FloatArray]:
    """A long drive as configuration and as plant, and what its recording shows: motor angle [rad], load [N m]."""
    raw = closed(LONG)
    raw["drive"]["circuit"] = circuit
    return raw, PlantConfig.from_dict(raw), *visible(circuit)


@pytest.mark.parametrize("circuit", ["open", "closed"])
def test_what_a_nested_history_leaves_in_the_plant_lies_within_what_is_estimated_of_it(circuit: str) -> None:
    raw, plant, motor, load = nested(circuit)
    angles = []
    for before in ([], *NESTED):
        # every run begins at rest and ends up where the recording begins
        corners = joined(
            [(0.0, 0.0), *((q, float(torque(circuit, m))) for q, m in before), (motor[0], load[0])]
        )
        drive, loads = (np.concatenate([corners[:, k], v]) for k, v in enumerate((motor, load)))
        time = STEP_S * np.arange(len(drive))
        angles.append(simulate(plant, time, drive, loads).channels()[JOINT][len(corners) :])
    columns = {
        "time_s": STEP_S * np.arange(len(motor)), "motor_position_rad": motor, "joint_torque_Nm": load,
        JOINT: angles[0],
    }  # fmt: skip
    e = gathered(raw, columns)
    found = told(raw, e)
    added = [(angle - angles[0])[e.rows] for angle in angles[1:]]
    before = [float(np.std(a[found.first :])) for a in added]
    after = [float(np.std(without_told(found, a))) for a in added]
    assert max(before) > 4.0 * NOISE_RAD
    assert max(after) < 0.1 * max(before) + 0.2 * NOISE_RAD


def test_how_far_histories_move_a_zero_is_how_far_they_do_in_the_plant(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The mean angle of a recording after each assumed history, played to the plant, less that after none (RMS)."""
    monkeypatch.setattr(history, "HISTORY_PARTS", (1.0,))
    raw, plant, motor, load = nested("closed")

    def played(path: FloatArray) -> FloatArray:
        drive, loads = (np.concatenate([path[:, k], v]) for k, v in enumerate((motor, load)))
        return simulate(plant, STEP_S * np.arange(len(drive)), drive, loads).channels()[JOINT][len(path) :]

    fresh = played(np.empty((0, 2)))
    columns = {
        "time_s": STEP_S * np.arange(len(motor)), "motor_position_rad": motor, "joint_torque_Nm": load, JOINT: fresh,
    }  # fmt: skip
    e = gathered(raw, columns)
    joint = parse_joint(raw, "nested")
    p = Problem(joint, of_drive(joint), (e,), Weighing({JOINT: NOISE_RAD}, {}))
    moved = [np.mean((played(h.path) - fresh)[e.rows]) for h in histories(p, e)]
    assert min(moved) < -NOISE_RAD < NOISE_RAD < max(moved)
    fit = Fit(p, p.start, np.empty(0), np.empty((0, 0)))
    assert zero_by_history(fit) == pytest.approx(np.sqrt(np.mean(np.square(moved))), rel=0.03)


def test_a_decomposition_that_ends_without_an_answer_is_made_the_slower_way(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    raw, _, motor, load = nested("closed")
    columns = {
        "time_s": STEP_S * np.arange(len(motor)), "motor_position_rad": motor, "joint_torque_Nm": load, JOINT: motor,
    }  # fmt: skip
    e = gathered(raw, columns)
    usual = told(raw, e).carryover[JOINT]

    def without_an_answer(*_: Any, **__: Any) -> None:
        raise np.linalg.LinAlgError("SVD did not converge")

    monkeypatch.setattr(np.linalg, "svd", without_an_answer)
    slower = told(raw, e).carryover[JOINT]
    assert usual.shape[1] > 1
    assert np.abs(slower) == pytest.approx(np.abs(usual), rel=1e-6, abs=1e-6 * np.abs(usual).max())


@pytest.mark.parametrize("circuit", ["open", "closed"])
def test_what_a_detour_in_a_gap_leaves_in_the_plant_lies_within_what_is_estimated_of_it(circuit: str) -> None:
    raw, plant, motor, load = nested(circuit)
    # a full swing both ways first, so that no history before it matters
    corners = [(0.0, 0.0), *((0.0, float(torque(circuit, m))) for m in (1.0, -1.0, 0.0)), (motor[0], load[0])]
    led = joined(corners)
    gap = slice(len(led) + 200, len(led) + 216)  # 0.8 s, through which motor and load go on as shown
    drive, loads = (np.concatenate([led[:, k], v]) for k, v in enumerate((motor, load)))
    time = STEP_S * np.arange(len(drive))
    bump = np.sin(np.linspace(0.0, np.pi, 18))[1:-1]
    angles = []
    for turn, more in ((0.0, 0.0), (0.0, 0.7), (0.0, -0.6), (-0.2, 0.0), (0.1, 0.5)):
        q, m = drive.copy(), loads.copy()
        q[gap] += turn * bump
        m[gap] += (float(torque(circuit, more)) - float(torque(circuit, 0.0))) * bump
        angles.append(simulate(plant, time, q, m).channels()[JOINT])
    seen = np.ones(len(time), dtype=np.bool_)
    seen[gap] = False
    columns = {"time_s": time, "motor_position_rad": drive, "joint_torque_Nm": loads}
    noise = NOISE_RAD * np.random.default_rng(3).standard_normal(len(time))
    shown = []
    for angle in angles:
        seen_there = {**columns, JOINT: angle + noise}
        e = gathered(raw, {k: v[seen] for k, v in seen_there.items()})
        added = (angle - angles[0])[seen][e.rows]
        found = told(raw, e)
        moved, left = (float(np.std(v)) for v in (added[found.first :], without_told(found, added)))
        shown.append(moved)
        if moved == 0.0:  # a column that nothing asks for could take a law that is missing
            assert not found.hidden
        if moved > 4.0 * NOISE_RAD:
            assert found.hidden
            assert left < 0.1 * moved + 0.2 * NOISE_RAD
    assert sum(moved > 4.0 * NOISE_RAD for moved in shown) >= 2


def gathered(raw: dict[str, Any], columns: dict[str, FloatArray]) -> Evidence:
    """The recording, on every second sample or more."""
    return gather(parse_joint(raw, "nested"), "a", columns, "one", fine_rows=2000, judged_rows=300)


def told(raw: dict[str, Any], e: Evidence) -> Forgotten:
    """What the drive as it is tells of the recording's history and gaps."""
    joint = parse_joint(raw, "nested")
    p = Problem(joint, of_drive(joint), (e,), Weighing({JOINT: NOISE_RAD}, {}))
    return forgotten(p, p.start, e, {JOINT: NOISE_RAD}, 0.25)


def without_told(found: Forgotten, added: FloatArray) -> FloatArray:
    """What is left of something added to the judged rows [rad] beside the carry-over that a recording is estimated
    with, and a zero."""
    carried = found.carryover.get(JOINT, np.empty((len(added), 0)))
    columns = np.column_stack((carried, np.ones(len(added))))[found.first :]
    prior = np.eye(columns.shape[1]) * NOISE_RAD
    prior[-1] = 0.0  # a zero
    counted = added[found.first :]
    target = np.concatenate((counted, np.zeros(len(prior))))
    return np.asarray(counted - columns @ np.linalg.lstsq(np.vstack((columns, prior)), target, rcond=None)[0])
