import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from asbuilt_bim.codes import Reason, Subject, SubjectKind
from asbuilt_bim.errors import OutputError, Rejection
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.report.outputs import read_pictures, write_outputs
from asbuilt_bim.report.page.plan import storey_plans
from asbuilt_bim.report.page.write import page_html
from asbuilt_bim.report.wording.values import area, millimetres, percent, percent_certain
from tests.notes import unstated
from tests.report.sample_report import GROUND, HOSTILE_MARKUP, renamed, sample_picture, sample_report


class Page(HTMLParser):
    """Collects tags, links and text, and checks that every element is closed."""

    VOID = frozenset({"meta", "img", "br", "link", "input"})

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.links: list[str] = []
        self.open: list[str] = []
        self.text = ""
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.links += [value for name, value in attrs if name in ("src", "href", "xlink:href", "action") and value]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)

    def handle_endtag(self, tag):
        assert self.open and self.open[-1] == tag, f"{tag} closes {self.open[-3:]}"
        self.open.pop()

    def handle_data(self, data):
        self.text += data


@pytest.fixture(scope="module")
def html() -> str:
    report = sample_report()
    return page_html(report, {station.name: sample_picture() for station in report.stations[:2]})


def test_the_page_is_well_formed(html):
    assert Page(html).open == []


def test_hostile_names_are_text_and_nothing_runs(html):
    page = Page(html)
    assert "script" not in page.tags
    assert HOSTILE_MARKUP in page.text
    assert not re.search(r"\son\w+=", html)


def test_the_page_asks_for_nothing_outside_itself(html):
    assert all(link.startswith(("#", "data:image/jpeg;base64,")) for link in Page(html).links)
    assert "url(" not in html.replace("url(#hatch)", "").replace("url(#seenhatch)", "")
    assert "default-src 'none'" in html


def test_unknown_is_never_zero_percent(html):
    (names,) = re.findall(r"<details[^>]*><summary>[^<]*no photo has shown yet(.*?)</details>", html, re.S)
    assert "C-11" in names and "nothing certain, possibly all" in names and "0" not in re.sub("<.*?>", "", names)


def test_elements_that_nobody_has_seen_grow_the_page_by_little_more_than_their_names():
    few = sample_report()
    unseen = next(one for one in few.elements if one.name == "C-11")
    more = [replace(unseen, global_id=f"{number:022d}", name=f"C-{number}") for number in range(100, 600)]
    many = replace(few, elements=(*few.elements, *more))
    page, short = page_html(many, {}), page_html(few, {})
    assert all(page.count(f'id="e-{one.global_id}"') == 1 for one in more)
    assert "C-599" in page and len(page) - len(short) < 500 * 100


def test_rejected_stations_come_before_any_number_with_value_limit_and_remedy(html):
    alert, progress = html.index('class="alert"'), html.index('id="progress"')
    section = html[alert:progress]
    for text in (
        "Station B2: rejected",
        "0 markers",
        "limit 2 markers",
        "place the red target",
        "Station Süd 3: not placed",
    ):
        assert text in section


def test_a_survey_in_doubt_comes_before_any_number_and_stands_beside_the_money():
    doubt = Rejection(
        code=Reason.SURVEY_SHIFTED_IN_HEIGHT,
        subject=Subject(kind=SubjectKind.SURVEY),
        values={"turn_rad": 0.0, "move_x_m": 0.0, "move_y_m": 0.0, "move_z_m": 3.1, "more": 24},
    )
    page = page_html(replace(sample_report(), rejections=(doubt, *sample_report().rejections)), {})
    first = page.index("Nobody should be paid by these numbers")
    assert first < page.index("+3.10 m in z") < page.index('id="progress"')
    assert page.count("+3.10 m in z") == 1
    assert "Something is known to be wrong" in page[page.index('id="cost"') :]
    assert "known to be wrong" not in page_html(sample_report(), {})


def test_a_station_without_a_picture_says_so():
    assert "no picture of this station" in page_html(sample_report(), {})


def test_the_picture_of_a_rejected_station_is_shown_where_the_project_asks_for_whole_photos():
    hidden = page_html(sample_report(), {"B2": sample_picture(320, 240)})
    assert "Its picture isn't shown" in hidden and 'aria-label="left photo of station B2"' not in hidden
    page = page_html(replace(sample_report(), pictures="whole"), {"B2": sample_picture(320, 240)})
    card = page[page.index("<h3>B2</h3>") :].partition("</section>")[0].partition("<h3>")[2].partition("<h3>")[0]
    assert "rejected" in card and 'aria-label="left photo of station B2"' in card


def test_faces_that_no_photo_decides_are_told_without_reveals_and_covered_ones():
    report = sample_report()
    first, second, *rest = (replace(face, role="side", exposed_area_m2=1.0) for face in report.faces)
    faces = (replace(first, role="reveal"), replace(second, exposed_area_m2=0.0), *rest)
    seen = replace(report, faces=faces, unobserved=tuple(face.face_id for face in faces[:4]))
    page = page_html(seen, {})
    assert f"No photo decides anything on 2 of the design's {len(faces) - 2} exposed faces" in page
    assert "counts as unknown only where no other side of it was seen" in page
    assert "No photo decides" not in page_html(replace(seen, unobserved=seen.unobserved[:2]), {})


def test_an_empty_result_makes_a_page():
    report = sample_report()
    empty = replace(
        report,
        elements=(),
        storeys=(),
        tasks=(),
        cost_lines=(),
        faces=(),
        stations=(),
        rejections=(),
        unmatched=(),
        unobserved=(),
        notes=(),
        earlier_visits=(),
        provenance=None,
    )
    page = Page(page_html(empty, {}))
    assert page.open == [] and "No station was measured" in page.text


@pytest.mark.parametrize(
    ("share", "text"),
    [(None, "unknown"), (0.0, "0 %"), (0.001, "<1 %"), (0.4999, "50 %"), (0.999, ">99 %"), (1.0, "100 %")],
)
def test_nearly_all_is_never_all_and_nearly_nothing_never_nothing(share, text):
    assert percent(share) == text


@pytest.mark.parametrize(
    ("offset", "text"), [(None, "unknown"), (0.0132, "+13 ± 4 mm"), (-0.0132, "−13 ± 4 mm"), (-0.0001, "+0 ± 4 mm")]
)
def test_offsets_carry_their_sign(offset, text):
    assert millimetres(offset, 0.004) == text


@pytest.mark.parametrize(
    ("value", "sigma", "text"),
    [(1.3524, 0.018, "1.35 ± 0.02 m²"), (0.047, 0.0002, "0.047 ± <0.001 m²"), (12345.6, None, "12\u202f345.60 m²")],
)
def test_areas_never_claim_to_be_exact(value, sigma, text):
    assert area(value, sigma) == text


def test_a_share_that_is_certain_is_rounded_down_and_whole_only_where_it_is():
    assert (percent_certain(0.68969), percent_certain(1.0), percent_certain(0.0)) == ("68 %", "100 %", "0 %")


def test_plans_are_turned_along_the_building_and_keep_far_coordinates_sharp():
    plan = storey_plans(sample_report())[0]
    wall = next(element for element in plan.elements if element.name == "W-01 east")
    points = np.array([list(map(float, p.split())) for p in wall.path.strip("MZ").split("L")])
    scale = plan.five_metres / 5.0
    assert len(points) == 4
    assert np.ptp(points, axis=0) == pytest.approx([5.6 * scale, 0.25 * scale], abs=0.3)


def test_stations_stand_within_the_plan_of_the_storey_they_saw():
    ground, first = storey_plans(sample_report())
    assert {station.name for station in ground.stations} == {"A1", "A2"} and first.stations == ()
    assert all(0 <= s.x <= ground.width and ground.top <= s.y <= ground.top + ground.height for s in ground.stations)


def test_a_round_column_is_drawn_round():
    report = sample_report()
    frame = frozen([[2600412.0, 1200731.0, 431.0], [0, 0, 1], [1, 0, 0]])
    faces = tuple(replace(f, kind="cylinder", radius_m=0.3, frame_m=frame) for f in report.faces[:1])
    plan = storey_plans(replace(report, faces=faces, stations=()))[0]
    assert plan.storey == GROUND and plan.elements[0].path.count("L") >= 24


def test_every_output_is_written_and_named(tmp_path):
    report = sample_report()
    (tmp_path / "pictures").mkdir()
    for station in report.stations[:2]:
        (tmp_path / station.picture).write_bytes(sample_picture())
    written = write_outputs(report, tmp_path, tmp_path)
    names = [path.relative_to(tmp_path).as_posix() for path in written]
    day = report.visit_date.isoformat()
    assert names == [
        f"overlays/{day}_A1.jpg",
        f"overlays/{day}_A2.jpg",
        "quantities.csv",
        "quantities.xlsx",
        "tasks.csv",
        "schedule.msp.xml",
        "schedule.p6.xml",
        "issues-2.1.bcf",
        "issues-3.0.bcf",
        "report-interactive.html",
        "report.html",
    ]
    assert all(path.stat().st_size > 500 for path in written)


def test_a_picture_path_that_leaves_the_run_folder_is_not_read(tmp_path):
    report = sample_report()
    (tmp_path / "run").mkdir()
    (tmp_path / "secret.jpg").write_bytes(sample_picture())
    stations = (
        replace(report.stations[0], picture="../secret.jpg"),
        replace(report.stations[1], picture="/etc/hostname"),
    )
    assert read_pictures(replace(report, stations=stations), tmp_path / "run") == {}


def test_a_folder_that_can_not_be_written_is_an_output_error(tmp_path):
    (tmp_path / "quantities.csv").mkdir()
    with pytest.raises(OutputError, match=r"quantities\.csv"):
        write_outputs(sample_report(), tmp_path, tmp_path)


def test_a_name_with_a_lone_surrogate_does_not_stop_the_page(tmp_path):
    written = write_outputs(renamed(sample_report(), 0, name="A\ud800B"), tmp_path, tmp_path)
    assert written[-1].read_bytes().count(b"A") > 0


def test_control_characters_in_names_never_reach_the_page():
    evil = "A\x1b[2J\x07B"
    report = renamed(sample_report(), 0, name=evil)
    storeys = tuple(replace(storey, name=evil) for storey in report.storeys)
    notes = (*report.notes, unstated(evil))
    html = page_html(replace(report, project_name=evil, storeys=storeys, notes=notes), {})
    assert html.count("A[2JB") >= 4 and "\x1b" not in html and "\x07" not in html


def test_pictures_are_found_from_the_run_folder_and_from_their_own_folder(tmp_path):
    report = sample_report()
    folder = tmp_path / "pictures" / "2026-03-16"
    folder.mkdir(parents=True)
    stations = tuple(replace(s, picture=f"pictures/2026-03-16/{s.name}.jpg") for s in report.stations)
    for name in ("A1", "A2", "B2"):
        (folder / f"{name}.jpg").write_bytes(sample_picture(320, 240))
    report = replace(report, stations=stations)
    for root in (tmp_path, folder):
        assert set(read_pictures(report, root)) == {"A1", "A2", "B2"}
