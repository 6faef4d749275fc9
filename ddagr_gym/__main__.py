"""``python -m ddagr_gym``: the same as the ``ddagr`` command."""

import sys

from ddagr_gym.cli import main

sys.exit(main())
