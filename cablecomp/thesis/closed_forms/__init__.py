"""Load and deflection in closed form: one wrap, a stage, open and closed circuits, stages in series, energy.

Imports configuration and errors alone, so that the observer can be tested against it. Start reading at `wrap.py`, then
`stage.py`, `open.py` and `closed.py`.
"""
