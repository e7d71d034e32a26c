"""Blind trials: joints drawn with physics hidden in them, recordings in the open, the truth under a seal.

Imports the plant. Start reading at `generate.py`, then `trial.py`; `python -m firmware_sim.trials.make` runs it.
"""

from firmware_sim.trials.experiment import run_experiment
from firmware_sim.trials.generate import generate
from firmware_sim.trials.plan import KINDS, assignment
from firmware_sim.trials.seal import SEALED, digest, open_truth
from firmware_sim.trials.trial import Trial, draw_trial

__all__ = [
    "KINDS",
    "SEALED",
    "Trial",
    "assignment",
    "digest",
    "draw_trial",
    "generate",
    "open_truth",
    "run_experiment",
]
