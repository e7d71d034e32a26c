"""Where the residual lies: covariates, and over which of them it is more than noise.

Imports estimation, signal and what lies below, and `folds.py` and `thresholds.py` beside it. Start reading at
`location.py`.
"""
