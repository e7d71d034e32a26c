"""Statistics of sampled signals, of any joint or none: smoothing, noise floor, autocorrelation.

Imports errors and the compiler's decorators alone. Start reading at `noise.py`.
"""
