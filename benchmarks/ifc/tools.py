"""What other programs' tools read from a copy: ifccsv, ifc5d, ifc4d, ifcdiff; and what every exporter tells of a task.

python benchmarks/ifc/tools.py        (they come with the extra `tools`)

The design is the shipped sample's, with five more tasks: built, half built, measured 0, unknown, and some of each.
"""

from __future__ import annotations

import contextlib
import csv
import io
import sys
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.guid

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.ifc.write.copy import write_asbuilt
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.schedule.msp import write_msp
from asbuilt_bim.report.schedule.p6 import write_p6
from asbuilt_bim.report.schedule.write import write_tasks_csv
from benchmarks.ifc.invented import invented_reports
from benchmarks.ifc.plan import TASKS, add_plan
from benchmarks.sites import SAMPLE
from benchmarks.table import Line, line, options, report, told

Shown = dict[str, tuple[str, ...]]  # task -> what a tool shows of it


def main() -> int:
    """Write a copy, read it with each tool, print the tables."""
    parser = options(__doc__ or "")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        design, copy = Path(place) / "design.ifc", Path(place) / "copy.ifc"
        source = ifcopenshell.open(str(SAMPLE / "design.ifc"))
        add_plan(source, completion=None)
        source.create_entity("IfcWorkCalendar", GlobalId=ifcopenshell.guid.new(), Name="week")  # ifc4d wants one
        source.write(str(design))
        *earlier, last = invented_reports(source)
        write_asbuilt(design, last, copy, earlier=earlier)
        written = ifcopenshell.open(str(copy))
        shown = {
            "IfcTaskTime (Completion, DataOrigin)": _task_times(written),
            "AsBuilt_Progress (State, CompletionBest)": _our_set(written),
            "ifccsv": _ifccsv(written, Path(place)),
            "tasks.csv (Known, CompletionTold)": _tasks_csv(last, Path(place)),
            "MS Project XML (PercentComplete, field)": _msp(last, Path(place)),
            "P6 XML (PercentComplete, Status, field)": _p6(last, Path(place)),
        }
        other = {"ifc4d, P6 XML from the copy": _ifc4d(written, Path(place))}
        lines = [*_told_apart(shown), *_ifccsv_lines(last, shown["ifccsv"]), *_cost_lines(last, written)]
        lines += _diff_lines(source, written, last)
    _print_tasks(shown | other)
    percents = {one for one in other["ifc4d, P6 XML from the copy"].values()}
    lines.append(told("ifc4d: all that it tells of any task's progress", str(sorted(percents)), len(TASKS)))
    return report("What other tools read", lines, args, {"tasks": {k: v for k, v in (shown | other).items()}})


def _named(file: Any) -> dict[str, Any]:
    return {task.Name: task for task in file.by_type("IfcTask") if task.Name in TASKS}


def _task_times(file: Any) -> Shown:
    found = {name: task.TaskTime for name, task in _named(file).items()}
    return {name: (_text(time.Completion), _text(time.DataOrigin)) for name, time in found.items()}


def _our_set(file: Any) -> Shown:
    import ifcopenshell.util.element

    sets = {n: ifcopenshell.util.element.get_psets(t)["AsBuilt_Progress"] for n, t in _named(file).items()}
    return {name: (one["State"], _text(one.get("CompletionBest"))) for name, one in sets.items()}


def _ifccsv(file: Any, place: Path) -> Shown:
    from ifccsv import IfcCsv

    wanted = ["Name", "AsBuilt_Progress.State", "AsBuilt_Progress.CompletionBest", "AsBuilt_Progress.CompletionLower"]
    path = place / "tasks.csv"
    IfcCsv().export(file, _named(file).values(), list(wanted), output=str(path), format="csv")
    with path.open(newline="", encoding="utf-8") as stream:
        return {row["Name"]: tuple(row[name] for name in wanted[1:]) for row in csv.DictReader(stream)}


def _tasks_csv(last: ProgressReport, place: Path) -> Shown:
    write_tasks_csv(last, place / "own.csv")
    with (place / "own.csv").open(newline="", encoding="utf-8-sig") as stream:
        rows = list(csv.DictReader(stream))
    return {row["Name"]: (row["Known"], row["CompletionTold"] or "(empty)") for row in rows if row["Name"] in TASKS}


def _msp(last: ProgressReport, place: Path) -> Shown:
    write_msp(last, place / "msp.xml")
    return dict(_xml_tasks(place / "msp.xml", "Task", ("PercentComplete",), "ExtendedAttribute", "Value"))


def _p6(last: ProgressReport, place: Path) -> Shown:
    write_p6(last, place / "p6.xml")
    return dict(_xml_tasks(place / "p6.xml", "Activity", ("PercentComplete", "Status"), "UDF", "TextValue"))


def _ifc4d(file: Any, place: Path) -> Shown:
    """Export the sample's own tasks, which stand in a work schedule, as ifc4d does it."""
    from ifc4d.ifc2p6 import Ifc2P6

    tool = Ifc2P6()
    tool.file, tool.xml = file, str(place / "ifc4d.xml")
    tool.holiday_start_date = tool.holiday_finish_date = date(2026, 1, 1)
    with contextlib.redirect_stdout(io.StringIO()):
        tool.execute()
    tree = ET.parse(place / "ifc4d.xml").getroot()
    return {
        _child(one, "Name"): (_child(one, "DurationPercentComplete"), _child(one, "Status"))
        for one in tree.iter()
        if one.tag.rpartition("}")[2] == "Activity"
    }


def _xml_tasks(
    path: Path, tag: str, fields: tuple[str, ...], extra: str, value: str
) -> Iterator[tuple[str, tuple[str, ...]]]:
    for one in ET.parse(path).getroot().iter():
        if one.tag.rpartition("}")[2] == tag and _child(one, "Name") in TASKS:
            inside = [each for each in one if each.tag.rpartition("}")[2] == extra]
            known = _child(inside[0], value) if inside else "(none)"
            yield _child(one, "Name"), (*(_child(one, name) for name in fields), known)


def _child(element: ET.Element, name: str) -> str:
    found = [each.text for each in element if each.tag.rpartition("}")[2] == name]
    return _text(found[0] if found else None)


def _text(value: object) -> str:
    return "(empty)" if value is None else f"{value:.3g}" if isinstance(value, float) else str(value)


def _told_apart(shown: dict[str, Shown]) -> list[Line]:
    """Judge that part measured, measured 0 and unknown are three things wherever a task is shown."""
    lines = []
    for tool, tasks in shown.items():
        three = {tasks.get(name, ()) for name in ("mixed", "measured 0", "unknown")}
        lines.append(line(f"{tool}: part, 0, unknown", f"{len(three)} things", "3", 3, len(three) == 3, least_n=3))
    return lines


def _ifccsv_lines(last: ProgressReport, rows: Shown) -> list[Line]:
    """Compare ifccsv's cells with the report."""
    groups = [task.progress for task in last.tasks if task.progress.name in TASKS]
    right = 0
    for group in groups:
        _, best, lower = rows[group.name]
        done = group.completion
        same_best = best == "-" if done.best_shown is None else abs(float(best) - done.best_shown) < 1e-9
        right += same_best and abs(float(lower) - done.lower) < 1e-9
    n = len(groups)
    return [line("ifccsv: tasks whose cells are the report's", f"{right} of {n}", "all", n, right == n, least_n=5)]


def _cost_lines(last: ProgressReport, file: Any) -> list[Line]:
    """Have ifc5d list both cost schedules; the written one must hold the lower bounds, the plan what it held."""
    from ifc5d.ifc5Dspreadsheet import IfcDataGetter

    planned: dict[str, float] = {}
    ours: dict[str, float] = {}
    for schedule in IfcDataGetter.get_schedules(file):
        into = ours if schedule.ObjectType == "ASBUILT" else planned
        for item in IfcDataGetter.get_schedule_cost_items_data(file, schedule):
            into[str(item["Name"])] = float(item["Quantity"] or 0.0)
    right = sum(abs(ours.get(one.name, -1.0) - one.as_built_lower) < 1e-6 for one in last.cost_lines)
    kept = sum(abs(planned.get(one.name, -1.0) - one.planned_quantity) < 1e-6 for one in last.cost_lines)
    n = len(last.cost_lines)
    return [
        line("ifc5d: as-built cost items with the lower bound", f"{right} of {n}", "all", n, right == n, least_n=5),
        line("ifc5d: planned cost items as they were", f"{kept} of {n}", "all", n, kept == n, least_n=5),
    ]


def _diff_lines(before: Any, after: Any, last: ProgressReport) -> list[Line]:
    """Have ifcdiff compare the copy with its source: properties of the elements in scope and of storeys only."""
    from ifcdiff import IfcDiff

    def compared(kinds: list[str]) -> Any:
        tool = IfcDiff(before, after, relationships=kinds, is_shallow=False)
        with contextlib.redirect_stdout(io.StringIO()):
            tool.diff()
        return tool

    rest = compared(["attributes", "geometry", "type", "container", "aggregate", "classification"])
    found = len(rest.change_register) + len(rest.added_elements) + len(rest.deleted_elements)
    changed = set(compared(["property"]).change_register)
    known = {one.global_id for one in last.elements}
    known |= {storey.key for storey in last.storeys}
    n = len(last.elements)
    return [
        line("ifcdiff: elements added, gone, changed in aught but properties", str(found), "0", n, found == 0, 5),
        line(
            "ifcdiff: elements with other properties", str(len(changed)), f"ours: {len(known)}", n, changed == known, 5
        ),
    ]


def _print_tasks(shown: dict[str, Shown]) -> None:
    width = max(len(tool) for tool in shown)
    for tool, tasks in shown.items():
        cells = {name: " / ".join(tasks[name]) for name in TASKS if name in tasks}
        print(f"  {tool:<{width}}  " + "; ".join(f"{name}: {cell}" for name, cell in cells.items()))


if __name__ == "__main__":
    sys.exit(main())
