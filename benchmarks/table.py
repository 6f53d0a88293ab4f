"""What every benchmark prints: a table of lines, each with its figure, its limit and its n."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict, dataclass
from pathlib import Path

LEAST_N = 25
"""A line that rests on fewer cases proves nothing, and fails."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One thing to be shown: `holds` is None where the line only informs."""

    what: str
    figure: str
    limit: str
    n: int
    holds: bool | None


def line(what: str, figure: str, limit: str, n: int, holds: bool, least_n: int = LEAST_N) -> Line:
    """Judge a line: it fails where its n is too small, whatever its figure."""
    return Line(what=what, figure=figure, limit=limit, n=n, holds=bool(holds and n >= least_n))


def told(what: str, figure: str, n: int) -> Line:
    """Return a line that informs and isn't judged."""
    return Line(what=what, figure=figure, limit="", n=n, holds=None)


def options(description: str) -> argparse.ArgumentParser:
    """Return the options that every benchmark has."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--check", action="store_true", help="exit 1 where a line falls short")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument("--quick", action="store_true", help="under a minute, on less")
    return parser


def report(title: str, lines: list[Line], args: argparse.Namespace, extra: dict[str, object] | None = None) -> int:
    """Print the table, write the figures, and return the exit code."""
    width = max(len(item.what) for item in lines)
    figure = max(len(item.figure) for item in lines)
    limit = max(len(item.limit) for item in lines)
    print(f"\n{title}")
    for item in lines:
        verdict = {True: "holds", False: "FALLS SHORT", None: ""}[item.holds]
        print(f"  {item.what:<{width}}  {item.figure:>{figure}}  {item.limit:<{limit}}  n {item.n:<5} {verdict}")
    if args.json:
        document = {"title": title, "lines": [asdict(item) for item in lines], **(extra or {})}
        args.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return 1 if args.check and any(item.holds is False for item in lines) else 0
