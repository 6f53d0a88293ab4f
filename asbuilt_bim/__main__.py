"""`python -m asbuilt_bim` is `asbuilt-bim`."""

import sys
from pathlib import Path

if __name__ == "__main__" and not sys.flags.safe_path and sys.path[:1] == [str(Path.cwd())]:
    del sys.path[0]  # the folder that one stands in may be a stranger's: a click.py in it is no part of this program

from asbuilt_bim.cli import main

if __name__ == "__main__":  # spawned workers import this module again
    main()
