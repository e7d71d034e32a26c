"""`cablecomp run` as a user meets it: links, protocols, exit codes, one line for bad input."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest
from fault_runs import CONFIGS, GAINS, JOINT, REACH

from cablecomp import cli
from cablecomp.cli.simulation import start_simulation
from cablecomp.config import load_joint
from cablecomp.control.motors import control_for
from cablecomp.links.load import load_link
from cablecomp.monitor import viewer
from cablecomp.runtime.setup import matched
from cablecomp.runtime.simulated import SimulationWish

CONTROL = CONFIGS / "control/wrist-capstan.toml"
LINK = CONFIGS / "links/wrist-virtual.toml"
COMPARE = ("run", "--config", str(JOINT), "--sim", "--compare")


def simulated(joint: Path = JOINT, control: Path | None = CONTROL, **options: object) -> list[str]:
    """Arguments of a run on a simulated joint in simulated time."""
    given = {"config": joint, **({} if control is None else {"control": control}), **options}
    return ["run", "--sim", "--fast", *(word for k, v in given.items() for word in (f"--{k}", str(v)))]


def test_the_command_line_runs_and_writes_a_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(simulated(out=tmp_path, duration=0.5)) == 0
    assert "report.html" in capsys.readouterr().out.replace("\n", "")
    page = (tmp_path / "report.html").read_text()
    assert "https://" not in page.split("<script")[0]
    assert "prediction residual" in page


def test_the_command_line_executes_a_protocol(tmp_path: Path) -> None:
    protocol = tmp_path / "p.toml"
    protocol.write_text(REACH.to_toml(), encoding="utf-8")
    assert cli.main(simulated(out=tmp_path / "out", duration=0.3, protocol=protocol)) == 0
    cycles = pl.read_csv(tmp_path / "out" / "cycles.csv", infer_schema_length=None).filter(
        pl.col("controlled") > 0
    )
    asked = cycles["reference_position_rad"].to_numpy()[-1]
    assert asked == pytest.approx(REACH.reference(0.3).joint_position_rad, abs=1e-3)


def test_the_loop_runs_in_a_session_with_its_own_laws(tmp_path: Path) -> None:
    law = (
        '\n[[session]]\nname = "mon"\n[[empirical]]\nid = "ripple_by_motor_angle_per_session"\nlaw = "fourier"\n'
        'of = "motor_position_rad"\ncoefficients_rad = [0.005]\nsession = "mon"\n'
    )
    joint = tmp_path / "joint.toml"
    joint.write_text(JOINT.read_text(encoding="utf-8") + law, encoding="utf-8")
    at_once = []
    for name, asked in (("plain", []), ("mon", ["--session", "mon"])):
        out = tmp_path / name
        assert cli.main([*simulated(joint, out=out, duration=0.3), "--nominal", *asked]) == 0
        ahead = pl.read_csv(out / "prediction.csv", infer_schema_length=None)
        at_once.append(ahead["joint_position_rad"].to_numpy()[0])
    assert at_once[1] - at_once[0] == pytest.approx(0.005, abs=1e-4)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device stands for a full disk here")
def test_a_file_for_onlookers_that_the_disk_refuses_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mcap", reason="mcap is not installed")
    watched = viewer.watched
    monkeypatch.setattr(
        viewer, "watched", lambda joint, who, css: watched(joint, replace(who, mcap=Path("/dev/full")), css)
    )
    assert cli.main([*simulated(out=tmp_path, duration=0.3), "--plotjuggler", "--json"]) == 3
    said = capsys.readouterr()
    failure = "/dev/full: is incomplete (No space left on device); free some space"
    assert json.loads(said.out)["failures"] == [failure]
    assert said.err.splitlines()[-1] == f"cablecomp: {failure}"
    assert "Traceback" not in said.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "--sim"], "--config"),
        (["run", "--config", "nowhere.toml", "--sim"], "nowhere.toml"),
        (["run", "--config", str(JOINT)], "--link is missing"),
        (["run", "--config", str(JOINT), "--sim", "--mode", "sideways"], "sideways"),
        (["run", "--config", str(JOINT), "--sim", "--session", "mon"], "has no session of that name"),
        (["run", "--config", str(JOINT), "--sim", "--protocol", str(JOINT)], "segment"),
        (["run", "--config", str(JOINT), "--link", str(JOINT)], "bus"),
        (["run", "--config", str(JOINT), "--control", str(JOINT), "--sim"], "name"),
        (["run", "--config", str(JOINT), "--sim", "--fast", "--fault", "gremlins"], "gremlins"),
        (["run", "--config", str(JOINT), "--link", str(LINK), "--fast"], "--sim"),
        (
            ["run", "--config", str(JOINT), "--sim", "--fast", "--resume", str(JOINT)],
            f"cablecomp: {JOINT}: snapshot: is none of ours",
        ),
        ([*COMPARE, "--fault", "foo"], "--fault cannot go with --compare"),
        (
            [*COMPARE, "--protocol", "nope", "--resume", "nope"],
            "--protocol, --resume cannot go with --compare",
        ),
        ([*COMPARE, "--mode", "force"], "--mode cannot"),
        (
            [*COMPARE, "--nominal", "--live", "--view", "--plotjuggler"],
            "--nominal, --live, --view, --plotjuggler",
        ),
        ([*COMPARE, "--no-bounds"], "--no-bounds cannot"),
        ([*COMPARE, "--duration", "2"], "--duration 2 leaves --compare no motion"),
        (["design", "--config", str(JOINT), "--rate", "-5"], "-5"),
        (["fly"], "fly"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.main(arguments) == 2
    said = capsys.readouterr().err
    assert words in said
    assert all(line.startswith("cablecomp: ") for line in said.splitlines())
    assert not list(tmp_path.iterdir())


def test_a_bus_that_is_not_there_is_exit_code_3(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (
        LINK.read_text()
        .replace('interface = "virtual"', 'interface = "socketcan"')
        .replace('"wrist"', '"nocan9"', 1)
    )
    link = tmp_path / "link.toml"
    link.write_text(text.replace("cablecomp_joint.dbc", str(CONFIGS / "links/cablecomp_joint.dbc")))
    arguments = ["run", "--config", str(JOINT), "--control", str(CONTROL), "--link", str(link)]
    assert cli.main([*arguments, "--out", str(tmp_path / "o")]) == 3
    assert "nocan9" in capsys.readouterr().err
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize("link", sorted((CONFIGS / "links").glob("*.toml")), ids=lambda path: path.stem)
def test_every_link_that_comes_along_can_be_rehearsed(link: Path, tmp_path: Path) -> None:
    """Its own gear, modes and messages, with a bus inside of this process where it names an adapter."""
    joint, protocol, control = (tmp_path / f"{name}.toml" for name in ("joint", "protocol", "control"))
    known = "Joint{node}_State" in link.read_text()  # by a sensor at the joint, which tells of the load
    joint.write_text(JOINT.read_text() + ("" if known else '\n[observer]\nload = "none"\n'), encoding="utf-8")
    protocol.write_text(REACH.to_toml(), encoding="utf-8")
    stated = "".join(f"{key} = {value}\n" for key, value in GAINS.items())
    text = CONTROL.read_text().replace("[compensator]\n", f"[compensator]\n{stated}")
    control.write_text(text, encoding="utf-8")
    asked = simulated(joint, control, out=tmp_path / "out", link=link, protocol=protocol, duration=0.4)
    assert cli.main([*asked, "--nominal", "--no-bounds"]) == 0
    said = json.loads((tmp_path / "out/run.json").read_text())
    joint_run, rate_Hz = said["joints"][0], load_link(link).rate_Hz
    assert joint_run["cycles"] > 0.39 * rate_Hz
    assert joint_run["true_position_rad"] < (1e-3 if known else 3e-3)
    assert said["timing"]["lost_frames"] == 0


def test_a_joint_with_nothing_but_its_motor_runs_on_the_motor_s_torque(tmp_path: Path) -> None:
    joint, link = tmp_path / "joint.toml", tmp_path / "link.toml"
    observer = '\n[observer]\nload = "motor_torque"\ninput_filter_Hz = 3.0\n'
    joint.write_text(JOINT.read_text() + observer, encoding="utf-8")
    text = (CONFIGS / "links/mit-virtual.toml").read_text()
    text = text.replace("cablecomp_joint.dbc", str(CONFIGS / "links/cablecomp_joint.dbc"))
    link.write_text(text.partition("[joint.sensor]")[0], encoding="utf-8")
    asked = simulated(joint, out=tmp_path / "out", link=link, duration=0.6)
    assert cli.main([*asked, "--no-bounds"]) == 0
    assert "joint_position_rad" not in (tmp_path / "out/recording.csv").read_text()


def test_a_run_that_had_to_stop_the_joint_says_so_by_its_exit_code(tmp_path: Path) -> None:
    assert cli.main(simulated(out=tmp_path, duration=2, fault="silent:node=drive,start=0.3")) == 3
    assert "stale" in json.loads((tmp_path / "run.json").read_text())["stop_reason"]
    assert (tmp_path / "report.html").exists()


@pytest.mark.parametrize("mode", ["position", "force", "impedance"])
def test_an_open_circuit_is_held_by_its_brake_and_run_in_every_mode(mode: str, tmp_path: Path) -> None:
    """Its pretension pulls at the motor: without brake and counter-torque the joint runs away before control
    begins.
    """
    asked = simulated(CONFIGS / "joints/snow-open-rig.toml", None, out=tmp_path, mode=mode, duration=0.6)
    assert cli.main([*asked, "--no-bounds"]) == 0
    recording = pl.read_csv(tmp_path / "recording.csv", comment_prefix="#")
    assert abs(recording["joint_position_rad"][:20]).max() < 0.02
    assert "jumped" not in (tmp_path / "events.jsonl").read_text()


def test_the_brake_holds_the_pretension_of_an_open_circuit() -> None:
    """Its torque at rest is the -r T0 that the compensator takes over from it."""
    path = CONFIGS / "joints/snow-open-rig.toml"
    joint = load_joint(path)
    control = control_for(joint)
    link, control = matched(load_link(LINK), control, own_link=False)
    simulation = start_simulation(path, SimulationWish(link, control, off_nominal=False))
    try:
        for _ in range(1500):
            simulation.advance()
        torque = simulation.bench.joints[0].truth.motor_torque_Nm
    finally:
        simulation.close()
    assert torque == pytest.approx(-joint.drive.preload_Nm, rel=0.02)
