"""Joints on CAN buses and serial lines: frames without I/O, ports that read cheaply, devices, the link that joins them.

Imports configuration, the shipped examples, signals and errors. Start reading at `link.py`; a protocol is a pair such
as `mit.py` (bytes) and `device_mit.py` (what the loop asks of it). The public names are imported when they are first
used: whoever wants to know what a link file may hold needs no bus.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
