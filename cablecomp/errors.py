"""One exception tree: the user's input, the device's fault, our own fault."""

from __future__ import annotations

from collections.abc import Iterable


class CablecompError(Exception):
    """Base of every error that cablecomp raises on purpose; its text is one line."""


class InputError(CablecompError):
    """What the user gave is not acceptable: says what, where, what is accepted, what to do (exit code 2)."""


class SlackError(InputError):
    """A load beyond what an open circuit bears: the cable would hang slack."""


class NotWrittenError(InputError):
    """A place that takes no file: a full disk, no right to write there."""


class ConfigError(InputError):
    """Everything that is wrong with a configuration; `lines` holds one line for each error."""

    def __init__(self, lines: Iterable[str]) -> None:
        self.lines = tuple(printable(line) for line in lines)
        super().__init__("\n".join(self.lines))


class DeviceError(CablecompError):
    """A device, a bus or a port did not do what it must: the loop goes to a safe stop (exit code 3)."""


class InternalError(CablecompError):
    """A promise of our own was broken: please report it (exit code 4)."""


def printable(text: str) -> str:
    """The text on one line, with everything that a terminal would act upon written out (`\\x1b`)."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in " ".join(text.split()))


def path_text(path: object) -> str:
    """A path as text that can be written anywhere: bytes of its name that are no UTF-8 become `\ufffd`."""
    return str(path).encode("utf-8", "surrogateescape").decode("utf-8", "replace")
