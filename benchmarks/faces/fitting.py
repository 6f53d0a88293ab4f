"""What the fits on twins share: options, measuring scene by scene or taking up what was kept, writing the model."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from asbuilt_bim.geometry.arrays import FloatArray
from benchmarks.faces.border_truth import crowded_twin, station_twins
from benchmarks.faces.twins import TwinPair
from benchmarks.table import options

Observed = TypeVar("Observed")


def fitting_options(text: str) -> argparse.ArgumentParser:
    """Return the options of a benchmark that fits, with `text` as its help."""
    parser = options(text)
    parser.add_argument("--write", action="store_true", help="write what was fitted into the package")
    parser.add_argument("--seeds", type=int, nargs="*", help="other seeds than the development ones")
    parser.add_argument("--sites", type=int, nargs="*", help="other sites than the development ones")
    parser.add_argument("--read", type=Path, nargs="*", help="fit on what --rows kept, measure nothing")
    return parser


def observed(
    args: argparse.Namespace,
    seeds: Sequence[int],
    of: Callable[[TwinPair, str], list[Observed]],
    read_back: Callable[[Sequence[Path]], list[Observed]],
    sites: Sequence[int] = (),
) -> list[Observed]:
    """Return what was kept in files, or else what `of` finds in each scene of `seeds` and each station of `sites`."""
    if args.read:
        return read_back(args.read)
    found: list[Observed] = []
    for seed in seeds[:2] if args.quick else seeds if args.seeds is None else args.seeds:
        found += of(crowded_twin(seed), f"twin {seed}")
        print(f"scene {seed}: {len(found)} so far", file=sys.stderr, flush=True)
    for seed in () if args.quick else sites if args.sites is None else args.sites:
        for name, pair in station_twins(seed):
            found += of(pair, name)
        print(f"site {seed}: {len(found)} so far", file=sys.stderr, flush=True)
    return found


def left_out_sigmas(values: FloatArray) -> FloatArray:
    """Return what numbers are known to, of what each fit without one scene gives, values (scenes, numbers).

    Reference: Quenouille 1956, notes on bias in estimation.
    """
    sigmas: FloatArray = np.sqrt(max(len(values) - 1, 1) * np.mean(np.square(values - values.mean(axis=0)), axis=0))
    return sigmas
