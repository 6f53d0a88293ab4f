"""What other programs read out of the schedules: each sort of task, and shares and dates as they were measured.

python benchmarks/ifc/schedule.py --check

Forty tasks, ten of each sort, are written as MS Project and as P6 XML. Readers made by others read them: ifc4d, and
MPXJ (a Java library that many planning programs import with). MPXJ is asked through a Python that has it, and Java:
`python -m venv mpxj && mpxj/bin/pip install mpxj jpype1`, then `--mpxj mpxj/bin/python`; else its lines are missing.
"""

from __future__ import annotations

import contextlib
import io
import json
import random
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.bim.schedule import ScheduleSource, WorkCalendar, WorkDay, WorkSpan, weekday
from asbuilt_bim.progress.completion.planned import verdict
from asbuilt_bim.progress.report import Completion, GroupProgress, ProgressReport, TaskProgress
from asbuilt_bim.report.schedule.msp import write_msp
from asbuilt_bim.report.schedule.p6 import write_p6
from benchmarks.table import Line, line, options, report, told

VISIT = date(2026, 3, 16)
CALENDAR = WorkCalendar(
    name="Site",
    week=tuple(weekday(n, (480, 720), (780, 1020)) if n < 5 else weekday(n) for n in range(7)),
    exceptions=(
        WorkDay(weekday=None, day=date(2026, 3, 9), spans=()),
        WorkDay(weekday=None, day=date(2026, 3, 14), spans=(WorkSpan(from_min=480, to_min=720),)),
    ),
)
SORTS = ("measured", "part measured", "measured 0", "unknown")
MPXJ = """
import json, sys, jpype, mpxj
jpype.startJVM()
read = jpype.JClass("org.mpxj.reader.UniversalProjectReader")()
def day(x): return None if x is None else str(x)[:10]
def number(x): return None if x is None else float(str(x))
out = {}
for path in sys.argv[1:]:
    project = read.read(path)
    fields = [c.getFieldType() for c in project.getCustomFields()]
    rows = {}
    for task in project.getTasks():
        if not task.getSummary():
            said = [str(task.get(f)) for f in fields if task.get(f) is not None]
            physical = number(task.getPhysicalPercentComplete())
            rows[str(task.getName())] = {"percent": physical, "started": day(task.getActualStart()), "said": said,
                                         "remaining": task.getRemainingDuration() is not None}
    out[path] = {"status": day(project.getProjectProperties().getStatusDate()), "tasks": rows}
print(json.dumps(out))
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """What a reader says of one task: percent 0..100 where it has one, and the sort where it keeps custom fields."""

    percent: float | None
    started: str | None
    sort: str | None


def tasks(dice: random.Random) -> list[TaskProgress]:
    """Make ten tasks of each sort."""
    return [_task(sort, f"Task {index}, {sort}", dice) for sort in SORTS for index in range(10)]


def _task(sort: str, name: str, dice: random.Random) -> TaskProgress:
    low = round(dice.uniform(0.05, 0.6), 4)
    best, lower, upper = {
        "measured": (low, low, low),
        "part measured": (min(1.0, low * 1.5), low, 0.95),
        "measured 0": (0.0, 0.0, 0.0),
        "unknown": (None, 0.0, 1.0),
    }[sort]
    unknown = {"part measured": 1, "unknown": 2}.get(sort, 0)
    group = GroupProgress(
        key=name,
        name=name,
        elements=("a", "b"),
        completion=Completion(best=best, lower=lower, upper=upper, coverage=0.5),
        complete=0,
        part=2 - unknown,
        not_started=0,
        unknown=unknown,
        design_area_m2=1.0,
        as_built_area_m2=1.0,
        as_built_sigma_m2=0.1,
    )
    start = datetime(2026, 2, 2, 8) + timedelta(days=dice.randrange(20))
    return TaskProgress(
        progress=group,
        schedule_start=start,
        schedule_finish=start + timedelta(days=dice.randrange(5, 40), hours=9),
        actual_start=VISIT - timedelta(days=14) if lower > 0.0 else None,
        actual_finish=None,
        late=None,
        outline=(f"Storey {dice.randrange(3)}",),
    )


def by_ifc4d(path: Path, sort: str, scratch: Path) -> dict[str, Told]:
    """Have ifc4d turn the schedule into an IFC file, and read its task times."""
    import ifcopenshell
    from ifc4d.msp2ifc import MSP2Ifc
    from ifc4d.p62ifc import P62Ifc

    reader = MSP2Ifc() if sort == "msp" else P62Ifc()
    reader.xml, reader.output = str(path), str(scratch / f"{sort}.ifc")
    with contextlib.redirect_stdout(io.StringIO()):  # it talks
        reader.execute()
    found = {}
    for task in ifcopenshell.open(str(scratch / f"{sort}.ifc")).by_type("IfcTask"):
        if task.TaskTime is not None:
            done, start = task.TaskTime.Completion, task.TaskTime.ActualStart
            percent = None if done is None else done * 100.0
            found[task.Name] = Told(percent=percent, started=start[:10] if start else None, sort=None)
    return found


def by_mpxj(python: Path, paths: list[Path]) -> dict[Path, dict[str, Told]]:
    """Have MPXJ read schedules."""
    command = [str(python), "-c", MPXJ, *map(str, paths)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"MPXJ could not read them:\n{done.stderr}")
    found: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    if any(one["status"] != VISIT.isoformat() for one in found.values()):
        raise SystemExit("MPXJ reads another status date")
    return {path: {name: _of_mpxj(row) for name, row in found[str(path)]["tasks"].items()} for path in paths}


def _of_mpxj(row: dict[str, Any]) -> Told:
    sort = next((word for word in row["said"] if word in SORTS), None)
    return Told(percent=row["percent"], started=row["started"], sort=sort)


def judge(reader: str, made: list[TaskProgress], found: dict[str, Told], step: float) -> list[Line]:
    """Hold what a reader says against what was measured; `step` is how coarse the file's percent is."""
    shares = {task.progress.name: verdict(task).share for task in made}
    known = {name: share * 100.0 for name, share in shares.items() if share is not None}
    off = [known[name] - (found[name].percent or 0.0) for name in known]
    begun = {t.progress.name: t.actual_start.isoformat() if t.actual_start else None for t in made}
    dates = [found[name].started == begun[name] for name in begun]
    worst = max(off, key=abs)
    lines = [
        line(f"{reader}: tasks read", f"{len(found)} of {len(made)}", "all", len(made), len(found) == len(made)),
        line(
            f"{reader}: percent, worst",
            f"{worst:.2f}",
            f"0 to {step:g} low",
            len(off),
            min(off) >= -1e-6 and max(off) <= step,
        ),
        line(f"{reader}: actual start", f"{sum(dates)} of {len(dates)}", "all", len(dates), all(dates)),
    ]
    if any(one.sort for one in found.values()):
        right = [found[t.progress.name].sort == verdict(t).knowledge for t in made]
        nothing = [found[name].percent is None for name, share in shares.items() if share is None]
        lines.append(
            line(f"{reader}: sorts distinguished", f"{sum(right)} of {len(right)}", "all", len(right), all(right))
        )
        if nothing:
            figure = f"{sum(nothing)} of {len(nothing)}"
            lines.append(
                line(f"{reader}: unknown without a percent", figure, "all", len(nothing), all(nothing), least_n=10)
            )
    return lines


def main() -> int:
    """Write, have others read, and print what they say."""
    parser = options(__doc__ or "")
    parser.add_argument("--mpxj", type=Path, help="a Python that has mpxj and jpype1")
    args = parser.parse_args()
    made = tasks(random.Random(20260316))
    known = [task for task in made if verdict(task).share is not None]
    lines: list[Line] = []
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-schedule-") as folder:
        scratch = Path(folder)
        writers: dict[str, tuple[Callable[[ProgressReport, Path], None], float]] = {
            "msp": (write_msp, 1.0),
            "p6": (write_p6, 0.01),
        }
        for sort, (write, step) in writers.items():
            # ifc4d's P6 reader stops at an activity without a Status, which an unknown one can't have
            some = made if sort == "msp" else known
            write(_report(some), scratch / f"{sort}.xml")
            lines += judge(f"ifc4d, {sort}", some, by_ifc4d(scratch / f"{sort}.xml", sort, scratch), step)
            write(_report(made), scratch / f"{sort}.xml")
        if args.mpxj:
            read = by_mpxj(args.mpxj, [scratch / "msp.xml", scratch / "p6.xml"])
            for sort, (_, step) in writers.items():
                lines += judge(f"MPXJ, {sort}", made, read[scratch / f"{sort}.xml"], step)
        else:
            lines.append(told("MPXJ", "not asked (--mpxj)", 0))
    return report("Schedules as other programs read them", lines, args)


def _report(made: list[TaskProgress]) -> ProgressReport:
    whole = made[0].progress
    nothing: dict[str, Any] = dict.fromkeys(
        ("earlier_visits", "elements", "storeys", "cost_lines", "faces", "stations", "rejections", "unmatched"), ()
    )
    source = ScheduleSource(name="plan.xml", digest="", kind="MS Project XML", calendar=CALENDAR)
    return ProgressReport(
        project_name="Benchmark",
        visit_date=VISIT,
        whole=whole,
        tasks=tuple(made),
        unobserved=(),
        notes=(),
        schedule=source,
        **nothing,
    )


if __name__ == "__main__":
    sys.exit(main())
