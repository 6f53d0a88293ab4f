"""Observations tables: a person, a day and a share for an element that is surely meant."""

from __future__ import annotations

from datetime import date
from pathlib import Path

import pytest

from asbuilt_bim.codes import Reason
from asbuilt_bim.errors import CostError
from asbuilt_bim.ifc.read.design import read_design
from asbuilt_bim.project.tables.observations import read_observations
from tests.ifc.models import ModelBuilder


@pytest.fixture(scope="module")
def design(tmp_path_factory: pytest.TempPathFactory):
    builder = ModelBuilder(schema="IFC4")
    builder.box("IfcWall", "W1", (0.0, 0.0, 0.0), (4.0, 0.2, 3.0))
    builder.box("IfcWall", "same", (0.0, 5.0, 0.0), (4.0, 0.2, 3.0))
    builder.box("IfcColumn", "same", (6.0, 0.0, 0.0), (0.4, 0.4, 3.0))
    return read_design(builder.write(tmp_path_factory.mktemp("ifc") / "design.ifc"))


def table(path: Path, *rows: str) -> Path:
    path.write_text("element,date,state,percent,by,why\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return path


def test_an_element_is_known_by_its_global_id_or_by_a_name_of_its_own(tmp_path: Path, design) -> None:
    column = next(e for e in design.elements if e.kind == "column")
    path = table(
        tmp_path / "o.csv",
        "W1,2026-03-02,,45,Ann,by tape",
        f"{column.global_id},02.03.2026,complete,,Ben,",
        "same,2026-03-02,not started,,Ben,",
        "W1,,,,,",
    )
    found, (note,) = read_observations(path, design)
    assert [(one.share, one.day, one.by, one.why) for one in found] == [
        (0.45, date(2026, 3, 2), "Ann", "by tape"), (1.0, date(2026, 3, 2), "Ben", ""),
    ]  # fmt: skip
    assert note.code is Reason.OBSERVATION_UNKNOWN and note.values["elements"] == ("same",)


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        ("W1,,complete,,Ann,", "has no date"),
        ("W1,2026-03-02,,,Ann,", "neither a percent nor the state"),
        ("W1,2026-03-02,Compleet,,Ann,", "state 'Compleet' is unknown; did you mean complete"),
        ("W1,2026-03-02,compleet,40,Ann,", "state 'compleet' is unknown; did you mean complete"),
        ("W1,2026-03-02,no started,,Ann,", "state 'no started' is unknown; did you mean not started"),
        ("W1,2026-03-02,part,,Ann,", "state 'part' is unknown; write complete or not started, or a percent"),
        ("W1,2026-03-02,incomplete,,Ann,", "state 'incomplete' is unknown; write complete"),
        ("W1,2026-03-02,not complete,,Ann,", "state 'not complete' is unknown; write complete"),
        ("W1,2026-03-02,complete,40,Ann,", "says complete and 40 %"),
        ("W1,2026-03-02,complete,,,", "by whom"),
        ("W1,02/03/2026,complete,,Ann,", "is no day; write 2026-03-16 .in Excel: .*yyyy-mm-dd"),
        ("W1,2026-03-02,,140,Ann,", "no percentage"),
    ],
)
def test_a_row_that_says_not_enough_is_refused_by_its_number(tmp_path: Path, design, row: str, reason: str) -> None:
    with pytest.raises(CostError, match=f"row 2: .*{reason}"):
        read_observations(table(tmp_path / "o.csv", row), design)
