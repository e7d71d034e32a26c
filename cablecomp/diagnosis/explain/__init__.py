"""What physics explains a mismatch: hypotheses, asked cheaply, fitted, scored on data left out, held against
rivals; what would tell more.

Imports estimation, effects and what lies below, `calibration`, `locate`, `body.py`, `folds.py`, `pace.py` and
`thresholds.py` beside it. Start reading at `search.py`, which calls `selection.py`, which calls `rounds.py`;
`weighing.py` comes after.
"""
