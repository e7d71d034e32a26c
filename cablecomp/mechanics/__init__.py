"""The compiled kernel of a cable drive: the tension profile of every wrap is the state, exact for any load history.

Imports the configuration alone. Start reading at `records.py` (what there is, by name) and `profile.py` (one
wrap), then `cable.py`, `circuit.py`, `joint.py`.
"""
