"""The reference names every key that a loader accepts; doubts are raised where they should be, and nowhere else."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from pydantic import BaseModel

from cablecomp.config import doubts, load_joint, parse_joint
from cablecomp.config.reference import reference, tables_of
from cablecomp.config.schema import JointConfig
from cablecomp.control.options import ControlConfig
from cablecomp.links.schema import LinkConfig

CONFIGS = Path(__file__).parents[2] / "configs"
JOINTS = sorted([*CONFIGS.glob("joints/*.toml"), *CONFIGS.glob("hardware/*.toml")])
GOOD = (CONFIGS / "joints/tendon-finger.toml").read_text(encoding="utf-8")


def tables_in(data: dict[str, object], head: str = "") -> set[tuple[str, str]]:
    """(table without brackets, key) of everything that stands in a TOML file."""
    found = set()
    for key, value in data.items():
        place = f"{head}.{key}" if head else key
        rows = value if isinstance(value, list) else [value]
        if rows and all(isinstance(row, dict) for row in rows):
            found |= {pair for row in rows for pair in tables_in(row, place)}
        else:
            found.add((head, key))
    return found


@pytest.mark.parametrize(
    ("model", "folder"), [(JointConfig, "joints"), (ControlConfig, "control"), (LinkConfig, "links")]
)
def test_every_key_of_the_shipped_files_is_in_the_reference(model: type[BaseModel], folder: str) -> None:
    known = {
        (table.head.partition(" with ")[0].strip("[]").replace("(top of the file)", ""), key.name)
        for table in tables_of(model)
        for key in table.keys
    }
    free = {"tolerance", "bus.options"}  # tables whose keys are the user's
    for path in CONFIGS.glob(f"{folder}/*.toml"):
        for table, key in tables_in(tomllib.loads(path.read_text(encoding="utf-8"))):
            if table not in free and "device" not in table:
                assert (table, key) in known, path


def test_units_and_what_is_accepted_are_stated() -> None:
    text = reference(JointConfig)
    assert (
        "output_radius_m [m]: effective radius of the output pulley, R; number, > 0, <= 10000; required"
        in text
    )
    assert "motor_velocity_max_rad_s [rad/s]" in text
    assert "'joint_torque' | 'motor_torque' | 'both_encoders' | 'none'; default 'joint_torque'" in text
    assert "stiffness_Nm_per_rad [Nm/rad]" in reference(LinkConfig)


@pytest.mark.parametrize("path", JOINTS, ids=lambda path: path.stem)
def test_a_plausible_joint_raises_no_doubt(path: Path) -> None:
    assert doubts(load_joint(path)) == ()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("output_radius_m = 0.008", "output_radius_m = 90", "output_radius_m = 90"),
        ("EA_N = 8500.0", "EA_N = 40.0", "rubber"),
        ("wrap_output_rad = 5.7", "wrap_output_rad = 300.0", "degrees instead of radians?"),
        ("mu_output = 0.16", "mu_output = 1.6", "mu_output = 1.6"),
        ("pretension_N = 35.0", "pretension_N = 350.0", "strains the cable"),
        ("joint_position_noise_rad = 2e-4", "joint_position_noise_rad = 0.2", "poor sensor"),
        ("mu_output = 0.30", "mu_output = 30.0", "per cent?"),
        (
            "joint_torque_max_Nm = 0.30",
            "joint_torque_max_Nm = 300.0",
            "joint_torque_max_Nm = 300 would strain",
        ),
        (
            "motor_torque_max_Nm = 0.40",
            "motor_torque_max_Nm = 400.0",
            "motor_torque_max_Nm = 400 would strain",
        ),
        ("joint_position_max_rad = 0.8", "joint_position_max_rad = 45.0", "unwinds"),
        ("[tolerance]", '[observer]\nload = "motor_torque"\n\n[tolerance]', "may swing"),
    ],
)
def test_the_implausible_is_asked_about(old: str, new: str, words: str) -> None:
    assert old in GOOD
    asked = doubts(parse_joint(tomllib.loads(GOOD.replace(old, new)), "x"))
    assert any(words in line for line in asked)
