"""`python -m r2art`."""

import sys

from r2art.cli import main

sys.exit(main())
