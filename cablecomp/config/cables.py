"""A small catalogue of cables: what diameter makes of EA, how far that may be off, how rough the cable is on a pulley.

EA = modulus x circle of the cable's diameter (no metal area has to be known). The spreads are wide, since
construction, lay and bedding-in matter more than the material: `cablecomp calibrate` narrows them.
"""

from __future__ import annotations

from math import pi
from typing import Final, NamedTuple


class Cable(NamedTuple):
    """`modulus_Pa` over the circle of the diameter, its relative spread (1 sigma); coefficient of friction on a
    metal pulley and its spread; where both come from."""

    modulus_Pa: float
    EA_spread: float
    mu: float
    mu_spread: float
    source: str

    def EA_N(self, diameter_m: float) -> float:
        """Axial stiffness of this diameter [N]."""
        return self.modulus_Pa * 0.25 * pi * diameter_m**2


CABLES: Final = {
    "steel-7x7": Cable(
        65e9, 0.30, 0.15, 0.35,
        "rigging tables give 57 GPa over the circle, small bedded-in cables up to "
        "99 (E. R. Snow's, 0.018 in); dry steel on metal",
    ),
    "steel-7x7-nylon": Cable(
        60e9, 0.40, 0.12, 0.30,
        "as steel-7x7, the diameter taken with its coat; nylon on metal as in E. R. Snow's thesis",
    ),
    "steel-7x19": Cable(
        50e9, 0.30, 0.15, 0.35, "rigging tables give 47.5 GPa over the circle; dry steel on metal",
    ),
    "tungsten": Cable(
        110e9, 0.40, 0.17, 0.40,
        "tungsten's modulus is twice that of steel, laid up as fine 7x19 or 7x37 (an estimate: no table at hand)",
    ),
    "uhmwpe": Cable(
        30e9, 0.50, 0.08, 0.40,
        "Dyneema, Spectra: fibre of some 110 GPa, braided and half air (an estimate); creeps, and stiffens with load",
    ),
}  # fmt: skip
"""By name."""
