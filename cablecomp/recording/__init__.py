"""Recordings: reading any accepted kind as checked blocks of SI channels, writing, and replay through the observer.

Imports configuration, signal and what lies below; the observer that replays is handed in. Start reading at
`reader.py`, then `replay.py`; `channels.py` lists names and units.
"""
