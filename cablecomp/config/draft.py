"""What a person knows of a joint, in the units of a workshop, made into a joint file with tolerances to match."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from math import pi, radians
from typing import Any, Final, Literal, NamedTuple, Self

from pydantic import Field, model_validator

from cablecomp.config.base import Finite, Frozen, NonNegative, Positive, Text
from cablecomp.config.cables import CABLES
from cablecomp.config.load import parse_joint
from cablecomp.config.toml_file import value_text

PRETENSION: Final = {"measured": 0.05, "weight": 0.10, "tuned": 0.15, "by_feel": 0.5, "unknown": 1.0}
"""How a pretension was set: its relative 1-sigma."""
_RPM: Final = 2.0 * pi / 60.0


class Draft(Frozen):
    """Answers to `cablecomp init`, or a file for `cablecomp init --from FILE`."""

    name: Text = Field("my-joint", description="name of the joint")
    circuit: Literal["closed", "open"] = Field(
        "closed", description="two cables that pull against each other, or one that a load keeps taut"
    )
    output_radius_mm: Positive = Field(description="radius of the pulley at the joint")
    input_radius_mm: Positive = Field(description="radius of the pulley at the motor (after its gear)")
    radii: Literal["bare", "effective"] = Field(
        "bare", description="bare pulley, or with half the cable's diameter already in it"
    )
    cable: Literal["steel-7x7", "steel-7x7-nylon", "steel-7x19", "tungsten", "uhmwpe"] = Field(
        description="kind of cable"
    )
    cable_diameter_mm: Positive = Field(description="outer diameter of the cable")
    EA_N: Positive | None = Field(
        None, description="axial stiffness, if it was measured; else from the catalogue"
    )
    free_length_mm: Positive = Field(description="cable between the pulleys that touches nothing")
    output_turns: Positive = Field(
        description="turns on the joint's pulley at position zero, to where it is fixed"
    )
    input_turns: Positive = Field(
        description="turns on the motor's pulley at position zero, to where it is fixed"
    )
    pretension_N: Positive | None = Field(
        None, description="tension at rest; guessed from the load if absent"
    )
    pretension_set: Literal["measured", "weight", "tuned", "by_feel", "unknown"] = Field(
        "by_feel", description="how it was set: force sensor, hung weight, by the cable's note, by feel"
    )
    joint_torque_max_Nm: Positive = Field(description="greatest load on the joint, either way")
    joint_min_deg: Finite = Field(-45.0, description="least joint angle")
    joint_max_deg: Finite = Field(45.0, description="greatest joint angle")
    motor_torque_max_Nm: Positive | None = Field(
        None, description="greatest torque at the motor's pulley, either way"
    )
    motor_speed_max_rpm: Positive | None = Field(None, description="greatest speed of the motor's pulley")
    load_from: Literal["joint_torque", "motor_torque", "both_encoders", "none"] = Field(
        "joint_torque",
        description="where the load is known from: torque sensor at the joint, motor's current",
    )
    joint_encoder_bits: NonNegative = Field(0.0, description="of the joint's encoder per turn; 0 = not known")
    motor_encoder_bits: NonNegative = Field(0.0, description="of the motor's encoder per turn; 0 = not known")
    drive: Literal["none", "moteus", "odrive", "cubemars", "robstride", "damiao", "mit"] = Field(
        "none", description="the motor's drive: a link file for it is written as well"
    )

    @model_validator(mode="after")
    def _range(self) -> Self:
        if not self.joint_min_deg < self.joint_max_deg:
            raise ValueError(
                f"joint_min_deg {self.joint_min_deg:g} < joint_max_deg {self.joint_max_deg:g} is accepted"
            )
        return self


class _Line(NamedTuple):
    key: str
    value: Any
    why: str


def draft_text(draft: Draft) -> str:
    """`joint.toml` with a comment beside every value: where it comes from. It has been read back once: what is
    wrong with it is said as for any joint file (ConfigError)."""
    lines = [f"# Written by `cablecomp init`; {CABLES[draft.cable].source}.", "schema = 1"]
    lines += [
        f"name = {value_text(draft.name)}",
        "",
        "[drive]",
        f'circuit = "{draft.circuit}"',
        "",
        "[[drive.stage]]",
    ]
    lines += _lines(_stage(draft))
    lines += ["", "[tolerance]                       # relative, 1 sigma; 1 = order of magnitude only"]
    lines += _lines(_tolerance(draft))
    sensors = list(_sensors(draft))
    lines += ["", "[sensors]", *_lines(sensors)] if sensors else []
    if draft.load_from != "joint_torque":
        lines += ["", "[observer]", f'load = "{draft.load_from}"']
    lines += ["", "[limits]", *_lines(_limits(draft))]
    text = "\n".join(lines) + "\n"
    parse_joint(tomllib.loads(text), "init")
    return text


def _stage(d: Draft) -> Iterator[_Line]:
    half = 0.5e-3 * d.cable_diameter_mm if d.radii == "bare" else 0.0
    how = "bare radius + half the cable" if half else "effective, as given"
    yield _Line("output_radius_m", 1e-3 * d.output_radius_mm + half, how)
    yield _Line("input_radius_m", 1e-3 * d.input_radius_mm + half, how)
    yield _Line("free_length_m", 1e-3 * d.free_length_mm, "tangent to tangent")
    cable = CABLES[d.cable]
    EA = cable.EA_N(1e-3 * d.cable_diameter_mm)
    told = f"catalogue: {d.cable} of {d.cable_diameter_mm:g} mm"
    yield _Line("EA_N", EA if d.EA_N is None else d.EA_N, told if d.EA_N is None else "as measured")
    yield _Line(
        "pretension_N", _pretension(d), f"set: {d.pretension_set}" if d.pretension_N else "guessed: no slack"
    )
    yield _Line("mu_output", cable.mu, f"catalogue: {d.cable} on metal")
    yield _Line("mu_input", cable.mu, f"catalogue: {d.cable} on metal")
    yield _Line("wrap_output_rad", 2.0 * pi * d.output_turns, f"{d.output_turns:g} turns")
    yield _Line("wrap_input_rad", 2.0 * pi * d.input_turns, f"{d.input_turns:g} turns")


def _pretension(d: Draft) -> float:
    """As given, else what just keeps both cables taut under the greatest load: M/(2 R), half as much again."""
    return d.pretension_N or 0.75 * d.joint_torque_max_Nm / (1e-3 * d.output_radius_mm)


def _tolerance(d: Draft) -> Iterator[_Line]:
    cable = CABLES[d.cable]
    known = d.EA_N is not None
    yield _Line("EA_N", 0.05 if known else cable.EA_spread, "a measurement's" if known else "the catalogue's")
    how = d.pretension_set if d.pretension_N is not None else "unknown"
    yield _Line("pretension_N", PRETENSION[how], how.replace("_", " "))
    yield _Line("mu_output", cable.mu_spread, "the catalogue's")
    yield _Line("mu_input", cable.mu_spread, "the catalogue's")


def _sensors(d: Draft) -> Iterator[_Line]:
    for side, bits in (("joint", d.joint_encoder_bits), ("motor", d.motor_encoder_bits)):
        if bits > 0.0:
            yield _Line(f"{side}_position_resolution_rad", 2.0 * pi / 2.0**bits, f"{bits:g} bit")


def _limits(d: Draft) -> Iterator[_Line]:
    yield _Line("joint_torque_max_Nm", d.joint_torque_max_Nm, "")
    yield _Line("joint_position_min_rad", radians(d.joint_min_deg), f"{d.joint_min_deg:g} deg")
    yield _Line("joint_position_max_rad", radians(d.joint_max_deg), f"{d.joint_max_deg:g} deg")
    if d.motor_torque_max_Nm is not None:
        yield _Line("motor_torque_max_Nm", d.motor_torque_max_Nm, "")
    if d.motor_speed_max_rpm is not None:
        yield _Line(
            "motor_velocity_max_rad_s", _RPM * d.motor_speed_max_rpm, f"{d.motor_speed_max_rpm:g} rpm"
        )


def _lines(rows: Any) -> list[str]:
    shown = [(f"{key} = {float(f'{value:.6g}')!r}", why) for key, value, why in rows]
    return [f"{text:<36}  # {why}" if why else text for text, why in shown]
