"""What the page says of the time since the visit before."""

from __future__ import annotations

from dataclasses import replace
from datetime import date

from asbuilt_bim.progress.completion.planned import due_but_unknown
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.report.page.rows import since_rows
from asbuilt_bim.report.page.write import page_html
from tests.report.sample_report import renamed, sample_report


def a_visit_before(report: ProgressReport) -> ProgressReport:
    """Return the sample's report as of two weeks earlier, its first element begun and its last one not designed."""
    first = report.elements[0]
    begun = replace(first.completion, lower=0.25, best=0.3)
    before = renamed(report, 0, completion=begun, state="part", as_built_area_m2=1.25, as_built_sigma_m2=0.02)
    return replace(before, visit_date=date(2026, 3, 2), elements=before.elements[:-1])


def test_only_what_reads_otherwise_is_listed_then_and_now() -> None:
    report = sample_report()
    rows = since_rows(a_visit_before(report), report)
    assert {row.element.global_id for row in rows} == {report.elements[0].global_id, report.elements[-1].global_id}
    assert [row.then for row in rows if row.now is report.elements[-1]] == [None]
    assert since_rows(report, report) == ()
    slightly = renamed(report, 0, as_built_area_m2=(report.elements[0].as_built_area_m2 or 0.0) + 1e-4)
    assert since_rows(slightly, report) == ()


def test_other_states_are_counted_apart_from_other_figures_and_come_first() -> None:
    report = sample_report()
    before = a_visit_before(report)
    built = (before.elements[-1].as_built_area_m2 or 0.0) + 1.0
    before = renamed(before, -1, as_built_area_m2=built, as_built_sigma_m2=0.02)
    assert [row.is_other_state for row in since_rows(before, report)] == [True, True, False]
    assert "2 elements changed state</a>; of 1 only figures changed." in page_html(report, {}, (before,))


def test_an_element_that_left_the_design_is_listed_too() -> None:
    report = sample_report()
    (row,) = since_rows(report, replace(report, elements=report.elements[:-1]))
    assert row.now is None and row.element is report.elements[-1]


def test_the_page_tells_both_visits_and_nothing_where_there_was_none_before() -> None:
    report = sample_report()
    page = page_html(report, {}, (a_visit_before(report),))
    assert "What changed since the last visit (2026-03-02)" in page
    assert "1.25 ± 0.02" in page and "not in the design" in page
    assert "What changed since the last visit" not in page_html(report, {})
    assert "Every element is as it was." in page_html(report, {}, (replace(report, visit_date=date(2026, 3, 2)),))


def test_what_should_stand_and_was_seen_too_little_is_named_with_its_link() -> None:
    report = sample_report()
    unseen = replace(report, elements=tuple(replace(e, state="unknown") for e in report.elements))
    key = due_but_unknown(unseen)[0].element.global_id
    assert f'Should stand, too little seen to say: <a href="#e-{key}">' in page_html(unseen, {})
    assert f'Too little seen of <a href="#e-{key}">' in page_html(unseen, {}).partition("<table")[0]
    assert "Should stand, too little seen" not in page_html(report, {})


def test_what_changed_stands_after_what_people_act_on() -> None:
    report = sample_report()
    page = page_html(report, {}, (a_visit_before(report),))
    places = [page.index(f'<section id="{name}"') for name in ("late", "plans", "since", "elements")]
    assert places == sorted(places)
    nav = page[page.index("<nav") :].partition("</nav>")[0]
    named = [nav.index(f'href="#{name}"') for name in ("time", "late", "plans", "since", "elements")]
    assert named == sorted(named)
