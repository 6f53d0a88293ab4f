"""Do two checkouts give the same results? Stage by stage, on the sample, six sites, two pairs, and every command.

`same.py BEFORE AFTER --exact` after moves and new names: every number and state is equal.
`same.py BEFORE AFTER --close` after a change of solver: states equal, areas within 0.05 sigma, completion within 0.1
point; what differs is listed. BEFORE and AFTER are checkouts, or tables that `--keep FILE` wrote earlier.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "house"))
from flatten import Flat, Plain
from stages import dump

ROOT = Path(__file__).resolve().parents[1]
SAMPLE = ROOT / "sample_models" / "site" / "project.yaml"
SEEDS = (20, 31, 37, 106, 108, 139)
"""Sites to develop on: each has been looked at."""
MOST_SIGMAS = 0.05
MOST_POINTS = 0.001
EXACT = 1e-5
"""Two runs of ONE program differ by up to 5e-6 of a value.

Where memory lies decides in which order numbers are summed, and robust fits carry the last digit further. What a
changed rule does is larger by orders.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """One value that isn't the same."""

    where: str
    before: Plain
    after: Plain

    def __str__(self) -> str:
        """Read as one line."""
        return f"{self.where}: {self.before!r} -> {self.after!r}"


def tables(source: Path, projects: list[Path]) -> dict[str, Flat]:
    """Return the tables of a checkout, made now, or of a file that was kept."""
    if source.is_file():
        return dict(json.loads(source.read_text(encoding="utf-8")))
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-same-") as scratch:
        out = Path(scratch) / "tables.json"
        dump(source.resolve(), out, projects)
        return dict(json.loads(out.read_text(encoding="utf-8")))


def exact(before: Flat, after: Flat, where: str) -> Iterator[Difference]:
    """Yield what isn't equal. A key that is new is no difference: results grow by addition."""
    for key, old in before.items():
        new = after.get(key, "missing")
        numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in (old, new))
        if old != new and not (numbers and _near(float(old), float(new))):  # type: ignore[arg-type]
            yield Difference(where=f"{where}{key}", before=old, after=new)


def _near(old: float, new: float) -> bool:
    return abs(old - new) <= EXACT * max(abs(old), abs(new), 1.0) or (old != old and new != new)


def close(before: Flat, after: Flat, where: str) -> Iterator[Difference]:
    """Yield what differs by more than a solver may: states, areas by their sigma, completion."""
    for key, old in before.items():
        new, name = after.get(key, "missing"), key.rsplit("/", 1)[-1]
        if name in ("state", "kind", "label", "element", "whole", "cut_by_frame", "occluded"):
            differs = old != new
        elif not (isinstance(old, float) and isinstance(new, float)):
            differs = name in ("best", "lower", "upper", "area_m2", "as_built_area_m2") and type(old) is not type(new)
        elif name in ("best", "lower", "upper", "coverage"):
            differs = abs(old - new) > MOST_POINTS
        elif name in ("area_m2", "as_built_area_m2"):
            differs = abs(old - new) > MOST_SIGMAS * _sigma(before, key)
        else:
            differs = False
        if differs:
            yield Difference(where=f"{where}{key}", before=old, after=new)


def _sigma(table: Flat, key: str) -> float:
    """Return the sigma that stands beside an area, 1e-4 m2 where there is none (rounding in tables)."""
    stem = key.rsplit("/", 1)[0]
    names = ("area_sigma_calibration_m2", "area_sigma_image_m2", "as_built_sigma_m2")
    names += ("as_built_sigma_calibration_m2", "as_built_sigma_image_m2")
    parts = [table.get(f"{stem}/{name}") for name in names]
    return max(sum(float(part) ** 2 for part in parts if isinstance(part, float)) ** 0.5, 2e-3)


def main() -> int:
    """Compare, print a table, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path)
    how = parser.add_mutually_exclusive_group(required=True)
    how.add_argument("--exact", action="store_true")
    how.add_argument("--close", action="store_true")
    parser.add_argument("--quick", action="store_true", help="the sample alone")
    parser.add_argument("--keep", type=Path, help="keep AFTER's tables in this file")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument("--check", action="store_true", help="exit 1 where something differs")
    parser.add_argument("--show", type=int, default=40, help="differences to print")
    asked = parser.parse_args()
    projects = [SAMPLE] if asked.quick else [SAMPLE, *_sites()]
    after = tables(asked.after, projects)
    if asked.keep:
        asked.keep.write_text(json.dumps(after), encoding="utf-8")
    before = tables(asked.before, projects) if asked.before != asked.after else after
    rule = exact if asked.exact else close
    found: list[Difference] = []
    print(f"{'stage or file':<58} {'values':>8} {'differ':>7}")
    for name, table in before.items():
        if name not in after and (asked.quick or name.endswith((".jpg", ".html"))):
            continue
        own = list(rule(table, after.get(name, {}), f"{name} "))
        found += own
        if own or not name.endswith((".jpg", ".html")):
            print(f"{name:<58} {len(table):>8} {len(own):>7}")
    values = sum(map(len, before.values()))
    print(f"\n{values} values, {len(found)} differ ({'exact' if asked.exact else 'close'})")
    for difference in found[: asked.show]:
        print(f"  {difference}")
    if asked.json:
        rows = [str(item) for item in found[:200]]
        asked.json.write_text(json.dumps({"values": values, "differ": len(found), "rows": rows}, indent=1) + "\n")
    return 1 if asked.check and found else 0


def _sites() -> list[Path]:
    """Return the project files of the development sites, drawn once into ASBUILT_BIM_BENCH."""
    from sites import benchmark_folder, generated_site

    kept = os.environ.get("ASBUILT_BIM_BENCH", "")
    print(f"Sites are kept in {kept or benchmark_folder()}")
    return [generated_site(seed) / "project.yaml" for seed in SEEDS]


if __name__ == "__main__":
    sys.exit(main())
