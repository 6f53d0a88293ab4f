"""The first screen leads with what is certain; late work and what to do next stand before every table."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import date, datetime

import numpy as np
import pytest

from asbuilt_bim.bim.model import GridLine
from asbuilt_bim.codes import Reason, SubjectKind, about, noted
from asbuilt_bim.errors import Rejection
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.progress.report import Completion, ProgressReport, WantedView
from asbuilt_bim.progress.valuation.bill import bills
from asbuilt_bim.progress.valuation.inputs import Certificate, Terms
from asbuilt_bim.report.page.matrix import matrix_of
from asbuilt_bim.report.page.plan import storey_plans
from asbuilt_bim.report.page.rows import next_rows
from asbuilt_bim.report.page.trend import trend_of
from asbuilt_bim.report.page.write import page_html
from asbuilt_bim.report.wording.completion import best_words, bounds_words, in_words
from asbuilt_bim.report.wording.of_page.card_words import sides_words, unmeasured_words, why_words
from asbuilt_bim.report.wording.of_page.money_words import WHERE_SET, period_words, terms_words
from asbuilt_bim.report.wording.of_page.next_words import COMES_UP, FROM_SCAFFOLD, ON_FLOOR, ONE_FOR_EACH
from asbuilt_bim.report.wording.values import number
from tests.report.sample_report import FIRST, GROUND, renamed, sample_picture, sample_report


def done(lower: float, upper: float, coverage: float, best: float | None = 0.6) -> Completion:
    return Completion(best=best, lower=lower, upper=upper, coverage=coverage)


def wanted(report: ProgressReport, index: int, x: float, y: float) -> WantedView:
    """A view of an element, from metres in front of the middle of its first face, along the world's axes."""
    element = report.elements[index]
    face = next(face for face in report.faces if face.element == element.global_id)
    look = face.frame_m[0]
    return WantedView(
        element=element.global_id, face_id=face.face_id, begun=True, open_m2=1.0, unseen_m2=1.0, look_x_m=look[0],
        look_y_m=look[1], look_z_m=look[2] + 1.5, stand_x_m=look[0] + x, stand_y_m=look[1] + y,
        nearest_station="A1", nearest_m=4.2,
    )  # fmt: skip


def text_of(html: str) -> str:
    return " ".join(re.sub("<[^>]*>", " ", html).split())


def test_the_headline_is_the_lower_bound_and_the_estimate_only_stands_beside_it_where_half_was_seen() -> None:
    report = sample_report()
    for coverage, best in ((0.49, "not enough seen"), (0.51, "60 %")):
        whole = replace(report.whole, completion=done(0.4839, 0.8501, coverage))
        page = page_html(replace(report, whole=whole), {})
        first = text_of(page[page.index('id="progress"') : page.index("<nav")])
        assert first.index("at least 48 %") < first.index("possibly 86 %") < first.index(f"{best} best estimate")
        assert f"{int(coverage * 100)} % seen" in first


def test_bounds_read_as_people_say_them() -> None:
    assert in_words(done(0.429, 1.0, 0.5)) == "at least 42 %, possibly all"
    assert in_words(done(0.0, 1.0, 0.0, None)) == "nothing certain, possibly all"
    assert (bounds_words(1.0, 1.0), bounds_words(0.0, 0.0)) == ("all of it", "nothing of it")
    assert best_words(done(0.1, 0.9, 0.4999)) == "not enough seen"


def test_late_work_and_what_to_do_next_stand_before_the_first_table() -> None:
    report = replace(sample_report(), wanted_views=(wanted(sample_report(), 0, 0.0, 5.0),))
    page = page_html(report, {})
    first = page[page.index('id="progress"') : page.index("<table")]
    assert "<h3>Late</h3>" in first and "<h3>Do next</h3>" in first
    assert text_of(first).count("Stand at 1 on the plan") >= 1


def test_no_place_to_stand_is_given_in_coordinates_and_each_stands_on_the_plan_by_its_number() -> None:
    report = sample_report()
    report = replace(report, wanted_views=(wanted(report, 0, 0.0, 5.0), wanted(report, 5, 40.0, 0.0)))
    rows = next_rows(report)
    assert not any(re.search(r"\bx \d|\by \d|\d{6}", row.words) for row in rows)
    plans = {plan.storey: plan for plan in storey_plans(report)}
    assert [view.number for view in plans[GROUND].views] == [1]
    assert [view.number for view in plans[FIRST].views] == [2]
    assert all(0 <= view.x <= plan.width for plan in plans.values() for view in plan.views)
    assert "of the plan" in rows[0].words


def test_a_place_beyond_an_upper_floor_is_from_a_scaffold_and_one_on_it_is_on_the_floor() -> None:
    report = sample_report()
    middle = next(face for face in report.faces if face.element == report.elements[6].global_id).frame_m[0]
    own = next(face for face in report.faces if face.element == report.elements[5].global_id).frame_m[0]
    half = (middle - own) / 2.0
    views = (wanted(report, 5, float(half[0]), float(half[1])), wanted(report, 5, 40.0, 0.0))
    words = [row.words for row in next_rows(replace(report, wanted_views=views))]
    assert ON_FLOOR in words[0] and FROM_SCAFFOLD in words[1]


def test_what_is_complete_as_far_as_seen_has_its_own_name_and_hatching() -> None:
    report = renamed(sample_report(), 0, as_far_as_seen=True, state="complete")
    page = page_html(report, {})
    assert 'class="chip completeasfarasseen">complete as far as seen' in page
    assert 's-completeasfarasseen" d="M' in page
    states = {element.global_id: element.state for element in storey_plans(report)[0].elements}
    assert states[report.elements[0].global_id] == "complete as far as seen"


def test_an_unknown_element_says_why_and_what_to_do() -> None:
    report = sample_report()
    key = report.elements[5].global_id
    note = noted(Reason.NOT_SEEN, about(SubjectKind.ELEMENT, key), coverage=0.0)
    report = replace(renamed(report, 5, notes=(note,)), wanted_views=(wanted(report, 5, 0.0, 5.0),))
    page = page_html(report, {})
    card = text_of(page[page.index(f'id="e-{key}"') :].partition("</details>")[0])
    assert "Why unknown: Nothing of it was seen" in card and "What to do: Stand at 1 on the plan" in card


def test_a_state_without_a_note_says_what_it_rests_on() -> None:
    report = sample_report()
    seen = Completion(best=0.0, lower=0.0, upper=0.36, coverage=0.64)
    bare = replace(report.elements[0], notes=(), state="not started", completion=seen, cells_built=0.0)
    assert why_words(bare) == "64 % of it was seen, and nothing of that is built"
    assert "next to nothing of that" in why_words(replace(bare, cells_built=1.0))
    complete = replace(bare, state="complete", as_far_as_seen=True, completion=replace(seen, best=1.0, upper=1.0))
    assert why_words(complete) == "64 % of it was seen, all of that built"
    almost = replace(complete, completion=replace(seen, best=0.98))
    assert why_words(almost).endswith("nearly all of that built")
    assert why_words(replace(bare, state="part")) == ""
    page = page_html(replace(report, elements=(bare, *report.elements[1:])), {})
    assert "Why not started:</strong> 64 % of it was seen, and nothing of that is built." in page


def test_the_list_of_places_says_why_those_of_plan_and_check_are_others() -> None:
    report = replace(sample_report(), wanted_views=(wanted(sample_report(), 0, 0.0, 5.0),))
    page = page_html(report, {})
    assert ONE_FOR_EACH in text_of(page[page.index('id="next"') :])


def test_an_elements_card_shows_its_photo_cut_to_it_and_the_page_holds_each_photo_once() -> None:
    report = sample_report()
    page = page_html(report, {station.name: sample_picture() for station in report.stations[:2]})
    assert page.count("data:image/jpeg") == 2
    card = page[page.index(f'id="e-{report.elements[0].global_id}"') :].partition("</details>")[0]
    box, *_ = re.findall(r'rem\)"><svg viewBox="([\d. ]+)" role', card)
    left, top, width, height = map(float, box.split())
    assert left >= 0 and top >= 0 and left + width <= 1281 and top + height <= 961
    assert width * height < 1280 * 960 / 2
    assert "in photo A1 of" in card


def test_then_and_now_stand_side_by_side() -> None:
    report = sample_report()
    before = replace(report, visit_date=date(2026, 3, 2))
    pictures = {station.name: sample_picture() for station in report.stations[:2]}
    page = page_html(report, pictures, (before,), pictures)
    card = page[page.index(f'id="e-{report.elements[0].global_id}"') :].partition("</details>")[0]
    assert card.count('href="#now') == 2 and card.count('href="#then') == 1


def test_a_card_begins_with_what_is_late_and_shows_then_beside_now() -> None:
    report = sample_report()
    task = replace(report.tasks[0], late=True, schedule_finish=datetime(2026, 3, 10, 17))
    done = replace(report.elements[0].completion, best=0.5, upper=0.6)
    element = replace(report.elements[0], state="part", completion=done, unfinished_on=report.visit_date)
    task = replace(task, progress=replace(task.progress, elements=(element.global_id,)))
    report = replace(report, tasks=(task,), elements=(element, *report.elements[1:]))
    before = replace(report, visit_date=date(2026, 3, 2))
    pictures = {station.name: sample_picture() for station in report.stations[:2]}
    page = page_html(report, pictures, (before,), pictures)
    card = page[page.index(f'id="e-{element.global_id}"') :].partition("</details>")[0]
    assert card.index('class="chip loud">late') < card.index("Best estimate")
    shown = re.findall(r'href="#(now|then)', card)
    assert shown[:2] == ["now", "then"]


def test_the_trend_has_a_band_over_the_visits_and_the_plan() -> None:
    report = sample_report()
    before = replace(report, visit_date=date(2026, 3, 2))
    trend = trend_of(report, (before,))
    assert trend is not None and [mark.day for mark in trend.chart.marks] == [date(2026, 3, 2), report.visit_date]
    assert trend.chart.band and 0.0 <= (trend.planned_now or 0.0) <= 1.0
    heights = [float(point.split()[1]) for point in trend.chart.plan[1:].split("L")]
    assert heights == sorted(heights, reverse=True)  # a plan never goes back
    assert trend_of(replace(report, tasks=()), ()) is None


def test_every_link_on_the_page_leads_to_something() -> None:
    report = sample_report()
    report = replace(report, wanted_views=(wanted(report, 0, 0.0, 5.0),))
    page = page_html(report, {station.name: sample_picture() for station in report.stations[:2]})
    notice = page[page.index("Please look at") :].partition("</section>")[0]
    assert 'href="#s-0">picture A1</a>' in notice and '<div class="station" id="s-0">' in page
    ids = set(re.findall(r'id="([^"]+)"', page))
    assert {link for link in re.findall(r'href="#([^"]+)"', page)} <= ids


def test_a_wall_that_does_not_stand_is_shown_where_it_should() -> None:
    """Its design's outline, dashed, in a photo that decided it; what was measured keeps its own outline."""
    report = sample_report()
    missing = report.elements[2]  # seen open from foot to top, measured nowhere
    station = replace(report.stations[0], faces=())
    decided = tuple(
        replace(face, surface=replace(face.surface, stations={station.name: 1.0}))
        if face.element == missing.global_id
        else face
        for face in report.faces
    )
    centre = decided[[face.element for face in decided].index(missing.global_id)].frame_m[0]
    pose = np.eye(4)
    pose[:3, :3] = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]  # looks along the world's y, its z up
    pose[:3, 3] = np.add(centre, [0.0, -6.0, 1.5])
    station = replace(station, world_from_left=frozen(pose), rectified_from_left=frozen(np.eye(3)))
    elements = tuple(replace(e, stations=(station.name,)) if e is missing else e for e in report.elements)
    report = replace(report, faces=decided, elements=elements, stations=(station, *report.stations[1:]))
    page = page_html(report, {station.name: sample_picture()})
    shown = page[page.index(f'id="e-{missing.global_id}"') :].partition("</details>")[0]
    assert "should stand, in photo" in shown and "stroke-dasharray" in shown
    behind = pose.copy()
    behind[:3, 3] = np.add(centre, [0.0, 6.0, 1.5])
    turned = replace(report, stations=(replace(station, world_from_left=frozen(behind)), *report.stations[1:]))
    assert "should stand, in photo" not in page_html(turned, {station.name: sample_picture()})


def test_the_plan_has_north_and_axes_and_its_y_arrow_only_where_no_file_says_north() -> None:
    report = sample_report()
    plan = storey_plans(report)[0]
    assert plan.north is None and plan.axes == () and "where the y axis" in page_html(report, {})
    x, y = (float(value) for value in report.faces[0].frame_m[0, :2])
    line = GridLine(label="<b>7</b>", x1_m=x - 100.0, y1_m=y, x2_m=x + 100.0, y2_m=y)
    far = GridLine(label="far", x1_m=x - 500.0, y1_m=y + 500.0, x2_m=x + 500.0, y2_m=y + 500.0)
    page = page_html(replace(report, north=(0.0, 1.0), grid_lines=(line, far)), {})
    plan = storey_plans(replace(report, north=(0.0, 1.0), grid_lines=(line, far)))[0]
    assert plan.north == pytest.approx(plan.y_axis) and [axis.label for axis in plan.axes] == ["<b>7</b>"]
    axis = plan.axes[0]
    assert 0 <= axis.x <= plan.width and plan.top <= axis.y <= plan.top + plan.height
    assert "<title>north</title>" in page and "where the y axis" not in page and "<b>7</b>" not in page


def test_the_matrix_adds_up_to_the_storeys_and_names_late_work() -> None:
    report = sample_report()
    matrix = matrix_of(report, frozenset({report.elements[3].global_id}))
    assert matrix is not None and matrix.trades.names == ("Columns", "Walls")
    assert [row.storey for row in matrix.rows] == ["Ground floor", "First floor", ""]
    assert sum(cell.elements for cell in matrix.rows[-1].cells if cell) == len(report.elements)
    assert [cell.late for cell in matrix.rows[0].cells if cell] == [0, 1]
    areas = [sum(e.design_area_m2 for e in report.elements if e.ifc_class == one) for one in ("IfcColumn", "IfcWall")]
    lower = sum(e.design_area_m2 * e.completion.lower for e in report.elements) / sum(areas)
    cells = [cell for cell in matrix.rows[-1].cells if cell]
    together = sum(cell.completion.lower * area for cell, area in zip(cells, areas, strict=True)) / sum(areas)
    assert together == pytest.approx(lower, abs=0.002)  # whole cells


def test_the_money_due_is_the_valuations_and_a_fault_stands_beside_it() -> None:
    report = sample_report()
    page = page_html(report, {})
    first = text_of(page[page.index('id="progress"') : page.index("<nav")])
    for bill in bills(report):
        assert text_of(f"{number(bill.period.payable)} {bill.currency} for this period") in first
    assert "Nothing should be paid" not in first
    assert "everything since the start, as no valuation was signed yet" in first
    assert "Retention and tax not set (write them on the sheet Valuation of quantities.xlsx)." in first
    values = {"turn_rad": 0.0, "move_x_m": 0.0, "move_y_m": 0.0, "move_z_m": 3.1, "more": 24}
    doubt = Rejection(code=Reason.SURVEY_SHIFTED_IN_HEIGHT, subject=about(SubjectKind.SURVEY), values=values)
    faulty = replace(report, rejections=(doubt, *report.rejections))
    page = page_html(faulty, {})
    assert "Nothing should be paid" in page[page.index("Money due") : page.index("<nav")]


def test_a_period_says_since_when_it_runs_and_an_unset_term_is_no_silent_0() -> None:
    signed = Certificate(number=2, visit=date(2026, 3, 2), signed_on=date(2026, 3, 5), signed_by="Ann", totals=())
    assert period_words(signed, paid_before=True) == "since valuation 2, signed 2026-03-05"
    assert period_words(None, paid_before=True).startswith("since what was certified before")
    assert terms_words(Terms(retention=0.05, tax=0.19)) == "after 5 % retention and with 19 % tax"
    assert terms_words(Terms(tax=0.19)) == "with 19 % tax, retention not set (" + WHERE_SET + ")"


def test_a_card_says_that_one_side_is_enough_where_the_others_were_not_seen() -> None:
    first = sample_report().elements[0]
    whole = replace(first, state="complete", completion=done(1.0, 1.0, 1.0, 1.0), surface_coverage=0.627)
    told = sides_words(whole)
    assert told.startswith("Complete by the sides that were seen") and told.endswith("62 % was seen")
    part = sides_words(replace(whole, state="part", completion=done(0.5, 1.0, 0.7)))
    assert part.startswith("A part counts as seen by one of its sides") and "62 %" in part
    assert sides_words(replace(whole, surface_coverage=1.0)) == ""
    report = sample_report()
    page = page_html(replace(report, elements=(whole, *report.elements[1:])), {})
    assert f"seen: 100 %. {told}." in text_of(page)


def test_a_card_says_why_something_seen_built_has_no_measured_area() -> None:
    built = replace(sample_report().elements[0], as_built_area_m2=None, as_built_sigma_m2=None)
    assert unmeasured_words(built).startswith("No area was measured")
    assert unmeasured_words(replace(built, cells_built=0.0)) == ""
    assert unmeasured_words(replace(built, as_built_area_m2=1.0)) == ""
    report = sample_report()
    page = page_html(replace(report, elements=(built, *report.elements[1:])), {})
    assert page.count(unmeasured_words(built)) == page_html(report, {}).count(unmeasured_words(built)) + 1


def test_a_card_whose_place_the_page_doesnt_list_says_when_it_comes_up() -> None:
    report = sample_report()
    views = [wanted(report, index, 4.0, 0.0) for index in (0, 1)]
    many = [views[0]] * 12 + [views[1]]
    assert COMES_UP not in page_html(replace(report, wanted_views=tuple(views)), {})
    assert page_html(replace(report, wanted_views=tuple(many)), {}).count(COMES_UP) == 1
