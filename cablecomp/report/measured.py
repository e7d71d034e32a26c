"""How a value that is known to a standard deviation is written: no digit that this one does not bear out."""

from __future__ import annotations

import math


def rounded(value: float | None, sd: float | None) -> tuple[str, str]:
    """Value with as many decimals as its standard deviation has, and that one with two digits.

    Both in one unit. Where the deviation is none, zero or not finite, the value has five digits and the other text
    is empty; a value that is none, or NaN, is a dash.
    """
    if value is None or math.isnan(value):
        return "–", ""
    if sd is None or not (math.isfinite(sd) and sd > 0.0):
        return f"{value:.5g}", ""
    decimals = 1 - math.floor(math.log10(sd))
    if -1 <= decimals <= 7:
        places = max(decimals, 0)
        return f"{value:.{places}f}", f"{sd:.{places}f}"
    digits = min(max(math.floor(math.log10(max(abs(value), sd) / sd)) + 2, 2), 8)
    return f"{value:.{digits}g}", f"{sd:.2g}"


def with_sd(value: float | None, sd: float | None) -> str:
    """`value ± sd`, both rounded; the value alone where the deviation is not known."""
    return " ± ".join(filter(None, rounded(value, sd)))
