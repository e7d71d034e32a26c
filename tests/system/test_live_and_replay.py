"""The loop and `replay` draw the same line: what stops the one is refused by the other, for the same reason, and what
the loop took replay gives back bit for bit.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import polars as pl
import pytest
from fault_runs import CONFIGS, GAINS, REACH

from cablecomp.cli.simulation import start_simulation
from cablecomp.config import JointConfig, load_joint
from cablecomp.control.motors import control_for
from cablecomp.control.options import ControlMode, FeedForward, HealthOptions
from cablecomp.errors import InputError
from cablecomp.links.load import load_link
from cablecomp.observer import Observer
from cablecomp.recording.reader import open_recording
from cablecomp.report.replay_page import write_replay
from cablecomp.runtime.clock import Tick
from cablecomp.runtime.joint_loop import JointLoop
from cablecomp.runtime.loop import Loop
from cablecomp.runtime.run import RunOptions, run_joint
from cablecomp.runtime.setup import matched
from cablecomp.runtime.simulated import SimulationWish


class Case(NamedTuple):
    """Words of a reason, and a run that meets it: what the configuration says otherwise than the joint is, a fault."""

    words: str
    joint: str
    stage: dict[str, float]
    fault: str = ""
    options: dict[str, object] = {}  # noqa: RUF012 -- of a named tuple


LINEAR = {"feed_forward": FeedForward.LINEAR, "linear_stiffness_Nm_per_rad": 200.0}
"""Feed-forward that asks the observer for nothing, so that the refusal is not met in a prediction before."""

CASES = (
    Case("breaking force", "wrist-capstan", {"breaking_force_N": 75.0}),
    Case("runs out of cable", "wrist-capstan", {"wrap_output_rad": 0.3}, "", LINEAR),
    Case("slacken", "snow-open-rig", {}, "offset:channel=joint_torque_Nm,offset=-1.5,start=0.4"),
    Case(
        "no load that the joint can take",
        "snow-open-rig",
        {},
        "offset:channel=joint_position_rad,offset=-0.2,start=0.4",
        {"mode": ControlMode.FORCE},
    ),
)


def stated(case: Case) -> JointConfig:
    """The joint as the run believes it to be."""
    joint = load_joint(CONFIGS / f"joints/{case.joint}.toml")
    stage = joint.drive.stage[0].model_copy(update=case.stage)
    return joint.model_copy(update={"drive": joint.drive.model_copy(update={"stage": (stage,)})})


def stopped_run(case: Case, out: Path) -> tuple[str, JointLoop]:
    """A run in stepped time until it stops: why, and its joint, whose last sample is the refused one."""
    path = CONFIGS / f"joints/{case.joint}.toml"
    control = control_for(load_joint(path))
    options = control.compensator.model_copy(update={**GAINS, **case.options})
    control = control.model_copy(
        update={"compensator": options, "health": HealthOptions(joint_rate_rad_s=1e6)}
    )
    link, control = matched(load_link(CONFIGS / "links/wrist-virtual.toml"), control, own_link=False)
    faults = (case.fault,) if case.fault else ()
    simulation = start_simulation(path, SimulationWish(link, control, 1, False, 3, faults))
    if options.mode is ControlMode.FORCE:
        simulation.set_wall(1, 0.0)
    joints: list[JointLoop] = []

    def watch(loop: Loop, tick: Tick) -> None:
        joints[:] = loop.joints

    try:
        report = run_joint(stated(case), link, control, REACH, RunOptions(1.2, True, out), simulation, watch)
    finally:
        simulation.close()
    return report.stop_reason, joints[0]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.words)
def test_replay_takes_what_the_loop_took_and_refuses_what_stopped_it(case: Case, tmp_path: Path) -> None:
    reason, joint = stopped_run(case, tmp_path / "run")
    recorded = tmp_path / "run/recording.csv"
    config = load_joint(tmp_path / "run/joint.toml")
    write_replay(open_recording(recorded), config, Observer(config), tmp_path / "replay")
    live, again = (
        pl.read_csv(tmp_path / name / "prediction.csv", infer_schema_length=None)
        for name in ("run", "replay")
    )
    assert len(live) > 300
    assert live.equals(again, null_equal=True)

    assert joint.checked is not None
    sample = joint.checked.sample._asdict()
    lines = [line for line in recorded.read_text().splitlines() if not line.startswith("#")]
    before = dict(zip(lines[0].split(","), lines[-1].split(","), strict=True))
    with recorded.open("a") as file:
        file.write(",".join(str(sample.get(name, value)) for name, value in before.items()) + "\n")
    with pytest.raises(InputError, match=case.words) as refused:
        write_replay(open_recording(recorded), config, Observer(config), tmp_path / "again")
    said = str(refused.value).partition(f"line {len(live) + 2}: ")[2]
    assert said
    assert reason.endswith(f": the observer refuses what came: sample {said}")
