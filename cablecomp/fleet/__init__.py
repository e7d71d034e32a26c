"""Many joints, many nights: one row for each, and which joints drift, slip or lose strands.

May import the diagnosis and below; start reading at `fleet.py`. A command that is given `--workers` or
`--scheduler` comes here.
"""
