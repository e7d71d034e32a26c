"""Bytes to records and back, as drives and sensor nodes speak them; no input or output happens here."""
