"""What a joint's model lacks: where its residual lies, which physics explains it, and what no recording has shown yet.

Imports estimation and what lies below, neither links nor the runtime. Start reading at `diagnose.py`, the story from
top to bottom (`calibrate.py` is that of a calibration alone); its rooms, in the order in which they work:
`calibration`, `locate`, `explain`, `describe`, `answer`. `outcome.py` is what one step hands on to the next,
`result.py` what comes out; `folds.py` makes all that is left out, `thresholds.py` holds every number that decides.
"""
