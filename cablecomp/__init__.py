"""Real-time hysteresis compensator for cable-driven joints: the public names, each imported when it is first used.

One sample's way: `cli/run.py` begins `runtime/run.py`, whose loop (`runtime/loop.py`) lets each joint
(`runtime/joint_loop.py`) take what came over `links/link.py`; `control/compensator.py` asks `observer/observer.py`,
which enters the kernel by `observer/stepper.py`: `mechanics/joint.py`, `mechanics/circuit.py`, `mechanics/cable.py`,
`mechanics/profile.py`. Back come an estimate and a command, past `control/gate.py` onto the link. One recording's way:
`cli/diagnose.py`, `recording/reader.py`, `diagnosis/diagnose.py` from top to bottom, `report/diagnosis_page.py`.
`cablecomp guide` tells the rest.
"""

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
