"""Fitting a drive's model to recordings: parameters, the fitting problem, least squares, several starts,
profile likelihood intervals.

Imports control (what stiffness a drive has), observer and what lies below; neither links nor recording. Start reading
at `problem.py`.
"""
