"""Snow's thesis as it stands: closed forms, models I to III, design rules, bench evaluation, and its open questions.

Imports observer, effects, signal and configuration; nothing that runs in a control loop imports it.
Start reading at `closed_forms/wrap.py`; `design.py` is the sheet of `cablecomp info`, `bench/evaluate.py` is
`cablecomp identify`, `bench/study.py` is `cablecomp study`.
"""
