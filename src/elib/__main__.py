"""``python -m elib``: the same as ``elib``."""

import sys

from elib.cli import main

if __name__ == "__main__":
    sys.exit(main())
