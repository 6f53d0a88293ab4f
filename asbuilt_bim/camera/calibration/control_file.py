"""The file of control points: places measured on site, and where both photos of one pair show them."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asbuilt_bim.errors import CalibrationError
from asbuilt_bim.geometry.arrays import FloatArray, frozen
from asbuilt_bim.storage.csv_file import CsvRow, csv_table
from asbuilt_bim.storage.regular_file import read_bytes

COLUMNS = ("id", "x_m", "y_m", "z_m", "left_x", "left_y", "right_x", "right_y")
MAX_BYTES = 1_000_000
MAX_POINTS = 500
"""Nobody marks more by hand; the work grows with their square."""
_MOST_PROBLEMS = 20


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ControlPoints:
    """Points (N, 3) in metres in any right-handed frame, and their pixels (N, 2) in the ORIGINAL photos.

    NaN where a photo doesn't show a point.
    """

    names: tuple[str, ...]
    points_m: FloatArray
    left_px: FloatArray
    right_px: FloatArray


def read_control_points(path: Path) -> ControlPoints:
    """Read a CSV file with the columns of `COLUMNS`; empty pixels say that a photo doesn't show the point.

    Raises: CalibrationError with every bad line.
    """
    name = f"control points {path}"
    table = csv_table(read_bytes(path, MAX_BYTES, CalibrationError, name), name, CalibrationError)
    head = [cell.lower() for cell in table.header]
    if missing := [name for name in COLUMNS if name not in head]:
        raise CalibrationError(f"control points {path}: columns are missing: {', '.join(missing)}; needed are "
                               f"{', '.join(COLUMNS)}")  # fmt: skip
    return _points(path, table.rows, [head.index(name) for name in COLUMNS], "." if table.sign == "," else ",")


def _points(path: Path, rows: Iterable[CsvRow], at: list[int], decimal: str) -> ControlPoints:
    names: list[str] = []
    numbers: list[list[float]] = []
    problems: list[str] = []
    for line, row in rows:
        cells = [row[index] if index < len(row) else "" for index in at]
        values = [_number(cell.replace(decimal, ".")) for cell in cells[1:]]
        name = cells[0][:60]
        if not name or name in names:
            problems.append(f"line {line}: id {name!r} is {'there twice' if name else 'empty'}")
        elif any(value is None for value in values[:3]):
            problems.append(f"line {line}: point {name}: x_m, y_m, z_m must be numbers, with a decimal point")
        elif any((values[i] is None) != (cells[1 + i] == "") for i in range(3, 7)):
            problems.append(f"line {line}: point {name}: pixels must be numbers, or empty where not seen")
        elif (values[3] is None) != (values[4] is None) or (values[5] is None) != (values[6] is None):
            problems.append(f"line {line}: point {name}: x and y of a photo go together")
        else:
            names.append(name)
            numbers.append([math.nan if value is None else value for value in values])
    if problems:
        more = [f"... and {len(problems) - _MOST_PROBLEMS} more"] if len(problems) > _MOST_PROBLEMS else []
        raise CalibrationError("\n  ".join([f"control points {path}:", *problems[:_MOST_PROBLEMS], *more]))
    if len(names) > MAX_POINTS:
        raise CalibrationError(f"control points {path}: {len(names)} points, limit {MAX_POINTS}; keep the best spread")
    table = np.array(numbers, dtype=np.float64).reshape(-1, 7)
    places: dict[tuple[float, ...], str] = {}
    for name, place in zip(names, table[:, :3].tolist(), strict=True):
        if (other := places.setdefault(tuple(place), name)) != name:
            raise CalibrationError(
                f"control points {path}: {name} and {other} are one place, and a place proves nothing twice; keep one"
            )
    return ControlPoints(
        names=tuple(names), points_m=frozen(table[:, :3]), left_px=frozen(table[:, 3:5]), right_px=frozen(table[:, 5:])
    )


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if abs(value) < 1e9 else None
