"""Writes every view of a result into a folder: overlays, table, workbook, page."""

from collections.abc import Sequence
from pathlib import Path

from asbuilt_bim.errors import OutputError
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.bcf.write import write_issues
from asbuilt_bim.report.csv import write_csv
from asbuilt_bim.report.drawings.overlay import draw_overlay
from asbuilt_bim.report.drawings.overlay_layout import known_of
from asbuilt_bim.report.drawings.private import shower_of
from asbuilt_bim.report.page.write import write_pages
from asbuilt_bim.report.schedule.write import write_schedules
from asbuilt_bim.report.tables import station_rows
from asbuilt_bim.report.workbook.write import write_workbook
from asbuilt_bim.storage.atomic_write import writing

MAX_PICTURE_BYTES = 50_000_000  # a 1280 px JPEG has a quarter of a megabyte


def write_outputs(
    report: ProgressReport, folder: Path, pictures_folder: Path, earlier: Sequence[ProgressReport] = ()
) -> tuple[Path, ...]:
    """Write overlays, `quantities.csv`, `quantities.xlsx`, BCF and both pages into `folder`; return their paths.

    A design with tasks gets `tasks.csv`, `schedule.msp.xml` and `schedule.p6.xml` as well.

    `pictures_folder` is the run folder that `StationRecord.picture` is relative to, or the folder of the visit's
    pictures itself. A station whose picture is missing gets no overlay, and the page says so. `earlier` are the
    reports of the visits before: the page compares with the last, and BCF topics begin with the first that had them.

    Raises:
        OutputError: something can't be written, or a picture is damaged.
    """
    pictures = read_pictures(report, pictures_folder)
    written = list(write_overlays(report, pictures, folder / "overlays", whole=report.pictures == "whole"))
    table, workbook = folder / "quantities.csv", folder / "quantities.xlsx"
    write_csv(report, table)
    write_workbook(report, workbook, earlier)
    issues = write_issues(report, earlier, pictures, folder)
    pictures_before = read_pictures(earlier[-1], pictures_folder) if earlier else None
    pages = write_pages(report, pictures, folder, earlier, pictures_before)
    return (*written, table, workbook, *write_schedules(report, folder), *issues, *pages)


def read_pictures(report: ProgressReport, pictures_folder: Path) -> dict[str, bytes]:
    """Return station -> JPEG bytes of the pictures that are there, rejected stations' too; none from outside.

    Raises:
        OutputError: a picture is there but can't be read.
    """
    root = pictures_folder.resolve()
    named = {station.name: station.picture for station in report.stations}
    pictures: dict[str, bytes] = {}
    for row in station_rows(report):
        picture = named.get(row.name) or f"pictures/{report.visit_date.isoformat()}/{row.name}.jpg"
        for path in ((root / picture).resolve(), (root / Path(picture).name).resolve()):
            data = _read(path) if row.name not in pictures and path.is_relative_to(root) else None
            if data is not None:
                pictures[row.name] = data
    return pictures


def _read(path: Path) -> bytes | None:
    """Return a picture's bytes, None where there is none."""
    try:
        if path.is_file() and path.stat().st_size <= MAX_PICTURE_BYTES:
            return path.read_bytes()
    except OSError as error:
        raise OutputError(f"{path}: can't be read: {error.strerror or error}; run the visit again") from error
    return None


def write_overlays(
    report: ProgressReport, pictures: dict[str, bytes], folder: Path, *, whole: bool = False
) -> tuple[Path, ...]:
    """Write `<date>_<station>.jpg` for each station that has a picture; return their paths.

    All but elements and what was measured is blurred, unless photos are shown `whole`.

    Raises:
        OutputError: something can't be written.
    """
    written = []
    known, shower = known_of(report), shower_of(report, whole=whole)
    for station in report.stations:
        if station.name not in pictures:
            continue
        path = folder / Path(station.overlay).name
        data = draw_overlay(pictures[station.name], station, known, shower)
        with writing(path):
            folder.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        written.append(path)
    return tuple(written)
