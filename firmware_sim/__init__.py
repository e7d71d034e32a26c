"""The other side of the wire: simulated joints behind real bus drivers; shares nothing with `cablecomp`."""
