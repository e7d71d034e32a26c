"""A joint for other people's tools: MuJoCo, URDF, C, FMI; every file says what it leaves out.

Imports control, recording (how files are written) and what lies below. Start reading at `equivalent.py`, the few
numbers that a simulator can take.
"""
