"""How reading and judging grow: designs of 250 to 16,000 elements, and 10 to 1,000 stations.

python benchmarks/hold/scale.py --check --json figures.json     hours on a small machine
python benchmarks/hold/scale.py --done FILE --copies 9 36       takes up what was measured; two designs are read
python benchmarks/hold/scale.py --quick                         250 elements, two stations, two visits

Every measurement is a process of its own on one thread; judged are processor seconds. A design is the sample's building
many times side by side. Reading is held against IfcOpenShell's own iterator with the same settings for the same
products (elements, and what stands about them), in the same process. Judging has the stations of the sample's first
visit, which see the first building alone; they are measured once and found in the user's cache. More stations are
copies of them with other names, judged without any cache. Visits are that one over and over, a week apart, each with
the history of those before.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.flow.design_source import design_of
from asbuilt_bim.flow.measure_visit import Workplace, measure_visit
from asbuilt_bim.flow.pipeline import monitor
from asbuilt_bim.flow.rig_source import rig_of
from asbuilt_bim.ifc.geometry.bodies import ANGLE_RAD, SEGMENTS
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.progress.history import EMPTY_HISTORY, remember
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.project.model import Project
from asbuilt_bim.project.read import read_project
from asbuilt_bim.project.tables.survey import read_survey
from asbuilt_bim.register.pose import SurveyedMarker
from asbuilt_bim.report.page.write import page_html
from asbuilt_bim.report.result.document import read_result, write_result
from asbuilt_bim.report.result.parts import read_elements, read_summary
from asbuilt_bim.scale.cache import Cache, default_folder
from benchmarks.hold.wide_design import write_copies
from benchmarks.ifc.rounds import peak_mb
from benchmarks.sites import ONE_THREAD, ROOT, SAMPLE
from benchmarks.table import Line, line, options, report, told

Figures = dict[str, float]
MOST_TIMES, MOST_CACHED_S, MOST_JUDGING, MOST_EXPONENT = 2.0, 3.0, 1.5, 1.1
COPIES, QUICK_COPIES = (9, 36, 143, 571), (9,)
"""Of 28 walls and columns: 252, 1,008, 4,004 and 15,988."""
UNSEEN, QUICK_UNSEEN = (1, 100), (1, 9)
STATIONS, QUICK_STATIONS = (10, 100, 1000), (1, 2)
VISITS, QUICK_VISITS = (5, 50), (1, 2)
WORKERS, MOST_SHARE, ANEW = 8, 0.10, 3
OUTPUTS = "write_s", "result_mb", "read_s", "page_s", "page_mb"


def spent(call: Callable[[], object]) -> float:
    """Return the processor seconds of a call."""
    start = time.process_time()
    call()
    return time.process_time() - start


def iterate(path: Path, drawn: frozenset[str]) -> None:
    """Draw a file's products with these GlobalIds as IfcOpenShell itself does, and read nothing."""
    import ifcopenshell
    import ifcopenshell.geom

    file = ifcopenshell.open(str(path))
    settings = ifcopenshell.geom.settings()  # type: ignore[no-untyped-call]
    settings.set("mesher-angular-deflection", ANGLE_RAD)
    settings.set("circle-segments", SEGMENTS)
    iterator = ifcopenshell.geom.iterator(settings, file, 1, include=[file.by_guid(one) for one in sorted(drawn)])
    found = iterator.initialize()
    while found:
        found = iterator.next()


def reading(copies: int, repeats: int) -> Figures:
    """Read one design: by the iterator, by us, and from the cache; the least of a few, since others only add."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "design.ifc"
        write_copies(path, copies)
        project = replace(read_project(SAMPLE / "project.yaml"), ifc=(path,), scope=None)
        cache = Cache(folder=Path(folder) / "cache")
        design = design_of(project, cache)
        same = frozenset(one.global_id for one in design.elements) | {one.global_id for one in design.obstacles}
        calls: dict[str, Callable[[], object]] = {
            "iterator_s": lambda: iterate(path, same),
            "read_s": lambda: read_design(path),
            "cached_s": lambda: design_of(project, cache),
        }
        rounds = [{name: spent(call) for name, call in calls.items()} for _ in range(repeats)]  # by turns
    least = {name: min(one[name] for one in rounds) for name in calls}
    return {"elements": len(design.elements), **least, "peak_mb": peak_mb()}


def judging(copies: int, stations: int) -> Figures:
    """Judge a visit of so many stations on a design of so many copies; 0 stations are those of the sample."""
    project = read_project(SAMPLE / "project.yaml")
    survey = read_survey(project.survey, project.markers.size_m, project.markers.sigma_m)
    measured = _measured(project, survey, stations)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "design.ifc"
        write_copies(path, copies)
        design: BimModel = read_design(path)
    day = project.visits[0].date
    shared: list[float] = []

    def share(work: Callable[[Sequence[Any]], Sequence[Any]], items: Sequence[Any]) -> Sequence[Any]:
        begun = time.process_time()
        found = work(items)
        shared.append(time.process_time() - begun)
        return found

    start = time.process_time()
    report = monitor(measured, (), survey, design, EMPTY_HISTORY, day, project.options, share=share)
    judge_s = time.process_time() - start
    figures = {"elements": float(len(design.elements)), "stations": float(len(measured)), "judge_s": judge_s}
    figures["shared_s"] = sum(shared)
    return {**figures, "peak_mb": peak_mb(), **outputs(report), "peak_with_outputs_mb": peak_mb()}


def visits(wanted: int, stations: int) -> Figures:
    """Judge so many visits of so many stations, one after the other; 0 stations are those of the sample."""
    project = read_project(SAMPLE / "project.yaml")
    survey = read_survey(project.survey, project.markers.size_m, project.markers.sigma_m)
    measured = _measured(project, survey, stations)
    design = read_design(project.ifc, project.scope)
    history, each_s = EMPTY_HISTORY, list[float]()
    for number in range(wanted):
        day = project.visits[0].date + timedelta(weeks=number)
        start = time.process_time()
        report = monitor(measured, (), survey, design, history, day, project.options)
        history = remember(history, report)
        each_s.append(time.process_time() - start)
    found = {"visits": float(wanted), "judge_s": sum(each_s), "first_s": each_s[0], "last_s": each_s[-1]}
    return {**found, "peak_mb": peak_mb(), **outputs(report)}


def outputs(report: ProgressReport) -> Figures:
    """Write a result and its page without pictures, and read the result again: seconds and megabytes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "result.json"
        write_s = spent(lambda: write_result(report, path))
        result_mb = path.stat().st_size / 1e6
        path.write_bytes(path.read_bytes() + b"\n")  # so that it isn't known as what this process wrote
        read_s = spent(lambda: read_result(path))
        sums_s = spent(lambda: read_summary(path))
        storey_s = spent(lambda: read_elements(path, report.storeys[0].key))
    start = time.process_time()
    page_mb = len(page_html(report, {}).encode()) / 1e6
    page_s = time.process_time() - start
    parts = {"sums_s": sums_s, "storey_s": storey_s}
    return {"write_s": write_s, "result_mb": result_mb, "read_s": read_s, "page_s": page_s, "page_mb": page_mb} | parts


def measuring(stations: int) -> Figures:
    """Measure so many of the sample's stations anew."""
    project = read_project(SAMPLE / "project.yaml")
    survey = read_survey(project.survey, project.markers.size_m, project.markers.sigma_m)
    rig = rig_of(project, Cache(folder=default_folder()), _silent).rig
    visit = replace(project.visits[0], stations=project.visits[0].stations[:stations])
    place = Workplace(workers=1, cache=Cache(folder=None))
    return {
        "stations": stations,
        "measure_s": spent(lambda: measure_visit(visit, project, rig, place, _silent, survey)),
    }


def share_lines(stations: Figures, measured: Figures) -> list[Line]:
    """Reckon judging's share of a run with `WORKERS`: what is shared by elements and stations, and all else."""
    judge_s = stations["judge_s"] - stations["shared_s"] * (1.0 - 1.0 / WORKERS)
    measure_s = measured["measure_s"] / measured["stations"] * stations["stations"] / WORKERS
    share = judge_s / (judge_s + measure_s + stations["write_s"] + stations["page_s"])
    what = f"judging of a run of {stations['stations']:.0f} stations with {WORKERS} workers, reckoned"
    parallel = stations["shared_s"] / stations["judge_s"]
    return [
        line(what, f"{share:.0%}", f"<= {MOST_SHARE:.0%}", 1, share <= MOST_SHARE, least_n=1),
        told("  its part that is shared among them", f"{parallel:.0%}", 1),
        told("  a station measured, processor seconds", f"{measured['measure_s'] / measured['stations']:.1f} s", 1),
    ]


def _measured(project: Project, survey: tuple[SurveyedMarker, ...], wanted: int) -> tuple[StationMeasurement, ...]:
    """Return the stations of the sample's first visit, repeated with other names where more are wanted."""
    cache = Cache(folder=default_folder())
    rig = rig_of(project, cache, _silent).rig
    visit = project.visits[0]
    few = visit.stations[: wanted or len(visit.stations)]
    place = Workplace(workers=1, cache=cache)
    found = measure_visit(replace(visit, stations=few), project, rig, place, _silent, survey).measured
    rounds = range(max(1, -(-wanted // len(found))))
    return tuple(_renamed(one, f"{one.station}c{k}") if k else one for k in rounds for one in found)[: wanted or None]


def _renamed(station: StationMeasurement, name: str) -> StationMeasurement:
    faces = tuple(replace(face, face_id=face.face_id.replace(station.station, name, 1)) for face in station.faces)
    return replace(station, station=name, faces=faces)


def _silent(step: str, done: int, total: int, what: str = "") -> None:
    """Say nothing."""


def child(task: str, *numbers: int) -> Figures:
    """Do one task in a process of its own, on one thread."""
    folders = [str(ROOT), str(ROOT / "synthetic"), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(folder for folder in folders if folder)}
    command = [sys.executable, __file__, "--task", task, *map(str, numbers)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    if done.returncode:
        raise SystemExit(f"{task} {numbers} failed:\n{done.stderr[-2000:]}")
    figures: Figures = json.loads(done.stdout.splitlines()[-1])
    return figures


def noted(done: Path | None, task: str, *numbers: int) -> Figures:
    """Do one task, or find it among those done: a line of JSON each."""
    rows = done.read_text(encoding="utf-8").splitlines() if done is not None and done.exists() else []
    for row in map(json.loads, rows):
        if row["task"] == [task, *numbers]:
            figures: Figures = row["figures"]
            return figures
    figures = child(task, *numbers)
    if done is not None:
        with done.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"task": [task, *numbers], "figures": figures}) + "\n")
    return figures


def exponent(rows: list[Figures], size: str, figure: str) -> float:
    """Return with which power of a size a figure grows, by the first and the last row."""
    return float(np.log(rows[-1][figure] / rows[0][figure]) / np.log(rows[-1][size] / rows[0][size]))


def reading_lines(rows: list[Figures]) -> list[Line]:
    """Judge reading against the iterator, and the cache."""
    lines = []
    for row in rows:
        times, name = row["read_s"] / row["iterator_s"], f"{row['elements']:,.0f} elements"
        lines.append(line(f"{name}: read, over the iterator", f"{times:.2f} times", f"<= {MOST_TIMES:g}", 1,
                          times <= MOST_TIMES, least_n=1))  # fmt: skip
        lines.append(told("  read, iterator", f"{row['read_s']:.1f} s, {row['iterator_s']:.1f} s", 1))
        lines.append(line(f"{name}: from the cache", f"{row['cached_s']:.2f} s", f"<= {MOST_CACHED_S:g} s", 1,
                          row["cached_s"] <= MOST_CACHED_S, least_n=1))  # fmt: skip
    return [*lines, *_growth(rows, "reading", "elements", ("read_s", "peak_mb"))]


def judging_lines(unseen: list[Figures], stations: list[Figures]) -> list[Line]:
    """Judge what unseen elements cost, and how judging grows with stations."""
    few, many = unseen[0], unseen[-1]
    times = many["judge_s"] / few["judge_s"]
    what = f"judging {many['elements']:,.0f} elements over {few['elements']:.0f}, the same stations"
    lines = [
        line(what, f"{times:.2f} times", f"<= {MOST_JUDGING:g}", 1, times <= MOST_JUDGING, least_n=1),
        told("  seconds", f"{many['judge_s']:.1f} s, {few['judge_s']:.1f} s", 1),
        *(told(f"judging {row['stations']:.0f} stations", f"{row['judge_s']:.1f} s, {row['peak_mb']:.0f} MB", 1)
          for row in stations),
        *(told(f"outputs of {row['elements']:,.0f} elements, {row['stations']:.0f} stations", _outputs_told(row), 1)
          for row in (*unseen, *stations)),
    ]  # fmt: skip
    lines += _growth(stations, "judging", "stations", ("judge_s", "peak_mb"))
    return [*lines, *_growth(stations, "outputs", "stations", OUTPUTS)]


def visits_lines(rows: list[Figures]) -> list[Line]:
    """Judge how time and memory grow with visits; a result holds the last one and what is known of those before."""
    lines = [
        told(f"judging {row['visits']:.0f} visits", f"{row['judge_s']:.1f} s, the first {row['first_s']:.1f} s, the "
             f"last {row['last_s']:.1f} s; {row['peak_mb']:.0f} MB; {_outputs_told(row)}", 1)
        for row in rows
    ]  # fmt: skip
    return [*lines, *_growth(rows, "visits", "visits", ("judge_s", "peak_mb", *OUTPUTS))]


def _outputs_told(row: Figures) -> str:
    result = f"result {row['result_mb']:.1f} MB in {row['write_s']:.1f} s, read in {row['read_s']:.1f} s"
    if "sums_s" in row:  # not in what was noted before
        result += f", its sums in {row['sums_s']:.2f} s, a storey in {row['storey_s']:.2f} s"
    return f"{result}; page {row['page_mb']:.1f} MB in {row['page_s']:.1f} s"


def _growth(rows: list[Figures], what: str, size: str, figures: tuple[str, ...]) -> list[Line]:
    if len(rows) < 2:
        return []
    found = [(figure, exponent(rows, size, figure)) for figure in figures]
    return [
        line(f"{what}: {name} grows with {size} to the power of", f"{power:.2f}", f"<= {MOST_EXPONENT:g}", 2,
             power <= MOST_EXPONENT, least_n=1)
        for name, power in found
    ]  # fmt: skip


def main() -> int:
    """Measure and print the table."""
    if sys.argv[1:2] == ["--task"]:
        task: Callable[..., Figures] = {
            "reading": reading, "judging": judging, "visits": visits, "measuring": measuring,
        }[sys.argv[2]]  # fmt: skip
        print(json.dumps(task(*map(int, sys.argv[3:]))))
        return 0
    parser = options(__doc__ or "")
    parser.add_argument("--done", type=Path, help="note each measurement here, and leave out those that stand here")
    parser.add_argument("--copies", type=int, nargs="*", default=COPIES, help="of the building, to be read")
    args = parser.parse_args()
    child = partial(noted, args.done)
    read = [child("reading", n, 7 if n < COPIES[1] else 1) for n in (QUICK_COPIES if args.quick else args.copies)]
    seen = QUICK_STATIONS[-1] if args.quick else 0
    child("judging", 1, seen)  # measures them, so that no other process has to
    unseen = [child("judging", n, seen) for n in (QUICK_UNSEEN if args.quick else UNSEEN)]
    stations = [child("judging", 1, n) for n in (QUICK_STATIONS if args.quick else STATIONS)]
    over = [child("visits", n, seen) for n in (QUICK_VISITS if args.quick else VISITS)]
    anew = child("measuring", 1 if args.quick else ANEW)
    figures: dict[str, Any] = {
        "machine": {"processors": os.cpu_count(), "threads of each process": 1},
        "reading": read, "unseen": unseen, "stations": stations, "visits": over, "anew": anew,
    }  # fmt: skip
    lines = [*reading_lines(read), *judging_lines(unseen, stations), *visits_lines(over)]
    lines += share_lines(stations[-1], anew)
    if args.quick:
        lines = [told(one.what, one.figure, one.n) if "power" in one.what else one for one in lines]
    return report("Scale", lines, args, figures)


if __name__ == "__main__":
    sys.exit(main())
