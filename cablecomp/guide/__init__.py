"""The guide that ships with the package: Markdown topics beside this file, and a reference made from docstrings.

Imports the report's page and errors; the reference looks at every module that it describes. Start reading at
`topics.py`; `cablecomp guide` shows them.
"""
