"""The compiled kernel of a cable drive: the tension profile of every wrap is the state, exact for any load history.

Imports the configuration alone. Start reading at `profile.py` (one wrap), then `cable.py`, `circuit.py`, `joint.py`;
`layout.py` says where everything lies in the arrays.
"""
