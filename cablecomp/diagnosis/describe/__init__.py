"""What has no name: unknown structure in words and as a sparse law, and series in one channel that a joint can carry.

Imports `locate` and `explain` beside it and what they import. Start reading at `unknown.py`.
"""
