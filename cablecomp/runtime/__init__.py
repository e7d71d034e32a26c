"""A joint under control in real time: clock, loop, health of the data, stop, timing report.

Imports control, links, recording and what lies below. Start reading at `run.py`, then `loop.py` (all joints of a link)
and `joint_loop.py` (one joint's cycle).
"""
