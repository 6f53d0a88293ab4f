"""The surveyed markers: a table of corners in world metres, checked before a pose is built on it."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.codes import Reason, SubjectKind, about
from asbuilt_bim.errors import Rejection, SurveyError, rejected
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.register.pose import SurveyedMarker
from asbuilt_bim.register.print_shape import CORNERS, UNIT_MISTAKES, print_faults
from asbuilt_bim.storage.csv_file import csv_table
from asbuilt_bim.storage.regular_file import read_bytes

COLUMNS = ("id", "corner", "x_m", "y_m", "z_m")

CENTRE = "centre"
"""In the place of a corner: the marker's middle is surveyed, and nothing else of it."""
MAX_COORDINATE_M = 1e9
"""Beyond the moon; what is written so is no place."""
MAX_DIGITS = 9
_GROUPED = re.compile(r"([+-]?\d{1,3}(?:([., '\u00a0\u202f])\d{3})(?:\2\d{3})*)(?!\2)[.,](\d+)")
MAX_NAMED = 8  # markers, or lines, of one fault
MAX_BYTES = 10_000_000
FAR_M = 200.0
"""A marker further than this from the building is not on its site."""


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


def check_survey(survey: Sequence[SurveyedMarker], design: BimModel) -> tuple[Rejection, ...]:
    """Name the markers that lie far from the design's building.

    Raises:
        SurveyError: most of the markers do; survey and model are in two coordinate systems or units.
    """
    if not survey or (box := design.box_m()) is None:
        return ()
    low, high = box
    away_m = design.off_box_m(np.array([one.corners_m.mean(axis=0) for one in survey]))
    found = [(one, float(away)) for one, away in zip(survey, away_m, strict=True) if away > FAR_M]
    if 2 * len(found) > len(survey):
        marker, away = found[0]
        raise SurveyError(
            f"the survey: {len(found)} of {len(survey)} markers lie further than {FAR_M:.0f} m from the building of "
            f"{design.file_name} (marker {marker.marker_id}: {metres(away)}; the building spans "
            f"{_xyz(low)} to {_xyz(high)} m){_offset_hint(survey, low, high)}. Give the survey in the IFC's world "
            "coordinates, in metres (site placement applied, no map conversion)"
        )
    return tuple(
        rejected(Reason.MARKER_FAR, about(SubjectKind.MARKER, str(marker.marker_id)), away_m=away, limit_m=FAR_M)
        for marker, away in found
    )


def _rows(path: Path) -> tuple[list[_Row], list[str]]:
    table = csv_table(read_bytes(path, MAX_BYTES, SurveyError, f"survey {path}"), str(path), SurveyError, comments=True)
    header = [cell.lower() for cell in table.header]
    missing = [name for name in COLUMNS if name not in header]
    if missing:
        raise SurveyError(
            f"{path}: the survey's first line lacks {', '.join(missing)}; it must be `{','.join(COLUMNS)}`, "
            f"and is `{','.join(header)}`"
        )
    rows: list[_Row] = []
    problems: list[str] = []
    for number, cells in table.rows:
        row = _row(dict(zip(header, cells, strict=False)), number, table.sign != ",")
        if isinstance(row, _Row):
            rows.append(row)
        else:
            problems.append(row)
    if len(problems) > MAX_NAMED:
        problems[MAX_NAMED:] = [f"{len(problems) - MAX_NAMED} more lines can't be read"]
    return rows, problems


def _row(cells: dict[str, str], line: int, decimal_comma: bool) -> _Row | str:
    faults = []
    marker_id = cells.get("id", "")
    if not (marker_id.isascii() and marker_id.isdigit() and len(marker_id) <= MAX_DIGITS):
        faults.append(f"id {marker_id[:40]!r} is no whole number")
    corner = cells.get("corner", "").lower().replace("_", "-").replace(" ", "-")
    corner = CENTRE if corner == "center" else corner
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


def _offset_hint(survey: Sequence[SurveyedMarker], low: FloatArray, high: FloatArray) -> str:
    middle = np.mean([m.corners_m.mean(axis=0) for m in survey], axis=0)
    target = 0.5 * (low + high)
    every = np.concatenate([marker.corners_m for marker in survey])
    span, wanted = float(np.linalg.norm(np.ptp(every, axis=0))) + 1e-3, float(np.linalg.norm(high - low))
    for factor, unit in UNIT_MISTAKES.items():
        near = np.all(np.abs(middle / factor - target) < FAR_M) and not np.all(np.abs(middle - target) < FAR_M)
        if near and abs(np.log(span / factor / wanted)) < abs(np.log(span / wanted)):
            return f"; the numbers look like {unit}"
    exchanged = middle[[1, 0, 2]]
    if np.all(np.abs(exchanged - target) < FAR_M):
        return "; x and y (easting and northing) look exchanged"
    return "; if it was right before, the IFC was written from another origin since"


def _xyz(point: FloatArray) -> str:
    return "(" + ", ".join(f"{value:.1f}" for value in point) + ")"


def metres(value: float) -> str:
    """Return a distance over 200 m as people say it."""
    return f"{value:.0f} m" if value < 10_000 else f"{value / 1000:.0f} km"
