"""Command line: `python -m asbuilt_synthetic site --seed 1 --renderer raycast --out FOLDER`."""

from __future__ import annotations

import argparse
from pathlib import Path

from asbuilt_synthetic.boards import BOARD_PAIRS
from asbuilt_synthetic.sample import write_site
from asbuilt_synthetic.scene import STATIONS

SAMPLE_SEED = 7


def main(arguments: list[str] | None = None) -> int:
    """Write a project folder; `sample` is a site whose photos Cycles takes, of the sample's own seed."""
    parser = argparse.ArgumentParser(prog="asbuilt_synthetic", description=__doc__)
    parser.add_argument("what", choices=["sample", "site"])
    parser.add_argument("--seed", type=int, default=None)
    parser.add_argument("--renderer", choices=["raycast", "cycles"], default=None)
    parser.add_argument("--board-renderer", choices=["raycast", "cycles"], default="raycast")
    parser.add_argument("--boards", type=int, default=BOARD_PAIRS)
    parser.add_argument("--visits", type=int, default=2)
    parser.add_argument("--stations", type=int, default=STATIONS)
    parser.add_argument("--shuttered", action="store_true", help="formwork of thick panels round all that is absent")
    parser.add_argument("--out", type=Path, required=True)
    a = parser.parse_args(arguments)
    is_sample = a.what == "sample"
    write_site(
        a.seed if a.seed is not None else (SAMPLE_SEED if is_sample else 1),
        a.out,
        a.renderer or ("cycles" if is_sample else "raycast"),
        a.visits,
        a.stations,
        a.board_renderer,
        a.boards,
        shuttered=a.shuttered,
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
