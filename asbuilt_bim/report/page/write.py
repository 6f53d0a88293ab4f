"""`report.html`, without scripts, and `report-interactive.html`, to search and sort: one file each, no requests."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.page.context import page_context, with_panels
from asbuilt_bim.report.page.environment import environment
from asbuilt_bim.report.page.interactive import interactive_from
from asbuilt_bim.storage.atomic_write import writing

_NO_PICTURES: Mapping[str, bytes] = {}


def page_html(
    report: ProgressReport,
    pictures: Mapping[str, bytes],
    earlier: Sequence[ProgressReport] = (),
    pictures_before: Mapping[str, bytes] | None = None,
) -> str:
    """Return the page; `pictures` maps a station's name to its rectified left photo as JPEG.

    `earlier` are the reports of the visits before, in the order of days; `pictures_before` are those of the last one.

    Raises:
        OutputError: a picture can't be decoded.
    """
    templates = environment()
    context = page_context(report, pictures, earlier, pictures_before or _NO_PICTURES)
    return templates.get_template("report.html.j2").render(with_panels(context, templates))


def write_pages(
    report: ProgressReport,
    pictures: Mapping[str, bytes],
    folder: Path,
    earlier: Sequence[ProgressReport] = (),
    pictures_before: Mapping[str, bytes] | None = None,
) -> tuple[Path, Path]:
    """Write `report-interactive.html` and `report.html` into a folder; return their paths.

    Raises:
        OutputError: one can't be written, or a picture can't be decoded.
    """
    templates = environment()
    context = page_context(report, pictures, earlier, pictures_before or _NO_PICTURES)
    context = with_panels(context, templates)
    page, interactive = folder / "report.html", folder / "report-interactive.html"
    with writing(interactive):
        interactive.write_bytes(interactive_from(context, templates).encode("utf-8", "replace"))
    with writing(page):
        text = templates.get_template("report.html.j2").render(context)
        page.write_bytes(text.encode("utf-8", "replace"))
    return interactive, page
