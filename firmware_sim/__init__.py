"""The other side of the wire: simulated joints behind real bus drivers; shares nothing with `cablecomp`.

Imports nothing of `cablecomp`; of that, the command line alone knows it. Start reading at `plant/` (the joint), then
`firmware/` (the drive and its sensors), `wire/` (their bytes), `ports/` (the bus), `faults/`, `trials/`.
"""
