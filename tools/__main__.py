"""``python -m tools``: the tools of the checkout."""

import sys

import tools
from ddagr_gym.cli import main

if __name__ == "__main__":
    sys.exit(main(package=tools))
