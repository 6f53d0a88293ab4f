"""`python -m asbuilt_bim` is `asbuilt-bim`."""

from __future__ import annotations

from asbuilt_bim.cli import main

if __name__ == "__main__":  # spawned workers import this module again
    main()
