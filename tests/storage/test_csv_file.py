"""CSV rows wider than their headings are refused, whoever reads them: a cell too many moves all that follow it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from asbuilt_bim.bim.model import BimModel
from asbuilt_bim.camera.calibration.control_file import read_control_points
from asbuilt_bim.errors import AsBuiltError, CostError
from asbuilt_bim.project.tables.costs import read_costs
from asbuilt_bim.project.tables.observations import read_observations
from asbuilt_bim.project.tables.outlines import read_outlines
from asbuilt_bim.project.tables.places import known_places
from asbuilt_bim.project.tables.survey import read_survey
from asbuilt_bim.schedule.read import read_schedule
from asbuilt_bim.storage.csv_file import csv_table
from asbuilt_bim.vision.masks.file import read_masks
from tests.match.small_site import box, element, model
from tests.project.test_places import project

COSTS = "item,text,class,storey,unit,quantity,rate\n"
DOC_COSTS = "item,text,unit,quantity,rate,currency,globalids,class,storey\n"
SEEN = "element,date,state,percent,by,why\n"
MARKERS = "id,corner,x_m,y_m,z_m\n"
POSES = "station,x_m,y_m,z_m,bearing_deg,sigma_m\n"
CONTROL = "id,x_m,y_m,z_m,left_x,left_y,right_x,right_y\n"


def design() -> BimModel:
    return model([element("W", "wall", box(0, 0, 0, 3, 0.25, 3))])


def people(path: Path) -> object:
    return read_outlines(project(path.parent, f"people: {path.name}\nposes: {{file: {path.name}}}\n"), (10_000, 10_000))


def poses(path: Path) -> object:
    made = project(path.parent, f"poses: {{file: {path.name}, coordinates: ifc}}\n")
    return known_places(made, lambda: pytest.fail("no map is asked for"))


READERS: dict[str, tuple[Callable[[Path], object], str, int, int]] = {
    "a rate at the end": (
        read_costs, COSTS + '1.1,"Columns, ground floor",IfcColumn,Ground floor,m3,4,310,75\n', 8, 7,
    ),
    "quantity and rate": (read_costs, COSTS + "1.1,Walls,IfcWall,Ground floor,m3,12,70,265,00\n", 9, 7),
    "a rate between semicolons": (
        read_costs, (COSTS + "1.1,Columns,IfcColumn,Ground floor,m3,4,310,75\n").replace(",", ";"), 8, 7,
    ),
    "a rate between tabs": (read_costs, (COSTS + "1.1,A,IfcColumn,EG,m3,4,310,75\n").replace(",", "\t"), 8, 7),
    "the costs of the docs": (
        read_costs, DOC_COSTS + '1.1,"Columns: C30/37",m3,3,91,310.00,EUR,,IfcColumn,Ground floor\n', 10, 9,
    ),
    "observations": (
        lambda path: read_observations(path, design()), SEEN + "Wall 05 core/GF,16.03.2026,,50,5,QS,seen\n", 7, 6,
    ),
    "markers": (lambda path: read_survey(path, 0.25, 0.002), MARKERS + "0,top-left,2325,7727,-3048,886,537,7755\n", 8,
                5),
    "control points": (read_control_points, CONTROL + "A,1,5,2,0,3,25,10,20,30,40\n", 11, 8),
    "poses": (poses, POSES + "A1,1,5,2,3,90,0.05\n", 7, 6),
    "schedule": (read_schedule, "name,start,finish\nWalls, ground floor,2026-03-02,2026-03-06\n", 4, 3),
    "people": (people, "station,outline,x_px,y_px\nA1,one,100,5,200\n", 5, 4),
    "clicks": (lambda path: read_masks(path, (160, 120)), "polygon,class,x_px,y_px\nwest,wall,10,5,20\n", 5, 4),
}  # fmt: skip


@pytest.mark.parametrize("case", READERS)
def test_a_row_with_more_cells_than_headings_is_refused_by_its_line_whoever_reads_it(tmp_path: Path, case: str) -> None:
    read, text, cells, headings = READERS[case]
    path = tmp_path / "table.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(AsBuiltError) as refused:
        read(path)
    told = str(refused.value)
    assert "table.csv" in told and f"line 2: {cells} cells under the {headings} headings of line 1" in told
    sign = {";": "semicolon", "\t": "tab"}.get(text[text.index("\n") - 5 : text.index("\n") - 4], "comma")
    assert f"a {sign} within" in told and len(told.splitlines()) == 1


def test_many_rows_that_are_too_wide_are_one_message(tmp_path: Path) -> None:
    path = tmp_path / "markers.csv"
    path.write_text(MARKERS + "0,top-left,2325,7727,-3048,886,537,7755\n" * 116, encoding="utf-8")
    with pytest.raises(AsBuiltError, match=r"line 2: 8 cells .* \(and 115 more lines\)") as refused:
        read_survey(path, 0.25, 0.002)
    assert len(str(refused.value).splitlines()) == 1


def test_empty_cells_at_a_row_s_end_are_harmless_and_a_heading_left_empty_is_none() -> None:
    found = csv_table(b"a,b,,\n1,2,,,,\n\n3\n", "t.csv", CostError)
    assert found.header == ("a", "b") and [(line, cells[:2]) for line, cells in found.rows] == [
        (2, ["1", "2"]),
        (4, ["3"]),
    ]
    with pytest.raises(CostError, match=r"t\.csv, line 2: 3 cells under the 2 headings"):
        csv_table(b"a,b,,\n310,75,x\n", "t.csv", CostError)


@pytest.mark.parametrize("read", [lambda path: read_survey(path, 0.25, 0.002), read_schedule, read_control_points])
@pytest.mark.parametrize("data", [b"", b"\xef\xbb\xbf\r\n;;\r\n"])
def test_an_empty_table_is_told_as_empty_whoever_reads_it(
    tmp_path: Path, read: Callable[[Path], object], data: bytes
) -> None:
    (tmp_path / "table.csv").write_bytes(data)
    with pytest.raises(AsBuiltError, match=r"table\.csv: the table is empty; copy or save it again, whole$"):
        read(tmp_path / "table.csv")


@pytest.mark.parametrize("sign", [";", ",", "\t"])
def test_a_line_that_tells_excel_the_sign_between_cells_is_no_heading(sign: str) -> None:
    found = csv_table(f"\r\nsep={sign}\r\na{sign}b\r\n1{sign}2\r\n".encode(), "t.csv", CostError)
    assert (found.header, found.rows, found.sign) == (("a", "b"), ((4, ["1", "2"]),), sign)


def test_a_table_that_a_spreadsheet_kept_in_one_column_is_told_to_be_parted() -> None:
    with pytest.raises(
        CostError, match=r"t\.csv, line 1: all headings stand in one cell; in Excel part .* Text to Col"
    ):
        csv_table(b'"item,text,unit"\r\n"1.1,Walls,m3"\r\n', "t.csv", CostError)


def test_a_title_above_the_headings_is_told_to_be_taken_away() -> None:
    with pytest.raises(CostError, match="nothing may stand above the headings"):
        csv_table(b"Bill of block H;;\r\nitem;text;unit\r\n1.1;Walls;m3\r\n", "t.csv", CostError)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (DOC_COSTS + "1.1,Columns,m3,3,91,310.00,EUR,,IfcColumn,\n", "row 2, currency: '310.00' is a number"),
        ("item,text,unit,quantity,rate,class\n1.1,Columns,m3,4,310,75,\n", "row 2, class: '75' is a number"),
        ("item,unit,quantity,rate,globalids,class\n1.1,m3,4,310,75,,\n", "row 2, globalids: '75' is a number"),
    ],
)
def test_a_number_cut_in_two_is_found_where_the_cells_it_moves_are_empty_at_the_end(
    tmp_path: Path, text: str, says: str
) -> None:
    (tmp_path / "costs.csv").write_text(text, encoding="utf-8")
    with pytest.raises(CostError) as refused:
        read_costs(tmp_path / "costs.csv")
    assert says in str(refused.value) and "a comma within a number" in str(refused.value)


def test_a_percentage_cut_in_two_is_no_observer(tmp_path: Path) -> None:
    (tmp_path / "seen.csv").write_text(SEEN + "W,16.03.2026,,50,5,QS\n", encoding="utf-8")
    with pytest.raises(CostError, match="row 2: '5' is a number"):
        read_observations(tmp_path / "seen.csv", design())
