"""What is done with one real IFC file, and what may go wrong: written, compared, validated, written again, stripped."""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import ifcopenshell
from ifctester import ids

from asbuilt_bim.errors import AsBuiltError
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.ifc.read.source import open_ifc
from asbuilt_bim.ifc.write.copy import strip_asbuilt, write_asbuilt
from asbuilt_bim.report.drawings.colours import STATE_COLOURS
from benchmarks.ifc.compare import changes, new_errors, same
from benchmarks.ifc.invented import invented_reports
from benchmarks.ifc.plan import add_plan
from benchmarks.sites import ROOT

IDS = ROOT / "schemas" / "asbuilt-bim.ids"
COMPLAINTS = {
    "changed": "originals unchanged but for the short list",
    "errors": "no new validation error, express rules too",
    "rules_broken": "the IDS passes",
    "not_idempotent": "written twice is the same, line by line",
    "not_stripped": "stripped is the source again, line by line",
}


@dataclass(kw_only=True)
class Round:
    """What became of one source; every list of complaints should be empty."""

    added: int = 0
    write_s: float = 0.0
    changed: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)
    rules_broken: list[str] = field(default_factory=list)
    not_idempotent: list[str] = field(default_factory=list)
    not_stripped: list[str] = field(default_factory=list)


@dataclass(kw_only=True)
class FileResult:
    """What became of one file: as it is, and with a schedule and a budget added to it and colours asked for."""

    name: str
    bytes: int
    schema: str = ""
    refused: str = ""
    inspected: str = ""  # "yes", or why it was refused
    elements: int = 0
    inspect_s: float = 0.0
    peak_mb: float = 0.0
    plain: Round = field(default_factory=Round)
    planned: Round = field(default_factory=Round)
    crashed: str = ""

    @property
    def complaint(self) -> str:
        """Return what is wrong, in one line; "" where all is well."""
        return "; ".join(
            f"{which} {what}: {len(found)}, e.g. {found[0][:300]}"
            for which, inside in (("plain", self.plain), ("planned", self.planned))
            for what in COMPLAINTS
            if (found := getattr(inside, what))
        )


def examine(path: Path, name: str, inspect: bool) -> FileResult:
    """Do with one file all that is asked, and say what went wrong."""
    result = FileResult(name=name, bytes=path.stat().st_size)
    try:
        source = open_ifc(path)
        result.schema, result.elements = source.schema_identifier, len(invented_reports(source)[-1].elements)
        with tempfile.TemporaryDirectory() as place:
            result.plain = _round(path, Path(place), colour=False)
            result.peak_mb = peak_mb()
            if result.elements:
                add_plan(source)
                source.write(f"{place}/planned.ifc")
                result.planned = _round(Path(place) / "planned.ifc", Path(place), colour=True)
    except AsBuiltError as problem:
        result.refused = str(problem).replace(str(path), name)
    if inspect:
        start = time.perf_counter()
        try:
            read_design(path)
            result.inspected = "yes"
        except AsBuiltError as problem:
            result.inspected = str(problem).replace(str(path), name)
        result.inspect_s = time.perf_counter() - start
    return result


def _round(path: Path, place: Path, colour: bool) -> Round:
    source, result = ifcopenshell.open(str(path)), Round()
    *earlier, last = invented_reports(source)
    colours = STATE_COLOURS if colour else None
    first, second, bare = (place / name for name in ("first.ifc", "second.ifc", "bare.ifc"))
    start = time.perf_counter()
    write_asbuilt(path, last, first, earlier=earlier, colours=colours)
    result.write_s = time.perf_counter() - start
    written = ifcopenshell.open(str(first))
    result.changed, added = changes(source, written, colour)
    result.added = len(added)
    result.errors = new_errors(source, written, added)
    result.rules_broken = rules_broken(written)
    write_asbuilt(first, last, second, earlier=earlier, colours=colours)
    result.not_idempotent = same(written, ifcopenshell.open(str(second)))
    strip_asbuilt(second, bare)
    result.not_stripped = same(source, ifcopenshell.open(str(bare)))
    return result


def rules_broken(file: ifcopenshell.file) -> list[str]:
    """Return the rules of our IDS that ifctester finds broken."""
    rules = ids.open(str(IDS))
    rules.validate(file, should_filter_version=True)
    return [
        f"{rule.name}: {len(rule.failed_entities)} entities" for rule in rules.specifications if rule.status is False
    ]


def peak_mb() -> float:
    """Return this process's largest resident memory so far; 0 where the system doesn't tell."""
    try:
        import resource
    except ImportError:  # Windows
        return 0.0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1024.0 if sys.platform != "darwin" else 1024.0**2)
