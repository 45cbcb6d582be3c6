"""``python -m tdcr`` is the command ``tdcr``."""

import sys

from tdcr._cli import main

if __name__ == "__main__":
    sys.exit(main())
