"""What physics explains a mismatch: hypotheses, asked cheaply, fitted, scored on data left out, held against
rivals; what would tell more.

Imports estimation, effects and what lies below, `locate` and `thresholds.py` beside it. Start reading at
`selection.py`.
"""
