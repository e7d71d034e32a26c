"""What a prediction takes for granted about a joint, in plain words, read off its configuration."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Final

from cablecomp.config import JointConfig, Stage
from cablecomp.counting import counted

_LOAD: Final = {
    "joint_torque": "The load is the measured joint torque",
    "motor_torque": "The load is inferred from the measured motor torque and the drive's transmission",
    "none": "The joint is taken as free of load",
    "both_encoders": "The load is inferred from both encoders, so the joint position is an input, not a test",
}
_PARAMETERS: Final = tuple(name for name, field in Stage.model_fields.items() if field.is_required())


def assumptions(config: JointConfig, channels: Collection[str] = ()) -> tuple[str, ...]:
    """Return the assumptions that a replay of a recording with these channels rests on, one sentence each."""
    return tuple(_all(config, channels))


def _all(config: JointConfig, channels: Collection[str]) -> Iterator[str]:
    drive, stages = config.drive, len(config.drive.stage)
    order = f", stages in {drive.arrangement}" if stages > 1 else ""
    yield f"Drive: {drive.circuit} circuit, {counted(stages, 'stage')}{order}; radii reach to the cable's centre."
    yield (
        "Before the first row the cable was at rest at its pretension, without load. Where that is not so, "
        "the band of low and high holds the truth for every admissible history until the two have met."
    )
    yield from _parameters(config)
    yield from _load(config)
    if config.effect:
        yield f"Beyond the plain drive: {', '.join(entry.id for entry in config.effect)}."
    if config.empirical:
        yield f"Empirical laws, without a physical name: {', '.join(law.id for law in config.empirical)}."
    if not config.effect:
        yield "Nothing beyond capstan friction (Coulomb) and a linear elastic cable; pulleys are rigid."
    yield from _sensors(config, channels)


def _parameters(config: JointConfig) -> Iterator[str]:
    known = [name for name in _PARAMETERS if name not in config.tolerance]
    near = [f"{name} ±{100 * value:.3g} %" for name, value in config.tolerance.items() if value < 1.0]
    vague = [name for name, value in config.tolerance.items() if value >= 1.0]
    if known:
        yield f"Taken as exactly known: {', '.join(known)}."
    if near:
        yield f"Taken at nominal value although known only within (1 sigma): {', '.join(near)}."
    if vague:
        yield f"Known only by order of magnitude, taken at the value given: {', '.join(vague)}."


def _load(config: JointConfig) -> Iterator[str]:
    gain, offset = config.sensors.joint_torque_gain, config.sensors.joint_torque_offset_Nm
    trim = f", times {gain:g}, less an offset of {offset:g} N·m" if (gain, offset) != (1.0, 0.0) else ""
    yield f"{_LOAD[config.observer.load]}{trim}; between two rows it moves monotonically."
    if config.observer.input_filter_Hz > 0.0:
        yield f"Inputs are low-passed causally at {config.observer.input_filter_Hz:g} Hz."


def _sensors(config: JointConfig, channels: Collection[str]) -> Iterator[str]:
    if "joint_position_rad" not in channels:
        yield "The recording holds no joint position: the prediction cannot be compared with a measurement."
        return
    offset = config.sensors.joint_position_offset_rad
    if offset == 0.0:
        yield "Both encoders read zero at the same pose; no offset was removed from the residual."
    else:
        yield f"The joint encoder reads {offset:.6g} rad too much; this was taken off the residual."
