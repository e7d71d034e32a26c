"""The compiled kernel of a cable drive: the tension profile of every wrap is the state, exact for any load history.

Imports configuration and errors. Start reading at `records.py` (what there is, by name) and `profile.py` (one wrap),
then `cable.py`, `circuit.py`, `joint.py`. Where `laws` is None the drive is plain: no tables, and the compiler leaves
out all that stands behind `if laws is not None`. Newton's method is written out in each solver, as compiled code
cannot call SciPy's.
"""
