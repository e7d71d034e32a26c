"""The guide that ships with the package: Markdown topics beside this file, and a reference made from docstrings.

Imports nothing but what it describes. Start reading at `topics.py`; `cablecomp guide` shows them.
"""
