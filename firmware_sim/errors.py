"""What the simulation says when what it was given cannot be used: one line, exit code 2."""

from __future__ import annotations


class SimError(Exception):
    """Bad input to the simulation: says what came, what is accepted, what to do."""
