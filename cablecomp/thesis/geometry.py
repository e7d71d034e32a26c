"""Geometry of a cable drive for the designer (thesis, 6.3 and A.3): radii, tangent lengths, size, sensor
compliance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cablecomp.errors import InputError
from cablecomp.thesis.closed_forms.wrap import Array, Number


def effective_radius_m(pulley_radius_m: float, cable_diameter_m: float) -> float:
    """Distance from the axis to the cable's line of force, R_p + d/2 (6.3.1); m. `pulley_radius_m`: of the
    groove's ground.
    """
    return pulley_radius_m + cable_diameter_m / 2.0


def tangent_length_m(centre_distance_m: float, R_m: float, r_m: float, *, crossed: bool) -> float:
    """Free length between two pulleys, sqrt(C^2 - (R + r)^2) crossed, sqrt(C^2 - (R - r)^2) uncrossed (Fig.
    6.1); m.

    `R_m`, `r_m`: effective radii. Raises InputError where the pulleys would overlap.
    """
    if not centre_distance_m > R_m + r_m:
        raise InputError(
            f"centre distance {centre_distance_m:g} m: pulleys of {R_m:g} m and {r_m:g} m overlap; "
            f"more than {R_m + r_m:g} m is accepted"
        )
    reach = R_m + r_m if crossed else R_m - r_m
    return math.sqrt(centre_distance_m**2 - reach**2)


def centre_distance_m(free_length_m: float, R_m: float, r_m: float, *, crossed: bool) -> float:
    """Centre distance that gives a free length, the inverse of `tangent_length_m`; m."""
    return math.hypot(free_length_m, R_m + r_m if crossed else R_m - r_m)


def drive_length_m(centre_distances_m: Sequence[float], first_input_m: float, last_output_m: float) -> float:
    """Length of a drive whose stages lie in a line, sum C_i + r_1 + R_k (6-3); m."""
    return sum(centre_distances_m) + first_input_m + last_output_m


def bend_ratio(pulley_radius_m: float, cable_diameter_m: float) -> float:
    """Pulley diameter over cable diameter; 16 and more is recommended for stranded steel cable (6.3.1, after
    SAVA).
    """
    return 2.0 * pulley_radius_m / cable_diameter_m


def sensor_deflection_rad(
    joint_torque_Nm: Number, ratio: Number, sensor_stiffness_Nm_per_rad: float
) -> Array:
    """Joint angle that the torque sensor's own twist makes up, (r/R) M_s/k = (r/R)^2 M/k (A-1); rad.

    `ratio` = r/R, or the product over the stages; the sensor holds the input pulley and so carries M_s =
    (r/R) M. Zero for an infinite stiffness.
    """
    share = np.asarray(ratio, dtype=float) ** 2
    return np.asarray(share * np.asarray(joint_torque_Nm) / sensor_stiffness_Nm_per_rad)
