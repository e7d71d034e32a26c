"""What has no name: unknown structure in words and as a sparse law, and series in one channel that a joint can carry.

Imports `locate`, `explain`, `folds.py` and `thresholds.py` beside it and what they import. Start reading at
`unknown.py`.
"""
