"""What the motor is told: feed-forward of the observed deflection, position, force and impedance loops, the last gate.

Imports the observer and what lies below, no link and no clock. Start reading at `compensator.py`; `design.py` finds
its gains, `gate.py` is what every command passes last.
"""
