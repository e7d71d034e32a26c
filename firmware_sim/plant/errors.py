"""The plant's own errors."""

from __future__ import annotations


class PlantError(ValueError):
    """What the plant cannot accept or carry on with: one line that says what, where, and what is accepted."""
