"""``python -m tendon_newton``: the command line."""

import sys

from tendon_newton.cli import main

if __name__ == "__main__":
    sys.exit(main())
