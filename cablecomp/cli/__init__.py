"""The command line: each command builds objects, calls them and shows what came of it; no logic of its own.

May import everything, firmware_sim too (it alone); nothing imports it. Start reading at `app.py`, the list of
commands; every other file is a command, besides `shared.py` (options, progress), `folders.py` (`--out`), `sources.py`
(how recordings are read), `beliefs.py` (the check before belief), `concealing.py` (the other side of `prove`),
`live.py` (`run --live`) and `simulation.py` (`--sim`).
"""

from cablecomp.cli.app import main

__all__ = ["main"]
