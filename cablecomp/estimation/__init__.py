"""Fitting a drive's model to recordings: parameters, the fitting problem, least squares, intervals.

Imports recording, observer and what lies below. Start reading at `problem.py`.
"""
