"""The drive as it is: calibrated within its tolerances, on thinned rows and then on every sample.

Imports estimation and what lies below, and `body.py`, `pace.py` and `thresholds.py` beside it. Start reading at
`drive.py`.
"""
