"""A joint watched while it runs: one instrumentation in the loop, a process beside it that serves whoever looks on.

`instrument.py` is all that the loop sees: a datagram now and then, never waited for. `viewer.py` is the other process:
it turns datagrams into frames (`frames.py`) and hands them to the page (`server.py`) and to other programs
(`sinks.py`).

Imports the runtime and what lies below. Start reading at `instrument.py`.
"""
