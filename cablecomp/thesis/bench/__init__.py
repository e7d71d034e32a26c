"""The thesis's bench: friction from load ramps with holds (chapter 3), and which physics explains what it left open.

Imports the closed forms, observer, effects and signal. Start reading at `evaluate.py`; the study is `study.py`.
"""
