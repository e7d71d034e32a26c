"""What physics explains a mismatch: hypotheses, asked cheaply, fitted, scored on data left out, held against rivals.

Imports estimation, effects and what lies below. Start reading at `selection.py`.
"""
