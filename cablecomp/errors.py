"""One exception tree: the user's input, the device's fault, our own fault."""

from __future__ import annotations


class CablecompError(Exception):
    """Base of every error that cablecomp raises on purpose; its text is one line."""


class InputError(CablecompError):
    """What the user gave is not acceptable: says what, where, what is accepted, what to do (exit code 2)."""


class DeviceError(CablecompError):
    """A device, a bus or a port did not do what it must: the loop goes to a safe stop (exit code 3)."""


class InternalError(CablecompError):
    """A promise of our own was broken: please report it (exit code 4)."""
