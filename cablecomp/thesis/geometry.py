"""The twist of a torque sensor that holds the input pulley (thesis, A.3)."""

from __future__ import annotations

import numpy as np

from cablecomp.thesis.closed_forms.wrap import Array, Number


def sensor_deflection_rad(
    joint_torque_Nm: Number, ratio: Number, sensor_stiffness_Nm_per_rad: float
) -> Array:
    """Joint angle that the torque sensor's own twist makes up, (r/R) M_s/k = (r/R)^2 M/k (A-1); rad.

    `ratio` = r/R, or the product over the stages; the sensor holds the input pulley and so carries M_s =
    (r/R) M. Zero for an infinite stiffness.
    """
    share = np.asarray(ratio, dtype=float) ** 2
    return np.asarray(share * np.asarray(joint_torque_Nm) / sensor_stiffness_Nm_per_rad)
