"""A flat table as Parquet, by pyarrow (the extra `parquet`)."""

import io
from collections.abc import Sequence
from datetime import datetime
from typing import Any

from asbuilt_bim.errors import MissingExtraError
from asbuilt_bim.report.flat.columns import Column
from asbuilt_bim.report.flat.rows import Cell


def parquet_bytes(columns: Sequence[Column], rows: Sequence[Sequence[Cell]]) -> bytes:
    """Return a table as Parquet; each column has its kind, and its meaning as metadata.

    Raises:
        MissingExtraError: pyarrow isn't installed.
    """
    arrow, parquet = _arrow()
    kinds = {
        "string": arrow.string(), "number": arrow.float64(), "integer": arrow.int64(), "boolean": arrow.bool_(),
        "date": arrow.date32(), "datetime": arrow.timestamp("us"),
    }  # fmt: skip
    fields = [
        arrow.field(one.name, kinds[one.kind], nullable=not one.always, metadata={"description": one.meaning})
        for one in columns
    ]
    arrays = [arrow.array([_cell(row[number]) for row in rows], type=field.type) for number, field in enumerate(fields)]
    out = io.BytesIO()
    parquet.write_table(arrow.Table.from_arrays(arrays, schema=arrow.schema(fields)), out, compression="zstd")
    return out.getvalue()


def _arrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as problem:
        raise MissingExtraError(
            "Parquet needs pyarrow, which isn't installed: pip install pyarrow; CSV needs nothing"
        ) from problem
    return pyarrow, pyarrow.parquet


def _cell(value: Cell) -> Cell:
    if isinstance(value, datetime):
        return value.replace(tzinfo=None)  # as planned, wherever that is
    return value.encode("utf-8", "replace").decode() if isinstance(value, str) else value
