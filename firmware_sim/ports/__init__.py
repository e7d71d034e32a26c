"""Where frames go in and out: python-can buses, an slcan adapter or a serial device on a pseudo-terminal.

Imports the frames of `wire`. Start reading at `base.py`, what a port is.
"""

from firmware_sim.ports.base import Port
from firmware_sim.ports.open import BUSES, open_port
from firmware_sim.ports.pty_port import PtyPort, SerialPort, SlcanPort

__all__ = ["BUSES", "Port", "PtyPort", "SerialPort", "SlcanPort", "open_port"]
