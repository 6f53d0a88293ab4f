"""Draw shards of training pictures: colour, class, instance and inverse depth, a file a seed."""

from __future__ import annotations

import argparse
import logging
import os
import sys
from pathlib import Path

_DATA = "ASBUILT_BIM_DATA"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's own arguments."""
    parser.add_argument("--out", type=Path, required=True, help="folder that the shards go to")
    parser.add_argument("--seeds", type=_seeds, required=True, metavar="FIRST:END[:STEP]", help="a shard a seed")
    parser.add_argument("--resume", action="store_true", help="leave alone the shards that are there")
    parser.add_argument("--ifc", type=Path, help=f"folder of real IFC files (default: {_DATA}/ifc; yards without)")
    parser.add_argument("--each", type=_count, default=10, help="most pictures a place; a seed has five places")
    parser.add_argument("--renderer", choices=["raycast", "cycles"], default="raycast", help="cycles needs bpy")


def run(given: argparse.Namespace) -> int:
    """Draw the shards asked for; 0 when all are there."""
    from asbuilt_training.images.draw import draw
    from asbuilt_training.images.shards import Job, draw_shards

    renderer = draw
    if given.renderer == "cycles":
        from asbuilt_training.images.traced import trace

        renderer = trace
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s", stream=sys.stderr)
    ifc = given.ifc or Path(os.environ.get(_DATA, "../shared/data")) / "ifc"
    job = Job(ifc_folder=ifc if ifc.is_dir() else None, pictures_a_place=given.each, renderer=renderer)
    draw_shards(given.out, given.seeds, job, given.resume)
    return 0


def _count(text: str) -> int:
    if not text.isdecimal() or not 0 < int(text) <= 1000:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of pictures from 1 to 1000")
    return int(text)


def _seeds(text: str) -> range:
    try:
        numbers = [int(n) for n in text.split(":")]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3) or min(numbers) < 1 or numbers[1] <= numbers[0]:
        raise argparse.ArgumentTypeError(f"{text!r} is no range of seeds, such as 1000:1100 or 1000:1100:2")
    return range(*numbers)
