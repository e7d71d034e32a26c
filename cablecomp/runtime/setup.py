"""From configuration, link and control file to joints that can be run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan
from pathlib import Path

from cablecomp.config import JointConfig
from cablecomp.control.command import Reference
from cablecomp.control.compensator import Compensator, Gains
from cablecomp.control.degrade import DegradeTimes
from cablecomp.control.gate import GateLimits
from cablecomp.control.motors import DriveGains
from cablecomp.control.options import CompensatorOptions, ControlConfig, ControlMode
from cablecomp.control.protocol import Protocol
from cablecomp.effects import catalogue
from cablecomp.errors import InputError
from cablecomp.links.link import Link
from cablecomp.links.protocols import tells
from cablecomp.links.readings import JointReadings
from cablecomp.links.records import Mode
from cablecomp.links.schema import JointEnds, LinkConfig
from cablecomp.observer import Observer
from cablecomp.runtime.health import Health
from cablecomp.runtime.joint_loop import JointSetup, References


@dataclass(frozen=True)
class Contestant:
    """One joint of a run: its place on the link (from 0), a name for its folder, its configuration and
    controller.
    """

    place: int
    name: str
    config: JointConfig
    options: CompensatorOptions


def matched(link: LinkConfig, control: ControlConfig, *, own_link: bool) -> tuple[LinkConfig, ControlConfig]:
    """Link and control file that say the same of the drive's stiffness and damping.

    `own_link`: the link is the user's, and what it states holds; else it takes over what the control
    file states.
    """
    motor = link.joint[0].motor
    if motor is None or motor.mode != "impedance":
        return link, control
    if own_link and motor.stiffness_Nm_per_rad > 0.0:
        own = {
            "stiffness_Nm_per_rad": motor.stiffness_Nm_per_rad,
            "damping_Nms_per_rad": motor.damping_Nms_per_rad or control.motor.damping_Nms_per_rad,
        }
        return link, control.model_copy(update={"motor": control.motor.model_copy(update=own)})
    gains = {
        "stiffness_Nm_per_rad": control.motor.stiffness_Nm_per_rad,
        "damping_Nms_per_rad": control.motor.damping_Nms_per_rad,
    }
    ends = link.joint[0].model_copy(update={"motor": motor.model_copy(update=gains)})
    return link.model_copy(update={"joint": (ends, *link.joint[1:])}), control


def stated_gains(link: LinkConfig) -> DriveGains | None:
    """What the link file tells its first drive's own loop, if it does."""
    motor = link.joint[0].motor
    if motor is None or motor.mode != "impedance":
        return None
    stated = DriveGains(motor.stiffness_Nm_per_rad, motor.damping_Nms_per_rad)
    return stated if min(stated) > 0.0 else None


def same_joint(link: LinkConfig, names: Sequence[str]) -> LinkConfig:
    """The link with its first joint once for each name, on nodes counted up from its own."""
    base = link.joint[0]

    def copy(k: int, name: str) -> JointEnds:
        motor = None if base.motor is None else base.motor.model_copy(update={"node": base.motor.node + k})
        sensor = (
            None if base.sensor is None else base.sensor.model_copy(update={"node": base.sensor.node + k})
        )
        return JointEnds(name=name, motor=motor, sensor=sensor)

    return link.model_copy(update={"joint": tuple(copy(k, name) for k, name in enumerate(names))})


def check_drive_timeouts(link: LinkConfig, places: Sequence[int]) -> None:
    """Raise InputError unless every drive is stated to stop by itself when commands stay out."""
    for place in places:
        motor = link.joint[place].motor if 0 <= place < len(link.joint) else None
        if motor is None:
            continue
        timeout, where = motor.command_timeout_s, f"link `{link.name}`, joint `{link.joint[place].name}`"
        if not timeout:
            said = "is not stated" if timeout is None else "is off"
            raise InputError(
                f"{where}: the drive's command timeout {said}, so that it would stay enabled if this process "
                "were killed; set one in the drive and state it as motor.command_timeout_s, or give "
                "--without-drive-timeout"
            )
        if timeout < 3.0 / link.rate_Hz:
            raise InputError(
                f"{where}: motor.command_timeout_s is {timeout:g} s, less than three periods of "
                f"{1.0 / link.rate_Hz:g} s; give the drive a longer one"
            )


def times_of(link: LinkConfig, period_s: float) -> DegradeTimes:
    """The link's timeouts as times of the descent; two periods and a half count as fresh."""
    t = link.timeouts
    fresh = min(2.5 * period_s, t.hold_s)
    return DegradeTimes(fresh, t.hold_s, t.fade_s, t.stop_s, t.fade_s, max(0.5 * t.fade_s, fresh))


def joint_setup(
    c: Contestant,
    mode: ControlMode,
    bus: Link,
    control: ControlConfig,
    references: References,
    gains: Gains,
    period: float,
    *,
    bounds: bool = False,
    resume: Path | None = None,
) -> JointSetup:
    """Everything that one joint of a run needs; raises InputError for what does not fit together."""
    link = bus.config
    if not 0 <= c.place < len(link.joint):
        raise InputError(
            f"link `{link.name}` has {len(link.joint)} joints; joint {c.place + 1} is not among them"
        )
    chosen = c.options.model_copy(update={"mode": mode})
    config = observed(c.config, chosen)
    _check_measured(link, c.place, config.observer.load)
    observer = Observer(config, bounds=bounds)
    if resume is not None:
        observer.load(resume)
    compensator = Compensator(config, chosen, period, observer, gains=gains, motor=control.motor)
    times = times_of(link, period)
    load = config.observer.load
    health = Health(
        control.health,
        config.drive.ratio,
        times.fresh_s,
        period,
        needs_torque=load == "joint_torque",
        needs_joint=load == "both_encoders",
        needs_motor_torque=load == "motor_torque",
        needs_temperature=_reads_temperature(config),
        others=_places(bus.joints[c.place], observer.channels),
        preload_Nm=compensator.preload_Nm,
        motor_step_rad=bus.joints[c.place].motor_step_rad,
    )
    motor = link.joint[c.place].motor
    tells_position = motor is None or motor.mode in (Mode.POSITION, Mode.IMPEDANCE)
    limits = GateLimits.of(
        c.config.limits,
        bus.wire(c.place),
        tells_position=tells_position,
        age_s=times.motor_stop_s,
        balance_Nm=-compensator.preload_Nm,
    )
    return JointSetup(c.place, c.name, config, compensator, health, limits, times, references)


def _check_measured(link: LinkConfig, place: int, load: str) -> None:
    """Raise InputError where the observer's load is to come from a sensor that the link has not."""
    needed = {"joint_torque": "joint_torque_Nm", "both_encoders": "joint_position_rad"}.get(load)
    ends = link.joint[place]
    if needed is not None and not tells(link, ends, needed):
        raise InputError(
            f"joint `{ends.name}`: nothing on link `{link.name}` measures {needed}, where observer.load = "
            f'"{load}" takes the load from; set it to "motor_torque" or "none" in the joint\'s file, or add '
            "[joint.sensor] to the link"
        )


def resumed_at_s(setup: JointSetup) -> float:
    """Time of the last sample that the joint's observer has taken."""
    observer = setup.compensator.observer
    assert isinstance(observer, Observer)
    return float(observer.vector()[-1])


def _reads_temperature(config: JointConfig) -> bool:
    """Whether an effect of the joint goes with its temperature."""
    known = ((catalogue()[e.id], e.parameters) for e in config.effect)
    return any(
        "temperature_degC" in effect.needs
        or any(
            p.needs == "temperature_degC" and given.get(p.name, p.neutral) != p.neutral
            for p in effect.parameters
        )
        for effect, given in known
    )


def _places(readings: JointReadings, channels: Sequence[str]) -> tuple[int, ...]:
    missing = [name for name in channels if name not in readings.others]
    if missing:
        raise InputError(
            f"joint `{readings.name}`: an effect reads `{missing[0]}`, which is not on this link; "
            "add the channel to a device's messages"
        )
    return tuple(readings.index(name) for name in channels)


def observed(config: JointConfig, options: CompensatorOptions) -> JointConfig:
    """The configuration as the run's observer has it: where its load comes from follows from the
    control mode.
    """
    load: str = config.observer.load
    if options.mode is not ControlMode.POSITION:
        load = {"encoders": "both_encoders", "motor_torque": "motor_torque", "sensor": "joint_torque"}[
            options.torque_from
        ]
    return config.model_copy(update={"observer": config.observer.model_copy(update={"load": load})})


def references_of(protocol: Protocol, force: bool) -> References:
    """The protocol as joints see it; joints that ask for the same instant share the answer."""
    asked, answer = nan, Reference()

    def reference(time_s: float) -> Reference:
        nonlocal asked, answer
        if time_s != asked:
            found = protocol.reference(time_s)
            # Except in force mode the load is the surroundings' own: the controller is not told.
            answer = found if force else found._replace(joint_torque_Nm=nan)
            asked = time_s
        return answer

    return reference
