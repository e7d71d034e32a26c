"""What is exported does in the other tool what was said of it."""

from __future__ import annotations

import ctypes
import importlib.util
import json
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cablecomp.cli import main
from cablecomp.config import Empirical, load_joint
from cablecomp.control.options import MotorModel
from cablecomp.control.plays import Plays
from cablecomp.effects import with_effects
from cablecomp.examples import example
from cablecomp.export.code import c_source, identifier, left_out, write_fmu
from cablecomp.export.equivalent import Equivalent, equivalent
from cablecomp.export.simulators import mujoco_model, urdf_model

JOINT = load_joint(example("joints", "wrist-capstan"))
RATIO = JOINT.drive.ratio
SPRING = Equivalent(RATIO, 500.0, 0.2, 2 * 0.2 / 500.0, 2.0, 1e-5, 8e-3)
PLAYS = Plays(np.array([1e-3, 1e-6, 2e-4, 3e-4, 1e-4]), np.array([0.2, 0.8, 1.5]), 1e-6, 2.0, rest_rad=5e-4)
LOADS = np.concatenate(
    [np.linspace(a, b, 40) for a, b in ((0, 2), (2, -2), (-2, 1), (1, -0.5), (-0.5, 1), (1, 2))]
)


def by_turning_points(loads: np.ndarray) -> np.ndarray:
    """Deflection by stops: a play of radius r is the load less a stop of height r, M − clip(M − z)."""
    stop, before, found = np.zeros(3), 0.0, []
    for load in loads:
        stop = np.maximum(np.minimum(stop + load - before, PLAYS.radii_Nm), -PLAYS.radii_Nm)
        before = load
        found.append(PLAYS.rest_rad + PLAYS.weights @ [load, load**2, *(load - stop)])
    return np.array(found)


def test_c_has_the_loops_of_the_plays(tmp_path: Path) -> None:
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler on the path")
    (tmp_path / "joint.c").write_text(c_source(JOINT, PLAYS), encoding="utf-8")
    command = [
        compiler,
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-pedantic",
        "-shared",
        "-fPIC",
        "joint.c",
        "-o",
        "joint.so",
        "-lm",
    ]
    subprocess.run(command, cwd=tmp_path, check=True)
    step = ctypes.CDLL(str(tmp_path / "joint.so")).wrist_capstan_step
    step.restype, step.argtypes = ctypes.c_double, [ctypes.c_void_p, ctypes.c_double, ctypes.c_double]
    state = (ctypes.c_double * 3)()
    found = np.array([step(state, 0.3, load) for load in LOADS]) - RATIO * 0.3
    assert found == pytest.approx(by_turning_points(LOADS), abs=1e-15)
    first, again = found[40], found[-1]  # the loop closes where it was left: return-point memory
    assert again == pytest.approx(first, abs=1e-15)


def test_the_mock_up_unit_does_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Inputs and outputs by name in its description; its own code steps as the plays do."""
    pytest.importorskip("pythonfmu", reason="pythonfmu is not installed")
    monkeypatch.setattr(sys, "dont_write_bytecode", False)  # as on any machine
    path = write_fmu(JOINT, PLAYS, tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["WristCapstan.fmu"]
    with zipfile.ZipFile(path) as unit:
        unit.extractall(tmp_path / "unit")
    description = ET.parse(tmp_path / "unit/modelDescription.xml").getroot()
    kinds = {v.get("name"): v.get("causality") for v in description.iter("ScalarVariable")}
    assert kinds == {
        "motor_position_rad": "input", "joint_torque_Nm": "input",
        "joint_position_rad": "output", "deflection_rad": "output",
    }  # fmt: skip
    unknown = description.findall("ModelStructure/InitialUnknowns/Unknown")
    assert [v.get("index") for v in unknown] == [
        "3",
        "4",
    ]  # FMI 2.0, 2.2.8: the outputs, as they have no start
    spec = importlib.util.spec_from_file_location("unit", tmp_path / "unit/resources/wristcapstan.py")
    assert spec is not None
    assert spec.loader is not None
    module: Any = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "unit", module)
    spec.loader.exec_module(module)
    slave = module.WristCapstan(instance_name="one", resources=str(tmp_path))
    slave.motor_position_rad, slave.joint_torque_Nm = (
        0.3,
        0.1,
    )  # initialised: below all radii, so no play moves
    begins = [slave.get_real([vr])[0] for vr, v in slave.vars.items() if v.causality.name == "output"]
    bends = PLAYS.rest_rad + 1e-3 * 0.1 + 1e-6 * 0.1**2
    assert begins == pytest.approx([RATIO * 0.3 + bends, bends], abs=1e-15)
    found = []
    for load in LOADS:
        slave.joint_torque_Nm = float(load)
        assert slave.do_step(0.0, 1e-3)
        found.append(slave.deflection_rad)
    assert np.array(found) == pytest.approx(by_turning_points(LOADS), abs=1e-15)


def test_mujoco_shows_stiffness_and_width_of_the_loop() -> None:
    """Motor held, load slowly up, down, up: the load less the friction over the stiffness, either way; then the
    joint follows."""
    mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed")
    hold = (
        '<equality><joint joint1="motor" solref="0.001 1" solimp="0.9999 0.9999 0.001"/></equality></mujoco>'
    )
    model = mujoco.MjModel.from_xml_string(
        mujoco_model(JOINT, SPRING, MotorModel()).replace("</mujoco>", hold)
    )
    data = mujoco.MjData(model)
    joint, force = model.joint("joint").qposadr[0], model.joint("joint").dofadr[0]
    ways = []
    for begin, end in ((0.0, 2.0), (2.0, -2.0), (-2.0, 2.0)):
        seen = []
        for load in np.linspace(begin, end, 3_000):
            data.qfrc_applied[force] = load
            mujoco.mj_step(model, data)
            seen.append((load, float(data.qpos[joint])))
        ways.append(np.mean([q for load, q in seen if abs(load - 1.0) < 0.01]))
    first, down, up = ways
    assert first == pytest.approx((1.0 - SPRING.friction_Nm) / SPRING.stiffness_Nm_per_rad, rel=0.01)
    assert down == pytest.approx((1.0 + SPRING.friction_Nm) / SPRING.stiffness_Nm_per_rad, rel=0.01)
    assert down - up == pytest.approx(SPRING.backlash_rad, rel=0.01)
    data.qfrc_applied[:] = 0.0
    for q in np.linspace(0.0, 0.5, 2_000):
        model.eq_data[0, 0] = q
        mujoco.mj_step(model, data)
    assert float(data.qpos[joint]) == pytest.approx(0.5 * RATIO, abs=1.1 * SPRING.backlash_rad)


def test_urdf_holds_friction_and_says_what_it_cannot() -> None:
    text = urdf_model(JOINT, SPRING, MotorModel())
    robot = ET.fromstring(text)
    dynamics = robot.find("joint[@name='joint']/dynamics")
    assert dynamics is not None
    assert float(dynamics.get("friction", "")) == SPRING.friction_Nm
    mimic = robot.find("joint[@name='motor']/mimic")
    assert mimic is not None
    assert float(mimic.get("multiplier", "")) * RATIO == pytest.approx(1.0)
    assert "no stiffness and no backlash" in text


@pytest.mark.parametrize("name", ["arm 3/left", "7", "a-->b", "*/"])
def test_any_name_makes_a_file_that_parses(name: str) -> None:
    joint = JOINT.model_copy(update={"name": name})
    ET.fromstring(mujoco_model(joint, SPRING, MotorModel()))
    ET.fromstring(urdf_model(joint, SPRING, MotorModel()))
    assert identifier(name).isidentifier()
    assert c_source(joint, PLAYS).count("*/") == c_source(JOINT, PLAYS).count("*/")


def test_the_equivalent_lies_on_the_observers_loop() -> None:
    """Its peak is the loop's, its width the loop's, and it leaves less of the loop than a straight line does."""
    found = equivalent(JOINT)
    assert found.backlash_rad == pytest.approx(2.0 * found.friction_Nm / found.stiffness_Nm_per_rad)
    pulls = found.most_Nm - found.friction_Nm  # what dry friction leaves the spring at the peak
    assert 2.0 * pulls / found.stiffness_Nm_per_rad == pytest.approx(found.reach_rad, rel=0.02)
    assert found.rms_rad < 0.5 * found.backlash_rad
    assert all(found.lost(JOINT))


def test_what_is_written_and_what_is_said_write_loads_alike() -> None:
    texts = (*SPRING.lost(JOINT), mujoco_model(JOINT, SPRING, MotorModel()), c_source(JOINT, PLAYS))
    assert not any("+-" in text or "±" in text or " N m " in text for text in texts)
    assert all("-2 to 2 Nm" in text for text in (texts[0], *texts[-2:]))


def test_an_open_circuits_cable_is_said_to_pull_one_way_alone() -> None:
    joint = load_joint(example("joints", "snow-open-rig"))
    texts = (*SPRING.lost(joint), mujoco_model(joint, SPRING, MotorModel()), c_source(joint, PLAYS))
    assert not any("-2 to 2 Nm" in text for text in texts)
    assert all("0 to 2 Nm" in text for text in (texts[0], *texts[-2:]))


def test_the_result_is_had_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "--config", "wrist-capstan", "--urdf", "--out", str(tmp_path), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["name"], Path(told["urdf"]).read_text()[:7]) == ("wrist-capstan", "<?xml v")
    assert told["equivalent"]["friction_Nm"] == pytest.approx(equivalent(JOINT).friction_Nm)


def test_a_joint_with_an_effect_of_the_users_own_is_exported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(importlib.import_module("cablecomp.effects.catalogue"), "_registered", {})
    text = example("joints", "wrist-capstan").read_text(encoding="utf-8")
    joint = tmp_path / "joint.toml"
    joint.write_text(f'{text}\n[[effect]]\nid = "seal_drag"\ndrag_Nms_per_rad = 0.5\n', encoding="utf-8")
    command = ["export", "--config", str(joint), "--urdf", "--out", str(tmp_path / "out")]
    assert main(command) == 2
    assert "--effects" in capsys.readouterr().err  # what to do
    own = Path(__file__).parents[1] / "effects/user_effect_example.py"
    assert main([*command, "--effects", str(own)]) == 0
    assert (
        "enters by its loops alone, motor held at 0 rad: seal_drag"
        in (tmp_path / "out/wrist_capstan.urdf").read_text()
    )


def test_every_format_names_what_of_the_joint_s_own_it_leaves_out() -> None:
    """Creep and a law of time wholly; a weight but for the load's loops; what the sensors read wrong. Not what goes by
    the load alone, which is in the loops; no name ends the comment or the text that it stands in."""
    sensors = JOINT.sensors.model_copy(update={"joint_torque_gain": 1.25})
    laws = tuple(
        Empirical(id=f'{name}*/"""\\', law="chebyshev", of=of, coefficients_rad=(0.0, 0.01))
        for name, of in (("drift", "time_s"), ("bend", "joint_torque_Nm"), ("wave", "motor_position_rad"))
    )
    effects = [
        ("gravity_load", {"moment_Nm": 0.5, "phase_rad": 0.0}),
        ("pretension_relaxation", {"fraction": 0.02, "time_constant_s": 30.0}),
        ("nonlinear_cable", {"stiffening": 0.1}),
    ]
    joint = with_effects(JOINT.model_copy(update={"sensors": sensors, "empirical": laws}), effects)
    code = c_source(joint, PLAYS)
    assert code.count("*/") == c_source(JOINT, PLAYS).count("*/")
    for text in (code, "\n".join(SPRING.lost(joint)), "\n".join(left_out(joint))):
        said = {line.strip(" *").partition(": ")[0]: line for line in text.splitlines()}
        time, more, read = (
            said["what goes by the time"],
            said["what goes by more than the load enters by its loops alone, motor held at 0 rad"],
            said["what sensors read wrong; angles and loads are the true ones"],
        )
        assert "pretension_relaxation, drift" in time
        assert "gravity_load, wave" in more
        assert "joint_torque_gain = 1.25" in read
        assert "nonlinear_cable" not in text
        assert "bend" not in text
    assert not any("what goes" in line or "sensors" in line for line in left_out(JOINT))


def test_what_differs_between_sessions_or_goes_with_a_condition_is_named(tmp_path: Path) -> None:
    """A diagnosis leaves such joints: one drive, mounted twice, whose friction grows with the bend of its path."""
    text = example("joints", "wrist-capstan").read_text(encoding="utf-8")
    path = tmp_path / "joint.toml"
    path.write_text(
        f"""{text}
[condition]
bend = "other_bend_deg"

[[session]]
name = "rig-1"
values = {{ pretension_N = 50.0, joint_position_offset_rad = 1e-3 }}

[[session]]
name = "rig-2"
values = {{ pretension_N = 60.0 }}

[[empirical]]
id = "ripple"
law = "fourier"
of = "motor_position_rad"
coefficients_rad = [0.0, 1e-3]
session = "rig-1"

[[depends]]
parameter = "mu_output"
on = "bend"
per_unit = 1e-3
at = 90.0
seen = [0.0, 180.0]
""",
        encoding="utf-8",
    )
    joint = load_joint(path)
    for lines in (SPRING.lost(joint), left_out(joint)):
        own = next(line for line in lines if "session's own" in line)
        assert own.endswith(": pretension_N, joint_position_offset_rad, ripple")
        assert sum("ripple" in line for line in lines) == 1  # it does not run at common values
        assert any("with a condition" in line and line.endswith(": mu_output by bend") for line in lines)
    assert not any("session" in line or "condition" in line for line in left_out(JOINT))


def test_what_is_lost_is_said_with_the_formats_that_lose_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", "--config", "wrist-capstan", "--urdf", "--c", "--out", str(tmp_path)]) == 0
    lost = [line for line in capsys.readouterr().out.splitlines() if "leave out" in line]
    assert {line.partition(" leave out: ")[0] for line in lost} == {"MJCF and URDF", "C and FMU"}
    assert len(lost) == len(set(lost))
