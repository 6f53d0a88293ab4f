"""What every benchmark prints: a table of lines, each with its figure, its limit and its n."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

LEAST_N = 25
"""A line that rests on fewer cases proves nothing, and fails."""
SHARES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
"""The quantiles that are recorded of what has many values: the least, 5 %, 25 %, ... the most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One line to be shown: `holds` is None where the line only informs."""

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


def unjudged(lines: list[Line], fewer_than: float = float("inf")) -> list[Line]:
    """Return the lines with those of too few cases only informing: of a quick run, they prove nothing."""
    return [told(one.what, one.figure, one.n) if one.holds is not None and one.n < fewer_than else one for one in lines]


def options(description: str) -> argparse.ArgumentParser:
    """Return the options that every benchmark has."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--check", action="store_true", help="exit 1 where a line falls short")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument("--rows", type=Path, help="write every single case to this file, too; there may be thousands")
    parser.add_argument("--quick", action="store_true", help="under a minute, on less")
    return parser


def quantiles(values: Iterable[float]) -> dict[str, object]:
    """Return what is recorded of many values: their number, and the quantiles of the finite ones."""
    given = [float(value) for value in values]
    finite = [value for value in given if math.isfinite(value)]
    found = [float(f"{value:.4g}") for value in np.quantile(finite, SHARES)] if finite else []
    return {"n": len(given), "finite": len(finite), "quantiles": found}


def report(
    title: str,
    lines: list[Line],
    args: argparse.Namespace,
    summary: dict[str, object] | None = None,
    rows: dict[str, object] | None = None,
) -> int:
    """Print the table, write the figures with `summary`, write `rows` where asked for, and return the exit code."""
    width = max(len(item.what) for item in lines)
    figure = max(len(item.figure) for item in lines)
    limit = max(len(item.limit) for item in lines)
    print(f"\n{title}")
    for item in lines:
        verdict = {True: "holds", False: "FALLS SHORT", None: ""}[item.holds]
        print(f"  {item.what:<{width}}  {item.figure:>{figure}}  {item.limit:<{limit}}  n {item.n:<5} {verdict}")
    if args.json:
        document = {"title": title, "lines": [asdict(item) for item in lines], **(summary or {})}
        args.json.write_text(document_text(document), encoding="utf-8")
    if args.rows:
        args.rows.write_text(document_text(rows or {}), encoding="utf-8")
    return 1 if args.check and any(item.holds is False for item in lines) else 0


def document_text(document: dict[str, object]) -> str:
    """Write a document as JSON whose lists and objects have one entry a line: a change then shows as one line."""
    return "{\n" + ",\n".join(f" {json.dumps(key)}: {_value(value)}" for key, value in document.items()) + "\n}\n"


def _value(value: object) -> str:
    if isinstance(value, dict) and value:
        return "{\n" + ",\n".join(f"  {json.dumps(key)}: {json.dumps(inner)}" for key, inner in value.items()) + "\n }"
    if isinstance(value, list) and value:
        return "[\n" + ",\n".join(f"  {json.dumps(inner)}" for inner in value) + "\n ]"
    return json.dumps(value)


def write_model(args: argparse.Namespace, path: Path, document: Mapping[str, object]) -> None:
    """Write a model into the package, a key a line, where asked to; never what a quick run gave."""
    if args.write and not args.quick:
        text = ",\n".join(f" {json.dumps(key)}: {json.dumps(value)}" for key, value in document.items())
        path.write_text("{\n" + text + "\n}\n", encoding="utf-8")
