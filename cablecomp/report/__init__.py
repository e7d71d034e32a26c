"""Pages, figures and terminal tables of every result; no result is computed here.

Imports everything but the command line, the guide and the library. Start reading at `page.py` (what every page is made
of), then `replay_page.py`.
"""
