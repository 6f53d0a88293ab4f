"""`python -m asbuilt_bim` is `asbuilt-bim`."""

import contextlib
import sys
from pathlib import Path

if __name__ == "__main__" and not sys.flags.safe_path:
    # The folder that one stands in may be a stranger's: a click.py in it is no part of this program.
    with contextlib.suppress(OSError):  # it may be gone
        sys.path[:1] = [] if sys.path[0] == str(Path.cwd()) else sys.path[:1]

from asbuilt_bim.cli import main

if __name__ == "__main__":  # spawned workers import this module again
    main()
