"""Watches the residual of a running joint: a sequential test with a stated rate of false alarms, and what lay
around it.

Imports diagnosis (to say where the mismatch lies) and what lies below; the runtime does not know of it. Start
reading at `live.py`; the test itself is `sequential.py`.
"""
