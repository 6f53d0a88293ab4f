"""The end of a run on the terminal: storeys with completion and bounds, and which stations were left out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from asbuilt_bim.camera.calibration.area_effect import area_effect
from asbuilt_bim.camera.calibration.calibrate import Calibration
from asbuilt_bim.camera.calibration.check_length import LengthCheck
from asbuilt_bim.codes import Note, Reason, SubjectKind
from asbuilt_bim.progress.report import Completion, GroupProgress, ProgressReport
from asbuilt_bim.project.model import Visit
from asbuilt_bim.report.page.calibration import area_words, verdict
from asbuilt_bim.report.tables import measured_words, of_whole_visit, station_doubts, station_of, storey_names
from asbuilt_bim.report.wording.completion import (
    AT_LEAST,
    BEST,
    POSSIBLY,
    SEEN,
    at_most,
    best_words,
    in_words,
    seen_words,
)
from asbuilt_bim.report.wording.notes import note_words
from asbuilt_bim.report.wording.of_page.alike import notes_alike, rejections_alike
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.report.wording.values import area, percent, percent_certain, plain
from asbuilt_bim.terminal.screen import Screen

TABLE_WIDTH, MORE_WIDTH = 116, 12
"""Columns that the table needs, and more for a state that isn't everywhere; a narrower terminal gets lines."""
MAX_NOTES = 4
_OF_COSTS = frozenset({Reason.NOT_IN_COST_LINES, Reason.COSTS_FORMULAS, Reason.COSTS_INSTEAD})
"""Codes of notes on a costs table as a whole."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignFiles:
    """The names of the files that a design was read from; "" where there is none."""

    ifc: str
    costs: str = ""
    schedule: str = ""

    def of(self, note: Note) -> str:
        """Return the file that a note on the design is about."""
        kind = note.subject.kind
        if self.costs and (kind is SubjectKind.COST_LINE or note.code in _OF_COSTS):
            return self.costs
        of_schedule = kind is SubjectKind.SCHEDULE or note.code.name.startswith("SCHEDULE_")
        return self.schedule if self.schedule and of_schedule else self.ifc


def summary(report: ProgressReport, width: int) -> Table | str:
    """Return storey, elements by state, at least and possibly, best estimate, what was seen, measured area."""
    columns = report.whole.displaced, report.whole.as_far_as_seen
    needed = TABLE_WIDTH + sum(MORE_WIDTH for count in columns if count)
    return _table(report) if width >= needed else "\n".join(_lines(report))


def _title(report: ProgressReport) -> str:
    return f"{report.project_name}, visit {report.visit_date.isoformat()}"


def _lines(report: ProgressReport) -> list[str]:
    lines = [_title(report)]
    names = storey_names(report)
    for name, group in [*((names[storey.key], storey) for storey in report.storeys), ("whole", report.whole)]:
        counts = ", ".join(f"{count} {state}" for state, count in _counts(group, report).items())
        lines += [
            f"{name}: {completion_text(group.completion)}",
            f"  {len(group.elements)} elements: {counts}",
            f"  {SEEN} {seen_words(group.completion)}, measured {measured_words(group, report)}",
        ]
    return lines


def _table(report: ProgressReport) -> Table:
    table = Table(title=_title(report), title_justify="left", box=SIMPLE_HEAD)
    table.add_column("Storey", no_wrap=True)
    wrapped = (BEST, *_counts(report.whole, report))
    for heading in (AT_LEAST, POSSIBLY, BEST, SEEN, *_counts(report.whole, report), "measured"):
        table.add_column(heading, justify="right", no_wrap=heading not in wrapped)
    names = storey_names(report)
    for storey in report.storeys:
        table.add_row(*_cells(storey, names[storey.key], report))
    table.add_section()
    table.add_row(*_cells(report.whole, "whole", report), style="bold")
    return table


def completion_text(completion: Completion) -> str:
    """Return completion as people read it: `at least 48 %, possibly 86 %; best estimate 59 %`."""
    return f"{in_words(completion)}; {BEST} {best_words(completion)}"


def left_out(stations: Sequence[str], report: ProgressReport) -> dict[str, list[str]]:
    """Return each station of `stations` that the report doesn't count, with the reasons."""
    return {name: _reasons(name, report) for name in stations if name not in report.placed}


def time_line(seconds: Mapping[str, float]) -> str:
    """Return how long a run took, and each step's share of it."""
    total = sum(seconds.values())
    shares = "; ".join(f"{step} {percent(spent / total)}" for step, spent in seconds.items()) if total > 0.0 else ""
    return f"Took {total:.0f} s: {shares}." if shares else "Took no time."


def calibration_lines(calibration: Calibration, known_lengths: tuple[LengthCheck, ...] | None = None) -> list[str]:
    """Return what a calibration says of itself, and the boards that it left out.

    With the `known_lengths` that it was held against (perhaps none) also the verdict of its page.
    """
    rig = calibration.rig
    points = len(calibration.corners_left.view), len(calibration.corners_right.view)
    seen = f"{rig.views_used} {'sightings of tags' if calibration.from_tags else 'board pairs'}"
    if calibration.from_control_points:
        seen = f"{points[0]} and {points[1]} control points"
    lines = [
        f"Rig: baseline {rig.baseline_m * 1000:.2f} mm, focal length {rig.left.K[0, 0]:.1f} px (left) and "
        f"{rig.right.K[0, 0]:.1f} px (right), {seen}, {rig.rms_px:.2f} px rms"
    ]
    checks, effect = calibration.checks, area_effect(rig, calibration.by_source)
    if effect is not None:
        lines.append(
            f"  known to ±{checks.baseline_sigma_m * 1000:.2f} mm and ±{checks.focal_sigma_px:.2f} px. "
            f"{area_words(effect)} (one sigma)"
        )
    reasons: Sequence[str] = [note_words(warning) for warning in checks.warnings]
    if known_lengths is not None:
        judged = verdict(calibration, effect, known_lengths)
        lines.append(f"  {judged.sentence}")
        reasons = judged.reasons
    lines += [f"  take care: {reason}" for reason in reasons]
    return lines + [f"  left out: {words_of(rejection)}" for rejection in calibration.left_out]


def _cells(group: GroupProgress, name: str, report: ProgressReport) -> list[Text]:
    counts = (str(count) for count in _counts(group, report).values())
    return [Text(text) for text in (name, *_shares(group), *counts, _measured(group))]


def _counts(group: GroupProgress, report: ProgressReport) -> dict[str, int]:
    """Return the numbers of a group's elements by state; some states have a place only where there are any."""
    counts = {"complete": group.surely_complete}
    if report.whole.as_far_as_seen:
        counts["as far as seen"] = group.as_far_as_seen
    counts |= {"part": group.part, "not started": group.not_started}
    if report.whole.displaced:
        counts["displaced"] = group.displaced
    return counts | {"unknown": group.unknown}


def _shares(group: GroupProgress) -> tuple[str, ...]:
    done = group.completion
    return percent_certain(done.lower), at_most(done.upper), best_words(done), seen_words(done)


def _measured(group: GroupProgress) -> str:
    return area(group.as_built_area_m2, group.as_built_sigma_m2) if group.as_built_area_m2 > 0 else "none"


def _reasons(name: str, report: ProgressReport) -> list[str]:
    about = [r for r in report.rejections if station_of(r) == name]
    if any(station.name == name for station in report.stations):  # one that was measured: a marker's is not its reason
        about = [r for r in about if r.subject.kind is SubjectKind.STATION] or about
    return [words_of(r).at_station for r in about] or ["no reason was given"]


def say_left_out_last(visit: Visit, report: ProgressReport, screen: Screen) -> None:
    """Say once more, as the last thing of a run, which stations its numbers are without: warnings scroll away."""
    rejected = left_out([station.name for station in visit.stations], report)
    if not rejected:
        return
    counts = "count" if len(rejected) > 1 else "counts"
    screen.warn(
        f"WITHOUT {len(rejected)} OF {len(visit.stations)} STATIONS: of the visit of {visit.date.isoformat()} "
        f"{', '.join(rejected)} {counts} for nothing above. See why, correct it, and run again"
    )


def warn_of_design(files: DesignFiles, notes: Sequence[Note], screen: Screen) -> None:
    """Say what of the design, its costs table or its schedule couldn't be used, each under its own file's name.

    It is missing from every number.
    """
    by_file: dict[str, list[Note]] = {}
    for note in notes:
        by_file.setdefault(files.of(note), []).append(note)
    for name, own in by_file.items():
        alike = notes_alike(own)
        for one in alike[:MAX_NOTES]:
            screen.warn(f"{name}: {plain(one.line)}")
        if (left := len(alike) - MAX_NOTES) > 0:
            screen.warn(f"{name}: and {left} more {'note' if left == 1 else 'notes'}; report.html shows them all")


def warn_of_faults(report: ProgressReport, screen: Screen) -> None:
    """Say before all else what puts every number of a visit in doubt."""
    for fault in report.faults:
        screen.warn(f"KNOWN TO BE WRONG, visit {report.visit_date.isoformat()}: {plain(str(words_of(fault)))}")


def warn_of_visit(visit: Visit, report: ProgressReport, screen: Screen) -> bool:
    """Say what else is wrong with the whole visit, such as its rig, and which stations were left out.

    Returns whether one was.
    """
    day = visit.date.isoformat()
    whole = rejections_alike(r for r in report.rejections if of_whole_visit(r) and r not in report.faults)
    for one in whole[:MAX_NOTES]:
        screen.warn(f"visit {day}: {plain(one.line)}")
    if len(whole) > MAX_NOTES:
        screen.warn(f"visit {day}: and {len(whole) - MAX_NOTES} more of the kind; the report names them all")
    bad = rejections_alike(station_doubts(report))
    for one in bad[:MAX_NOTES]:
        screen.warn(f"visit {day}: {plain(one.line)}")
    if len(bad) > MAX_NOTES:
        screen.warn(f"visit {day}: and {len(bad) - MAX_NOTES} more of such photos and places; the report names them")
    beside = [one for one in report.elements if one.state == "displaced"]
    for element in beside[:MAX_NOTES]:
        screen.warn(f"visit {day}: {plain(element.name or element.global_id)}: {plain(note_words(element.doubts[0]))}")
    if len(beside) > MAX_NOTES:
        screen.warn(f"visit {day}: and {len(beside) - MAX_NOTES} more elements beside their design")
    names = [station.name for station in visit.stations]
    rejected = left_out(names, report)
    alike: dict[str, list[str]] = {}
    for name, reasons in rejected.items():
        alike.setdefault("; ".join(reasons), []).append(name)
    for reason, those in alike.items():
        who = f"station {those[0]} was" if len(those) == 1 else f"stations {', '.join(those)} were"
        screen.warn(f"visit {day}: {who} LEFT OUT: {reason}")
    if names and len(rejected) == len(names):
        screen.warn(f"visit {day}: NOT ONE station could be used; nothing in this report was seen on that day")
    return bool(rejected)
