"""Command line: `python -m asbuilt_training images --out FOLDER --seeds 1000:1500`."""

from __future__ import annotations

import argparse
import sys
from importlib import import_module

# Each command is a module with `arguments(parser)` and `run(given) -> int`; only the one asked for is imported.
COMMANDS = {
    "images": ("asbuilt_training.images.command", "draw training pictures with masks, instances and depth"),
    "fit": ("asbuilt_training.fit", "learn from the pictures for a given time"),
    "mean": ("asbuilt_training.mean", "take the mean of a run's weights and those that it started from"),
    "evaluate": ("asbuilt_training.evaluate", "judge a run on pictures that it never learned from"),
    "export": ("asbuilt_training.export", "write the two ONNX files with their cards"),
    "quantise": ("asbuilt_training.quantise", "try both networks with 8-bit integers"),
    "real": ("asbuilt_training.real.command", "hold the networks against labelled real photographs"),
    "finetune": ("asbuilt_training.finetune", "let the shipped segmenter learn from your own photos and labels"),
}


def main(arguments: list[str] | None = None) -> int:
    """Run one command; its module is imported only now, so that drawing pictures needs no torch."""
    parser = argparse.ArgumentParser(prog="asbuilt_training", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    for name, (_, what) in COMMANDS.items():
        commands.add_parser(name, help=what, add_help=False)
    asked, rest = parser.parse_known_args(arguments)
    try:
        module = import_module(COMMANDS[asked.command][0])
    except ModuleNotFoundError as problem:
        if (problem.name or "").partition(".")[0] in ("asbuilt_training", "asbuilt_bim"):
            raise
        print(f"refused: {asked.command} needs {problem.name}: pip install -e training", file=sys.stderr)
        return 1
    own = argparse.ArgumentParser(prog=f"asbuilt_training {asked.command}", description=module.__doc__)
    module.arguments(own)
    return int(module.run(own.parse_args(rest)))


if __name__ == "__main__":
    raise SystemExit(main())
