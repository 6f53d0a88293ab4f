"""The survey: a table of the markers' corners in world metres, as people type it or a total station exports it."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asbuilt_bim.errors import SurveyError
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.register.pose import SurveyedMarker
from asbuilt_bim.register.print_shape import CORNERS, print_faults
from asbuilt_bim.register.survey import MAX_COORDINATE_M
from asbuilt_bim.storage.csv_file import csv_table
from asbuilt_bim.storage.regular_file import read_bytes

COLUMNS = ("id", "corner", "x_m", "y_m", "z_m")
_CALLED = {
    "id": ("id", "marker", "tag", "point", "point id", "pointid", "name", "punkt"),
    "corner": ("corner",),
    "x_m": ("x_m", "x", "easting", "east", "e", "rechtswert"),
    "y_m": ("y_m", "y", "northing", "north", "n", "hochwert"),
    "z_m": ("z_m", "z", "height", "elevation", "h", "höhe"),
}
"""What a column may be called."""
_NAMES = {called: column for column, names in _CALLED.items() for called in names}
_UNIT = re.compile(r"(.*?)\s*[\[(](.*?)[\])]")
_METRES = ("m", "metre", "metres", "meter", "meters")
_POINT = re.compile(r"[A-Za-z]*[ _.-]*(\d{1,9})[ _./-]*([A-Za-z][A-Za-z _-]*)")
"""A point that says both: `7-top-left`, `M7_TL`, `tag 7 centre`."""
CENTRE = "centre"
"""In the place of a corner: the marker's middle is surveyed, and nothing else of it."""
_SHORT = {"tl": "top-left", "tr": "top-right", "br": "bottom-right", "bl": "bottom-left", "c": CENTRE, "center": CENTRE}
MAX_DIGITS = 9
_GROUPED = re.compile(r"([+-]?\d{1,3}(?:([., '\u00a0\u202f])\d{3})(?:\2\d{3})*)(?!\2)[.,](\d+)")
MAX_NAMED = 8  # markers, or lines, of one fault
MAX_BYTES = 10_000_000


def is_survey(lines: Sequence[str]) -> bool:
    """Say by its first lines whether a table is a survey of markers."""
    header, *rows = ([cell.strip().strip('"') for cell in re.split(r"[,;\t]", line)] for line in lines or [""])
    places = _places(header)
    if not places.keys() >= set(COLUMNS) - {"corner"}:
        return False
    return "corner" in places or _names_corners(rows, places)


def _names_corners(rows: Sequence[Sequence[str]], places: Mapping[str, int]) -> bool:
    """Say whether some points say which corner of a marker they are."""
    at = places.get("id")
    return at is not None and any(_POINT.fullmatch(row[at]) for row in rows if len(row) > at)


def _places(header: Sequence[str]) -> dict[str, int]:
    """Return where each column stands; its own name counts before what else it may be called, then the first."""
    names = [_UNIT.sub(r"\1", cell).strip().casefold().replace("-", " ") for cell in header]
    order = sorted(enumerate(names), key=lambda one: (one[1] not in COLUMNS, one[0]), reverse=True)
    return {_NAMES[name]: at for at, name in order if name in _NAMES}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Row:
    line: int
    marker_id: int
    corner: str
    xyz_m: tuple[float, float, float]


def read_survey(path: Path, size_m: float, sigma_m: float) -> tuple[SurveyedMarker, ...]:
    """Read markers from a CSV table `id,corner,x_m,y_m,z_m`; comma, or semicolon with decimal comma or point.

    A marker has its four corners, or one row whose corner is `centre`.

    `size_m` is the side of the printed black square, `sigma_m` each surveyed coordinate's standard deviation.

    Raises:
        SurveyError: the file can't be read, or a row, a shape or a unit is wrong; at most eight rows are listed.
    """
    rows, problems = _rows(path)
    by_marker: dict[int, dict[str, _Row]] = {}
    for row in rows:
        corners = by_marker.setdefault(row.marker_id, {})
        if row.corner in corners:
            first = corners[row.corner].line
            problems.append(f"line {row.line}: marker {row.marker_id} has its {row.corner} corner twice (line {first})")
        corners.setdefault(row.corner, row)
    markers = []
    lacking: dict[str, list[int]] = {}
    for marker_id, corners in sorted(by_marker.items()):
        if CENTRE in corners:
            if len(corners) > 1:
                problems.append(f"marker {marker_id} has its centre and corners too; keep the four corners")
            alone = np.array([corners[CENTRE].xyz_m])
            markers.append(SurveyedMarker(marker_id=marker_id, corners_m=frozen(alone), sigma_m=sigma_m))
            continue
        missing = ", ".join(name for name in CORNERS if name not in corners)
        if missing:
            lacking.setdefault(missing, []).append(marker_id)
            continue
        xyz = np.array([corners[name].xyz_m for name in CORNERS])
        markers.append(SurveyedMarker(marker_id=marker_id, corners_m=frozen(xyz), sigma_m=sigma_m))
    problems += [f"{_numbered(ids)}: {corners} missing" for corners, ids in lacking.items()]
    whole = {marker.marker_id: marker.corners_m for marker in markers if len(marker.corners_m) == len(CORNERS)}
    lines = {one: [by_marker[one][name].line for name in CORNERS] for one in whole}
    problems += print_faults(whole, size_m, lines)
    if not problems and not markers:
        problems.append("it holds no marker; give four corners for each marker")
    if problems:
        raise SurveyError(f"{path}: the survey can't be used:\n" + "\n".join(f"  - {one}" for one in problems))
    return tuple(markers)


def _numbered(ids: Sequence[int]) -> str:
    """Name markers, the first ones where they are many."""
    named = ", ".join(map(str, ids[:MAX_NAMED]))
    more = f" and {len(ids) - MAX_NAMED} more" if len(ids) > MAX_NAMED else ""
    return f"marker{'s' if len(ids) > 1 else ''} {named}{more}"


def _rows(path: Path) -> tuple[list[_Row], list[str]]:
    table = csv_table(read_bytes(path, MAX_BYTES, SurveyError, f"survey {path}"), str(path), SurveyError, comments=True)
    places = _places(table.header)
    by_point = "corner" not in places and _names_corners([cells for _, cells in table.rows], places)
    missing = [name for name in COLUMNS if name not in places and not (by_point and name == "corner")]
    if missing:
        raise SurveyError(
            f"{path}: the survey's first line lacks {', '.join(missing)}; it must be `{','.join(COLUMNS)}`, "
            f"and is `{','.join(cell.lower() for cell in table.header)}`"
        )
    _check_headings(table.header, path)
    rows: list[_Row] = []
    problems: list[str] = []
    for number, cells in table.rows:
        given = {name: cells[at] for name, at in places.items() if at < len(cells)}
        if by_point:
            if (point := _POINT.fullmatch(given.get("id", ""))) is None:
                continue  # a station, a control point
            given |= {"id": point[1], "corner": point[2]}
        row = _row(given, number, table.sign != ",")
        if isinstance(row, _Row):
            rows.append(row)
        else:
            problems.append(row)
    if len(problems) > MAX_NAMED:
        problems[MAX_NAMED:] = [f"{len(problems) - MAX_NAMED} more lines can't be read"]
    return rows, problems


def _check_headings(header: Sequence[str], path: Path) -> None:
    """Refuse coordinates that aren't in metres by their heading, and two columns of one coordinate."""
    places = _places(header)
    for cell in header:
        column = next(iter(_places([cell])), "")
        if column not in COLUMNS[2:]:
            continue
        unit = _UNIT.fullmatch(cell)
        if unit is not None and unit[2].strip().casefold() not in _METRES:
            raise SurveyError(f"{path}: the survey's column `{cell}` is in {unit[2]}; give it in metres")
        counted = header[places[column]]
        if cell != counted and counted.strip().casefold() != column:
            raise SurveyError(
                f"{path}: the survey's columns `{counted}` and `{cell}` may both be {column}; name the one that "
                f"counts {column}"
            )


def _row(cells: Mapping[str, str], line: int, decimal_comma: bool) -> _Row | str:
    faults = []
    marker_id = cells.get("id", "")
    if not (marker_id.isascii() and marker_id.isdigit() and len(marker_id) <= MAX_DIGITS):
        faults.append(f"id {marker_id[:40]!r} is no whole number")
    corner = cells.get("corner", "").lower().replace("_", "-").replace(" ", "-")
    corner = _SHORT.get(corner.strip("-"), corner)
    if corner not in (*CORNERS, CENTRE):
        faults.append(f"unknown corner {cells.get('corner', '')!r} (it is one of {', '.join((*CORNERS, CENTRE))})")
    numbers = []
    for name in COLUMNS[2:]:
        text = cells.get(name, "")
        value = _number(text.replace(",", ".") if decimal_comma else text)
        if value is None:
            faults.append(f"{name} {text!r} is no number{_without_groups(text)}")
        else:
            numbers.append(value)
    if faults:
        return f"line {line}: " + "; ".join(faults)
    return _Row(line=line, marker_id=int(marker_id), corner=corner, xyz_m=(numbers[0], numbers[1], numbers[2]))


def _without_groups(text: str) -> str:
    """Say how a number is written without signs between its thousands, where it has some: `2.325,7727`."""
    if not (found := _GROUPED.fullmatch(text)):
        return " (write a decimal point, or semicolons between cells)" if "," in text else ""
    whole, _, fraction = found.groups()
    return f" (without signs between thousands it is {re.sub('[^-+0-9]', '', whole)}.{fraction})"


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if abs(value) < MAX_COORDINATE_M else None
