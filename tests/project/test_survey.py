from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.errors import SurveyError
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.project.tables.survey import is_survey, read_survey
from asbuilt_bim.register.pose import SurveyedMarker
from asbuilt_bim.register.print_shape import CORNERS
from asbuilt_bim.register.survey import check_survey
from asbuilt_bim.report.wording.reasons import words_of
from tests.match.small_site import FAR, box, element, model

SQUARE = np.array([[0.0, 0.0, 1.28], [0.28, 0.0, 1.28], [0.28, 0.0, 1.0], [0.0, 0.0, 1.0]])


def table(markers: dict[int, np.ndarray]) -> str:
    lines = ["id,corner,x_m,y_m,z_m"]
    for marker_id, corners in markers.items():
        lines += [f"{marker_id},{name},{x},{y},{z}" for name, (x, y, z) in zip(CORNERS, corners, strict=True)]
    return "\n".join(lines) + "\n"


def read(tmp_path: Path, text: str, encoding: str = "utf-8") -> tuple[object, ...]:
    path = tmp_path / "markers.csv"
    path.write_text(text, encoding=encoding)
    return read_survey(path, 0.28, 0.002)


def test_markers_are_read_in_the_print_s_corner_order(tmp_path: Path) -> None:
    lines = table({7: SQUARE}).splitlines()
    markers = read(tmp_path, "\n".join([lines[0], *reversed(lines[1:])]))
    np.testing.assert_allclose(markers[0].corners_m, SQUARE)  # type: ignore[attr-defined]
    assert markers[0].marker_id == 7 and markers[0].sigma_m == 0.002  # type: ignore[attr-defined]


@pytest.mark.parametrize(("sign", "encoding"), [(";", "utf-8-sig"), ("\t", "utf-16")])
def test_a_german_export_with_decimal_commas_and_a_byte_order_mark_is_read(
    tmp_path: Path, sign: str, encoding: str
) -> None:
    markers = read(tmp_path, table({7: SQUARE}).replace(",", sign).replace(".", ","), encoding)
    np.testing.assert_allclose(markers[0].corners_m, SQUARE)  # type: ignore[attr-defined]


def test_signs_between_thousands_are_named_with_the_number_and_a_whole_table_of_them_in_a_few_lines(
    tmp_path: Path,
) -> None:
    lines = ["id;corner;x_m;y_m;z_m", *(f"{n};{name};2.325,7727;-3.048,886;7,5" for n in range(29) for name in CORNERS)]
    with pytest.raises(SurveyError) as refused:
        read(tmp_path, "\n".join(lines))
    told = str(refused.value).splitlines()
    assert "line 2: x_m '2.325,7727' is no number (without signs between thousands it is 2325.7727)" in told[1]
    assert "y_m '-3.048,886' is no number (without signs between thousands it is -3048.886)" in told[1]
    assert len(told) == 10 and "108 more lines can't be read" in told[-1]


@pytest.mark.parametrize(
    ("text", "wanted"), [("12,345.5", "12345.5"), ("1 234,5", "1234.5"), ("1.2.3", ""), ("1.234.567", ""), ("x", "")]
)
def test_a_number_is_told_without_its_signs_only_where_it_can_mean_one_thing(
    tmp_path: Path, text: str, wanted: str
) -> None:
    with pytest.raises(SurveyError) as refused:
        read(tmp_path, f'id,corner,x_m,y_m,z_m\n1,centre,"{text}",0,0\n')
    assert "is no number" in str(refused.value)
    assert (f"it is {wanted})" in str(refused.value)) == bool(wanted)


@pytest.mark.parametrize(
    ("factor", "unit"), [(1000.0, "millimetres"), (100.0, "centimetres"), (1 / 0.3048, "feet"), (1 / 0.0254, "inches")]
)
def test_a_unit_mistake_is_named(tmp_path: Path, factor: float, unit: str) -> None:
    with pytest.raises(SurveyError, match=unit):
        read(tmp_path, table({7: SQUARE * factor}))


def test_a_decimal_comma_between_commas_is_told_how_to_be_written(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"x_m '2325,7727' is no number \(write a decimal point, or semicolons betw"):
        read(tmp_path, 'id,corner,x_m,y_m,z_m\n1,centre,"2325,7727",0,0\n')


def test_every_bad_row_is_listed_in_one_answer(tmp_path: Path) -> None:
    text = table({7: SQUARE, 8: SQUARE + 2.0}) + "9,middle,1,2,3\n7,top-left,0,0,1.28\n10,top-left,abc,0,0\n"
    with pytest.raises(SurveyError) as caught:
        read(tmp_path, text)
    message = str(caught.value)
    for part in (
        "line 10: unknown corner 'middle'",
        "line 11: marker 7 has its top-left corner twice",
        "line 12: x_m 'abc' is no number",
    ):
        assert part in message


def test_missing_corners_are_named(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match="marker 7: bottom-left missing"):
        read(tmp_path, "\n".join(table({7: SQUARE}).splitlines()[:-1]))


def test_a_corner_that_every_marker_lacks_is_one_line(tmp_path: Path) -> None:
    text = "\n".join(line for line in table(dict.fromkeys(range(20), SQUARE)).splitlines() if "bottom-left" not in line)
    with pytest.raises(SurveyError, match="markers 0, 1, 2, 3, 4, 5, 6, 7 and 12 more: bottom-left missing") as caught:
        read(tmp_path, text)
    assert len(str(caught.value).splitlines()) == 2


def test_corners_in_the_wrong_order_are_no_square(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match="no square"):
        read(tmp_path, table({7: SQUARE[[0, 2, 1, 3]]}))


def test_one_corner_that_was_typed_wrong_is_named_with_its_line_and_where_it_should_be(tmp_path: Path) -> None:
    typed = SQUARE.copy()
    typed[2, 0] += 63.0
    with pytest.raises(SurveyError) as refused:
        read(tmp_path, table({7: typed}))
    told = str(refused.value)
    wanted = ", ".join(f"{value:.3f}" for value in SQUARE[2])
    assert "marker 7: its corners are no square: the bottom-right one (line 4) lies 63.000 m off" in told
    assert f"by the other three it is near ({wanted}). Correct that row" in told and "limit" not in told


def test_a_print_of_another_size_than_told_is_named(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"marker 7: its side is 0\.2 m where the print is 0\.280 m"):
        read(tmp_path, table({7: SQUARE * (0.2 / 0.28)}))


def test_a_size_that_most_prints_contradict_alike_is_one_line_and_a_bad_print_keeps_its_own(tmp_path: Path) -> None:
    small = {number: SQUARE * (0.2 / 0.28) + number for number in range(60)}
    with pytest.raises(SurveyError) as refused:
        read(tmp_path, table({**small, 99: SQUARE[[0, 2, 1, 3]]}))
    lines = str(refused.value).splitlines()
    assert len(lines) == 3
    assert "60 of 61 markers: their sides are 0.2 to 0.2 m where the print is 0.280 m; check markers.size_m" in lines[1]
    assert "marker 99: its corners are no square" in lines[2]


def test_a_survey_that_is_missing_or_has_no_header_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match="there is no such file"):
        read_survey(tmp_path / "none.csv", 0.28, 0.002)
    (tmp_path / "markers.xlsx").write_bytes(b"PK\x03\x04" + bytes(range(256)))
    with pytest.raises(SurveyError, match=r"markers\.xlsx: is a spreadsheet .*; save it as CSV"):
        read_survey(tmp_path / "markers.xlsx", 0.28, 0.002)
    with pytest.raises(SurveyError, match="first line lacks"):
        read(tmp_path, "1,top-left,0,0,0\n")


def marker(number: int, at: np.ndarray) -> SurveyedMarker:
    return SurveyedMarker(marker_id=number, corners_m=frozen(SQUARE + at), sigma_m=0.002)


def test_one_marker_far_from_the_building_is_named_and_most_of_them_refuse_the_survey() -> None:
    design = model([element("W", "wall", box(0, 0, 0, 3, 0.25, 3))])
    near = [marker(i, FAR + np.array([i, -1.0, 0.0])) for i in range(3)]
    stray = marker(9, FAR + np.array([0.0, 900.0, 0.0]))
    assert check_survey(near, design) == ()
    assert [str(words_of(one)).partition(":")[0] for one in check_survey([*near, stray], design)] == ["marker 9"]
    with pytest.raises(SurveyError, match="world coordinates"):
        check_survey([marker(i, np.zeros(3)) for i in range(3)], design)
    with pytest.raises(SurveyError, match="look exchanged"):
        check_survey([marker(i, (FAR + np.array([i, -1.0, 0.0]))[[1, 0, 2]]) for i in range(3)], design)


def test_a_survey_in_metres_from_another_origin_is_not_taken_for_one_in_millimetres() -> None:
    local = model([element("W", "wall", box(-FAR[0], -FAR[1], -FAR[2], 3, 0.25, 3))])  # the model lies at FAR otherwise
    low = np.concatenate([one.vertices_m for one in local.elements]).min(axis=0)
    assert np.abs(low).max() < 1.0
    survey = [
        SurveyedMarker(marker_id=i, corners_m=frozen([[2000.0 + i, -1500.0, 2.0]]), sigma_m=0.002) for i in range(4)
    ]
    with pytest.raises(SurveyError, match="written from another origin"):
        check_survey(survey, local)
    in_mm = [replace(one, corners_m=frozen(low + 1000.0 * np.array([[one.marker_id, 1.0, 2.0]]))) for one in survey]
    with pytest.raises(SurveyError, match="look like millimetres"):
        check_survey(in_mm, local)


def test_lines_may_end_as_on_any_system_and_what_is_no_csv_is_refused_by_line(tmp_path: Path) -> None:
    path = tmp_path / "markers.csv"
    path.write_bytes(table({7: SQUARE}).replace("\n", "\r").encode())
    np.testing.assert_allclose(read_survey(path, 0.28, 0.002)[0].corners_m, SQUARE)
    with pytest.raises(SurveyError, match=r"markers.csv, line \d+: no CSV \(field larger than field limit"):
        read(tmp_path, table({7: SQUARE}) + "x" * 200_000 + "\n")


@pytest.mark.parametrize(
    ("cell", "put", "says"), [("7,", "9" * 5000 + ",", "is no whole number"), ("1.28", "1e300", "z_m")]
)
def test_numbers_beyond_any_survey_are_refused_by_line(tmp_path: Path, cell: str, put: str, says: str) -> None:
    with pytest.raises(SurveyError, match=says):
        read(tmp_path, table({7: SQUARE}).replace(cell, put, 1))


def test_a_marker_may_be_surveyed_by_its_centre_alone(tmp_path: Path) -> None:
    markers = read(tmp_path, table({7: SQUARE}) + "9,centre,1,2,3\n")
    assert [len(one.corners_m) for one in markers] == [4, 1]
    np.testing.assert_allclose(markers[1].corners_m, [[1.0, 2.0, 3.0]])


def test_a_marker_with_its_centre_and_corners_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match="marker 7 has its centre and corners too"):
        read(tmp_path, table({7: SQUARE}) + "7,centre,1,2,3\n")


AS_TYPED = "id,corner,x_m,y_m,z_m\n" + "".join(
    f"7,{name},{x},{y},{z}\n" for name, (x, y, z) in zip(CORNERS, SQUARE, strict=True)
)
SHORT = ("TL", "TR", "BR", "BL")


@pytest.mark.parametrize(
    ("header", "rows"),
    [
        ("Point,Easting [m],Northing [m],Height [m],Code", "7-{short},{x},{y},{z},tag"),
        ("PointID;E;N;H", "M7_{short};{x};{y};{z}"),
        ("Name\tX\tY\tZ", "tag 7 {corner}\t{x}\t{y}\t{z}"),
        ("Marker,Corner,East,North,Elevation", "7,{short},{x},{y},{z}"),
        ("id,name,corner,x,x_m,y_m,z_m", "7,west,{corner},99,{x},{y},{z}"),
    ],
)
def test_a_total_stations_export_is_read_as_the_survey_that_it_is(header: str, rows: str, tmp_path: Path) -> None:
    """Points such as `7-TL` say marker and corner; stations and control points among them are nobody's corners."""
    lines = [
        rows.format(short=short, corner=corner, x=x, y=y, z=z)
        for short, corner, (x, y, z) in zip(SHORT, CORNERS, SQUARE, strict=True)
    ]
    sign = next(one for one in ",;\t" if one in header)
    others = [] if "orner" in header else [sign.join(["ST1", "0", "0", "0"]), sign.join(["1001", "5", "5", "0"])]
    text = "\n".join([header, *others, *lines])
    assert is_survey(text.splitlines())
    (marker,) = read(tmp_path, text)
    np.testing.assert_allclose(marker.corners_m, SQUARE)  # type: ignore[attr-defined]
    assert marker.marker_id == 7  # type: ignore[attr-defined]


def test_a_total_stations_export_with_decimal_commas_may_have_its_points_last(tmp_path: Path) -> None:
    corners = zip(SHORT, SQUARE, strict=True)
    lines = ["E;N;H;Point", *(f"{x};{y};{z};7-{short}".replace(".", ",") for short, (x, y, z) in corners)]
    (marker,) = read(tmp_path, "\n".join(lines))
    np.testing.assert_allclose(marker.corners_m, SQUARE)  # type: ignore[attr-defined]


def test_a_point_of_a_total_station_that_is_mistyped_leaves_its_marker_without_that_corner(tmp_path: Path) -> None:
    lines = ["point,e,n,h", *(f"7-{s},{x},{y},{z}" for s, (x, y, z) in zip(SHORT, SQUARE, strict=True))]
    with pytest.raises(SurveyError, match="marker 7: bottom-left missing"):
        read(tmp_path, "\n".join(lines).replace("7-BL", "7BL2"))
    with pytest.raises(SurveyError, match="line 5: unknown corner 'LB'"):
        read(tmp_path, "\n".join(lines).replace("7-BL", "7-LB"))


@pytest.mark.parametrize(
    ("header", "says"),
    [
        ("id,corner,Easting (ft),Northing (ft),Height (ft)", r"column `Easting \(ft\)` is in ft; give it in metres"),
        ("id,corner,x,E,y", "lacks z_m"),
        ("id,corner,x,y,z,E", "columns `x` and `E` may both be x_m; name the one that counts x_m"),
    ],
)
def test_headings_that_leave_open_what_is_meant_are_refused(header: str, says: str, tmp_path: Path) -> None:
    rows = AS_TYPED.splitlines()[1:]
    wide = len(header.split(",")) - 5
    with pytest.raises(SurveyError, match=says):
        read(tmp_path, "\n".join([header, *(row + ",1" * wide for row in rows)]))


@pytest.mark.parametrize(
    "text",
    [
        "date,station,x_m,y_m,z_m,bearing_deg\n2026-03-02,G1,1,2,3,90",
        "point,x_m,y_m,z_m,x_px,y_px\nP1,1,2,3,40,50",
        "name,price\nwall,3",
        "",
    ],
)
def test_other_tables_of_places_are_no_survey(text: str) -> None:
    assert not is_survey(text.splitlines())
    assert is_survey(AS_TYPED.splitlines())
