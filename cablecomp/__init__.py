"""Real-time hysteresis compensator for cable-driven joints: the public names."""

from cablecomp.config import JointConfig, load_joint, parse_joint
from cablecomp.control.command import Command, Reference
from cablecomp.control.compensator import Compensator
from cablecomp.errors import CablecompError, DeviceError, InputError, InternalError
from cablecomp.observer import ErasePlan, Observer, WrapProfile, plan_erase
from cablecomp.signals import Estimate, Sample

__all__ = [
    "CablecompError",
    "Command",
    "Compensator",
    "DeviceError",
    "ErasePlan",
    "Estimate",
    "InputError",
    "InternalError",
    "JointConfig",
    "Observer",
    "Reference",
    "Sample",
    "WrapProfile",
    "load_joint",
    "parse_joint",
    "plan_erase",
]
