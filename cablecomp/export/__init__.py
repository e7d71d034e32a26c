"""A joint for other people's tools: MuJoCo, URDF, C, FMI; every file says what it leaves out.

May import control and below; start reading at `equivalent.py`, the few numbers that a simulator can take.
"""
