"""Real-time hysteresis compensator for cable-driven joints: the public names, each imported when it is first used.

Start reading at `observer/observer.py` (the model that runs), `control/compensator.py` (what it is for) or
`diagnosis/diagnose.py` (what the model lacks); `cablecomp guide` tells the rest.
"""

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
