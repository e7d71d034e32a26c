"""Blind trials of the diagnosis: a sealed truth, verdicts reached without it, and the score.

Imports diagnosis and what lies below, never the plant that conceals (the command line brings the two together).
Start reading at `prove.py` (simulated joints) or `own.py` (the user's own recordings); both stand on `run.py`.
"""
