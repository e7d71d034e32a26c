"""Load and deflection in closed form: one wrap, a stage, open and closed circuits, stages in series, energy.

Imports the configuration alone, so that the observer can be tested against it. Start reading at `wrap.py`, then
`stage.py`, `open.py` and `closed.py`.
"""
