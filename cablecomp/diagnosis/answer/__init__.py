"""What a diagnosis says, out of its fits: verdict, values, names, candidates and ties, errors on data left out, the
joint it ends with.

Imports every other room of the diagnosis. Start reading at `diagnosis.py`, which puts it together out of `entries.py`.
"""
