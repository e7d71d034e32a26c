"""The simulated joint: cables as material points with Coulomb friction at every point, motor, link, sensors, effects.

Imports nothing of the other packages. Start reading at `records.py` (what there is, by name), then
`stepping.py`; `dynamic.py` is the joint that runs live.
"""

from firmware_sim.plant.bench import PlantRun, simulate
from firmware_sim.plant.config import EffectSpec, PlantConfig, StageConfig
from firmware_sim.plant.dynamic import LinkSpec, MotorSpec, Plant, PlantReadings, PlantTruth
from firmware_sim.plant.effects import EFFECTS, FORMS, LISTED, UNLISTED, EffectKind
from firmware_sim.plant.errors import PlantError
from firmware_sim.plant.mesh import COARSE, FINE, NORMAL, Resolution
from firmware_sim.plant.sensors import SensorSpec

__all__ = [
    "COARSE",
    "EFFECTS",
    "FINE",
    "FORMS",
    "LISTED",
    "NORMAL",
    "UNLISTED",
    "EffectKind",
    "EffectSpec",
    "LinkSpec",
    "MotorSpec",
    "Plant",
    "PlantConfig",
    "PlantError",
    "PlantReadings",
    "PlantRun",
    "PlantTruth",
    "Resolution",
    "SensorSpec",
    "StageConfig",
    "simulate",
]
