"""Drawings on pages of paper, to scale, as a PDF: turned where that fits, in tiles where no page is large enough."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import Any

from asbuilt_bim.errors import MissingExtraError, OptionError
from asbuilt_bim.report.sheets.shapes import Box, Disc, Drawing, Shape, Stroke
from asbuilt_bim.report.wording.of_sheets import RULER, TILES, title_of

MARGIN_M = 0.010  # what office printers leave white
FOOT_M = 0.030  # for the ruler and the words
RULER_M = 0.100
MAX_PAGES = 200
_POINTS = 72.0 / 0.0254  # of a metre
_COLOURS = {"black": (0.0, 0.0, 0.0), "red": (0.85, 0.05, 0.08), "grey": (0.55, 0.55, 0.55)}
_TEXT_PT, _LINE_M = 9.0, 0.0045


@dataclass(frozen=True, slots=True, kw_only=True)
class Paper:
    """A sheet of paper, upright."""

    name: str
    width_m: float
    height_m: float

    @property
    def room_m(self) -> tuple[float, float]:
        """Return width and height that a drawing may have on the upright sheet."""
        return self.width_m - 2.0 * MARGIN_M, self.height_m - 2.0 * MARGIN_M - FOOT_M

    @property
    def turned(self) -> "Paper":
        """Return the sheet laid on its side."""
        return Paper(name=self.name, width_m=self.height_m, height_m=self.width_m)


PAPERS = {
    name: Paper(name=name, width_m=width, height_m=height)
    for name, width, height in (
        ("A4", 0.210, 0.297),
        ("A3", 0.297, 0.420),
        ("Letter", 0.2159, 0.2794),
        ("Tabloid", 0.2794, 0.4318),
    )
}


def sheets_pdf(drawings: Sequence[Drawing], paper: Paper) -> bytes:
    """Return a PDF with every drawing at its true size, the same bytes each time.

    Raises:
        OptionError: that would be more than `MAX_PAGES` pages.
        MissingExtraError: reportlab isn't installed.
    """
    try:
        from reportlab.pdfgen.canvas import Canvas
    except ImportError as problem:
        raise MissingExtraError("printing needs reportlab: pip install reportlab") from problem
    pages = [(drawing, page) for drawing in drawings for page in _pages(drawing, paper)]
    if len(pages) > MAX_PAGES:
        raise OptionError(f"{len(pages)} pages, limit {MAX_PAGES}; choose a larger paper, or print fewer at once")
    data = BytesIO()
    canvas = Canvas(data, invariant=1)
    for drawing, page in pages:
        canvas.setPageSize((page.paper.width_m * _POINTS, page.paper.height_m * _POINTS))
        _draw_page(canvas, drawing, page)
        canvas.showPage()
    canvas.save()
    return data.getvalue()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Page:
    """What of a drawing one page shows, from `left_m`, `top_m` on; tiles are counted from 1."""

    paper: Paper
    left_m: float
    top_m: float
    width_m: float
    height_m: float
    row: int = 1
    column: int = 1
    rows: int = 1
    columns: int = 1


def sheets_needed(drawings: Sequence[Drawing], paper: Paper) -> tuple[int, int]:
    """Return how many sheets some drawings need, and how many of them the drawing that needs most."""
    each = [len(_pages(drawing, paper)) for drawing in drawings]
    return sum(each), max(each, default=0)


def _pages(drawing: Drawing, paper: Paper) -> list[_Page]:
    """Lay a drawing on as few pages as do."""
    ways = [(sheet, *_tiles(drawing, sheet)) for sheet in (paper, paper.turned)]
    sheet, columns, rows = min(ways, key=lambda way: way[1] * way[2])
    width_m, height_m = drawing.width_m / columns, drawing.height_m / rows
    return [
        _Page(
            paper=sheet,
            left_m=column * width_m,
            top_m=row * height_m,
            width_m=width_m,
            height_m=height_m,
            row=row + 1,
            column=column + 1,
            rows=rows,
            columns=columns,
        )
        for row in range(rows)
        for column in range(columns)
    ]


def _tiles(drawing: Drawing, sheet: Paper) -> tuple[int, int]:
    room = sheet.room_m
    return math.ceil(drawing.width_m / room[0] - 1e-9), math.ceil(drawing.height_m / room[1] - 1e-9)


def _draw_page(canvas: Any, drawing: Drawing, page: _Page) -> None:
    """Draw one page; PDF counts from the lower left corner upwards."""
    left_m = (page.paper.width_m - page.width_m) / 2.0
    top_m = MARGIN_M
    canvas.saveState()
    clip = canvas.beginPath()
    clip.rect(*_rectangle(page.paper, left_m, top_m, page.width_m, page.height_m))
    canvas.clipPath(clip, stroke=0, fill=0)
    for shape in drawing.shapes:
        _draw(canvas, shape, page.paper, left_m - page.left_m, top_m - page.top_m)
    canvas.restoreState()
    if page.rows * page.columns > 1:
        canvas.setLineWidth(0.3)
        canvas.setStrokeColorRGB(*_COLOURS["grey"])
        canvas.rect(*_rectangle(page.paper, left_m, top_m, page.width_m, page.height_m), stroke=1, fill=0)
    _draw_foot(canvas, drawing, page)


def _draw(canvas: Any, shape: Shape, paper: Paper, right_m: float, down_m: float) -> None:
    if isinstance(shape, Stroke):
        canvas.setLineWidth(0.4)
        canvas.setStrokeColorRGB(*_COLOURS["grey"])
        (x0, y0), (x1, y1) = (_point(paper, x + right_m, y + down_m) for x, y in (shape.start_m, shape.end_m))
        canvas.line(x0, y0, x1, y1)
        return
    canvas.setFillColorRGB(*_COLOURS[shape.colour])
    if isinstance(shape, Disc):
        x, y = _point(paper, shape.x_m + right_m, shape.y_m + down_m)
        canvas.circle(x, y, shape.radius_m * _POINTS, stroke=0, fill=1)
    elif isinstance(shape, Box):
        box = _rectangle(paper, shape.left_m + right_m, shape.top_m + down_m, shape.width_m, shape.height_m)
        canvas.rect(*box, stroke=0, fill=1)


def _draw_foot(canvas: Any, drawing: Drawing, page: _Page) -> None:
    """Draw the ruler to check the printer by, and what the sheet is."""
    paper, left_m = page.paper, MARGIN_M
    base_m = paper.height_m - MARGIN_M - FOOT_M + 0.008
    canvas.setStrokeColorRGB(*_COLOURS["black"])
    canvas.setFillColorRGB(*_COLOURS["black"])
    canvas.setLineWidth(0.5)
    canvas.line(*_point(paper, left_m, base_m), *_point(paper, left_m + RULER_M, base_m))
    for centimetre in range(11):
        x_m, up_m = left_m + centimetre * 0.01, 0.004 if centimetre % 5 == 0 else 0.0025
        canvas.line(*_point(paper, x_m, base_m), *_point(paper, x_m, base_m - up_m))
    canvas.setFont("Helvetica", _TEXT_PT)
    tile = (page.row, page.rows, page.column, page.columns)
    lines = [RULER, *drawing.words]
    if page.rows * page.columns > 1:
        lines.append(TILES.format(*tile))
    for number, line in enumerate(lines, start=1):
        canvas.drawString(*_point(paper, left_m, base_m + number * _LINE_M), line)
    canvas.setTitle(title_of(drawing.words))


def _point(paper: Paper, x_m: float, y_m: float) -> tuple[float, float]:
    return x_m * _POINTS, (paper.height_m - y_m) * _POINTS


def _rectangle(
    paper: Paper, left_m: float, top_m: float, width_m: float, height_m: float
) -> tuple[float, float, float, float]:
    x, y = _point(paper, left_m, top_m + height_m)
    return x, y, width_m * _POINTS, height_m * _POINTS
