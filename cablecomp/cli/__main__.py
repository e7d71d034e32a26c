"""`python -m cablecomp.cli`."""

import sys

from cablecomp.cli.app import main

sys.exit(main())
