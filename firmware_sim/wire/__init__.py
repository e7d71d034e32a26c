"""Bytes to records and back, as drives and sensor nodes speak them; no input or output happens here.

Imports the firmware's records alone. Start reading at any codec; each file names the manual that it follows.
"""
