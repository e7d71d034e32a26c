"""Recordings: reading any accepted kind as checked blocks of SI channels, writing, and replay through the observer.

Imports the observer and everything below. Start reading at `reader.py`, then `replay.py`; `channels.py` lists names and
units.
"""
