"""Blind trials: joints drawn with physics hidden in them, recordings in the open, each truth under a seal.

Imports the plant. Start reading at `generate.py`, then `world.py`; `python -m firmware_sim.trials.make` makes the same
trials with their truth beside them.
"""

from firmware_sim.trials.experiment import run_experiment
from firmware_sim.trials.generate import generate
from firmware_sim.trials.order import IMPERFECTIONS, KINDS, LAWS, Wanted
from firmware_sim.trials.seal import SEALED, digest, open_truth
from firmware_sim.trials.world import World, draw_world

__all__ = [
    "IMPERFECTIONS",
    "KINDS",
    "LAWS",
    "SEALED",
    "Wanted",
    "World",
    "digest",
    "draw_world",
    "generate",
    "open_truth",
    "run_experiment",
]
