"""`python -m asbuilt_bim` is `asbuilt-bim`."""

from asbuilt_bim.cli import main

if __name__ == "__main__":  # spawned workers import this module again
    main()
