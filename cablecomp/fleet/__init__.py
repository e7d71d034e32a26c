"""Many joints, many nights: one row for each, and which joints drift, slip or lose strands.

Imports the diagnosis and what lies below. Start reading at `fleet.py`. A command that is given `--workers` or
`--scheduler` comes here.
"""
