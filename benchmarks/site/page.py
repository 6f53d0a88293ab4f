"""The interactive page of a large site: how big it is, how fast Chromium opens it, and that it asks for nothing.

python benchmarks/site/page.py --check --json figures.json   5,000 elements and 300 stations
python benchmarks/site/page.py --quick                       300 elements and 30 stations

The result is the tests' small one, its elements, faces and stations copied with names and places of their own. Pictures
are those of the sample's stations, of full size. It needs a Chromium; without one nothing is judged but the size.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.progress.report import GroupProgress, ProgressReport, StationRecord, TaskProgress
from asbuilt_bim.report.page.write import write_pages
from asbuilt_bim.scale.executor import one_thread
from benchmarks.chromium import DRIVEN, Tab, opened_tab
from benchmarks.sites import SAMPLE
from benchmarks.table import Line, line, options, report, told, unjudged
from tests.report.sample_report import sample_report

ELEMENTS, STATIONS, STOREYS = 5000, 300, 12
MOST_MB, MOST_S = 40.0, 3.0
ROUNDS = 25
APART_M = 20.0


def large_report(elements: int, stations: int, storeys: int = STOREYS) -> ProgressReport:
    """Return a result of so many elements, on so many storeys, seen by so many stations."""
    one = sample_report()
    copies = -(-elements // len(one.elements))
    side = int(copies**0.5) + 1
    found, faces = [], []
    for number in range(copies):
        storey, shift = f"storey {number % storeys}", np.array([number % side, number // side, 0.0]) * APART_M
        for element in one.elements:
            key = f"{element.global_id}-{number}"
            tasks = f"{element.name} {number}"
            found.append(replace(element, global_id=key, name=tasks, storey=storey))
        for face in one.faces:
            frame = frozen(np.vstack([face.frame_m[0] + shift, face.frame_m[1:]]))
            face_id = f"{face.face_id}-{number}"
            faces.append(replace(face, face_id=face_id, element=f"{face.element}-{number}", frame_m=frame))
    found = found[:elements]
    kept = {element.global_id for element in found}
    groups = tuple(_group(one.storeys[0], f"storey {n}", [e.global_id for e in found if e.storey == f"storey {n}"])
                   for n in range(storeys))  # fmt: skip
    return replace(
        one,
        elements=tuple(found),
        faces=tuple(face for face in faces if face.element in kept),
        storeys=groups,
        whole=_group(one.whole, one.whole.name, [element.global_id for element in found], key=""),
        stations=tuple(_stations(one, stations, copies)),
        tasks=tuple(_tasks(one, copies)),
        unobserved=(),
    )


def _group(like: GroupProgress, name: str, elements: list[str], key: str | None = None) -> GroupProgress:
    return replace(like, key=name if key is None else key, name=name, elements=tuple(elements))


def _stations(one: ProgressReport, stations: int, copies: int) -> Iterator[StationRecord]:
    """Yield stations, each with the faces of another copy of the elements."""
    for number in range(stations):
        like = one.stations[number % len(one.stations)]
        copy = number * copies // stations
        faces = tuple(
            replace(
                face,
                face_id=f"{face.face_id}-{number}",
                elements=tuple(f"{key}-{copy}" for key in face.elements),
                design_faces=tuple(f"{key}-{copy}" for key in face.design_faces),
            )
            for face in like.faces
        )
        yield replace(like, name=f"{like.name}-{number}", faces=faces)


def _tasks(one: ProgressReport, copies: int) -> Iterator[TaskProgress]:
    """Yield the tasks with all copies of their elements."""
    for task in one.tasks:
        keys = tuple(f"{key}-{number}" for number in range(copies) for key in task.progress.elements)
        yield replace(task, progress=replace(task.progress, elements=keys))


def pictures_of(large: ProgressReport) -> dict[str, bytes]:
    """Return a picture a station: photos of the sample as a run keeps them."""
    photos = sorted((SAMPLE / "visits").rglob("*left*.jpg")) or sorted((SAMPLE / "visits").rglob("*.jpg"))
    kept = []
    for path in photos[:10]:
        image = cv2.imread(str(path))
        width = 1280
        small = cv2.resize(image, (width, round(image.shape[0] * width / image.shape[1])), interpolation=cv2.INTER_AREA)
        kept.append(cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 85])[1].tobytes())
    return {station.name: kept[number % len(kept)] for number, station in enumerate(large.stations)}


def opened(tab: Tab, address: str, rounds: int) -> list[float]:
    """Open a page a few times; return the seconds until its table stands."""
    found = []
    for _ in range(rounds):
        start = time.perf_counter()
        tab.open(address)
        tab.until("document.documentElement.dataset.ready === 'yes'")
        found.append(time.perf_counter() - start)
    return found


def lines_of(page: Path, rounds: int) -> list[Line]:
    """Judge the page's size, its time to open, and what it asks for."""
    size = page.stat().st_size / 1e6
    lines = [line("size of the interactive page", f"{size:.1f} MB", f"<= {MOST_MB:.0f} MB", 1, size <= MOST_MB, 1)]
    if not DRIVEN:
        return [*lines, told("no Chromium here: its time to open was not measured", "", 0)]
    with opened_tab() as tab:
        for name, width in (("a telephone's width", 390), ("1280 px", 1280)):
            tab.size(width)
            seconds = opened(tab, page.as_uri(), rounds)
            lines.append(line(f"opens at {name}, median", f"{np.median(seconds):.2f} s", f"<= {MOST_S:.0f} s", rounds,
                              float(np.median(seconds)) <= MOST_S))  # fmt: skip
            lines.append(told("  the slowest", f"{max(seconds):.2f} s", rounds))
        start = time.perf_counter()
        tab.value("document.querySelector('[name=q]').value = 'w-11'")
        tab.value("document.querySelector('[name=q]').dispatchEvent(new Event('input', {bubbles: true}))")
        lines.append(told("a search", f"{time.perf_counter() - start:.2f} s", 1))
        start = time.perf_counter()
        tab.click("#table tbody a")
        tab.until("document.getElementById('card').dataset.ready")
        lines.append(told("a card, the first of its storey", f"{time.perf_counter() - start:.2f} s", 1))
        count = len(tab.asked) + len(tab.faults)
        lines.append(line("requests and errors", f"{count}", "0", 2 * rounds, count == 0))
    return lines


@one_thread()
def main() -> int:
    """Make the page and open it."""
    args = options(__doc__ or "").parse_args()
    large = large_report(*((300, 30) if args.quick else (ELEMENTS, STATIONS)))
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        interactive, page = write_pages(large, pictures_of(large), Path(folder))
        made = time.perf_counter() - start
        lines = lines_of(interactive, 3 if args.quick else ROUNDS)
        size = page.stat().st_size / 1e6
        most, fits = f"<= {MOST_MB:.0f} MB", size <= MOST_MB
        lines.append(line("size of the script-free page", f"{size:.1f} MB", most, 1, fits, 1))
        lines.append(told("both made in", f"{made:.1f} s", 1))
    return report("The interactive page", unjudged(lines) if args.quick else lines, args)


if __name__ == "__main__":
    sys.exit(main())
