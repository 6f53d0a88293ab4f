from dataclasses import replace
from datetime import date
from pathlib import Path

from asbuilt_bim.bim.schedule import EVERY_DAY, ScheduleSource
from asbuilt_bim.codes import Reason, Subject, SubjectKind, Value
from asbuilt_bim.errors import Rejection
from asbuilt_bim.progress.revision import element_label
from asbuilt_bim.progress.valuation.inputs import Certificate, Observation, Override, ValuationInputs, Variation
from asbuilt_bim.report.page.rows import since_rows
from asbuilt_bim.report.wording.changes import changes, write_changes
from asbuilt_bim.report.wording.values import area
from tests.report.sample_report import renamed, sample_report


def _next_visit(report):
    earlier = (*report.earlier_visits, report.visit_date)
    return replace(report, visit_date=date(2026, 3, 30), earlier_visits=earlier)


def test_the_same_result_has_no_changes():
    assert changes(sample_report(), sample_report()) == ()


def test_what_persons_decided_otherwise_is_told_with_their_names():
    report, (key, other) = sample_report(), [e.global_id for e in sample_report().elements[:2]]
    line, name = report.cost_lines[0].global_id, element_label(report.elements[0])
    item, day = report.cost_lines[0].identification or report.cost_lines[0].name, date(2026, 3, 4)
    half = Override(line=line, element=key, share=0.5, reason="seen", by="J. Miller", day=day)
    extra = Variation(number="V1", text="kerb", order="CO-7", unit="m3", quantity=2.0, rate=300.0, share=0.5, by="J")
    seen = Observation(element=other, day=day, share=0.8, by="J. Miller", why="behind the hut")
    one = replace(report, valuation=ValuationInputs(overrides=(half,), variations=(extra,)), observations=(seen,))
    more = ValuationInputs(overrides=(replace(half, share=1.0),), variations=(replace(extra, quantity=4.0),))
    two = replace(report, valuation=more)
    assert changes(report, one) == (
        f"override of {name}, item {item}: new, 50 % (J. Miller, 2026-03-04, seen)",
        "variation V1: new, 2.000 m³ x 300.00, 50 % done (J, CO-7, kerb)",
        f"observation of {element_label(report.elements[1])}, 2026-03-04: new, 80 % (J. Miller, behind the hut)",
    )
    assert changes(one, two) == (
        f"override of {name}, item {item}: 50 % (J. Miller, 2026-03-04, seen) -> 100 % (J. Miller, 2026-03-04, seen)",
        "variation V1: 2.000 m³ x 300.00, 50 % done (J, CO-7, kerb) -> 4.000 m³ x 300.00, 50 % done (J, CO-7, kerb)",
        f"observation of {element_label(report.elements[1])}, 2026-03-04: no longer there, was 80 % (J. Miller, behind "
        "the hut)",
    )
    sign = Certificate(number=1, visit=day, signed_by="A. Architect", signed_on=date(2026, 3, 5), totals=())
    certified, forged = (
        replace(report, valuation=ValuationInputs(certificates=(c,))) for c in (sign, replace(sign, signed_by="B"))
    )
    assert changes(certified, forged) == ("valuation 1: signed 2026-03-05 by A. Architect -> signed 2026-03-05 by B",)


def test_noise_below_what_is_shown_is_no_change():
    report = sample_report()
    built = report.elements[0].as_built_area_m2
    assert changes(report, renamed(report, 0, as_built_area_m2=built + 1e-4)) == ()


def test_what_the_page_lists_since_the_visit_before_is_told_too_if_only_an_areas_sigma_reads_otherwise():
    report = sample_report()
    first = report.elements[0]
    after = renamed(report, 0, as_built_sigma_m2=first.as_built_sigma_m2 + 0.02)
    assert [row.now for row in since_rows(report, after)] == [after.elements[0]]
    (line,) = changes(report, after)
    was, now = (area(first.as_built_area_m2, e.as_built_sigma_m2) for e in (first, after.elements[0]))
    assert line.endswith(f": as-built area {was} -> {now}")


def test_an_element_seen_for_the_first_time_goes_from_unknown_to_a_number():
    report = sample_report()
    done = replace(report.elements[5].completion, best=0.5, coverage=0.6)
    after = renamed(report, 5, completion=done, state="part", as_built_area_m2=2.5, as_built_sigma_m2=0.03)
    assert changes(report, after) == (
        "column C-11: unknown -> part, best estimate not enough seen -> 50 %, seen 0 % -> 60 %, "
        "as-built area unknown -> 2.50 ± 0.03 m²",
    )


def lost(station: str, code: Reason, **values: Value) -> Rejection:
    return Rejection(code=code, subject=Subject(kind=SubjectKind.STATION, name=station), values=values)


def test_stations_that_come_and_go_are_named():
    report = sample_report()
    after = replace(report, stations=report.stations[1:])
    assert (
        changes(report, after)[0] == "station A1: placed -> rejected (station A1, marker 17: contradicts the "
        "other markers and was left out (14 sigma, limit 3 sigma); survey it again: it was moved, or its corners are "
        "mistaken)"
    )
    assert "station A1: no longer there" in changes(report, replace(after, rejections=report.rejections[:1]))


def test_a_station_that_is_new_and_rejected_gives_its_reason():
    report = sample_report()
    more = lost("C9", Reason.PHOTOS_OVERLAP, share=0.03, limit_share=0.3)
    assert changes(report, replace(report, rejections=(*report.rejections, more))) == (
        "station C9: new, rejected (station C9: the frames overlap too little (3 %, limit 30 %); stand further away, "
        "or turn the cameras parallel and calibrate again)",
    )


def test_a_station_that_is_rejected_for_another_reason_is_named_with_it():
    report = sample_report()
    memory, mirrored = lost("C9", Reason.STATION_MEMORY), lost("C9", Reason.STATION_SURVEY_MIRRORED)
    before = replace(report, rejections=(*report.rejections, memory))
    after = replace(report, rejections=(*report.rejections, mirrored))
    assert changes(before, after) == (
        "station C9: rejected (station C9: the survey is a mirror image of the site) now",
    )
    assert changes(before, before) == ()


def test_a_cost_line_with_another_plan_rate_or_certain_value_is_named() -> None:
    report = sample_report()
    first, second, *rest = report.cost_lines
    dearer = replace(first, rate=195.0, planned_quantity=13.0, others=1, earned_lower=first.earned_lower - 10.0)
    after = replace(report, cost_lines=(dearer, *rest, replace(second, name="Formwork, cellar", global_id="3CostNew")))
    was, now = (f"{line.earned_lower:,.2f}".replace(",", "\u202f") for line in (first, dearer))
    assert changes(report, after) == (
        "cost line 01.1 Concrete C30/37, ground floor: planned 12.500 m³ -> 13.000 m³, rate 185.00 -> 195.00, "
        f"not measured 0 -> 1, certain {was} EUR -> {now} EUR",
        "cost line 01.2 Formwork, cellar: new",
        "cost line 01.2 Formwork, ground floor: no longer there",
    )


def test_another_ifc_file_and_another_visit_are_said():
    report = sample_report()
    made = replace(report.provenance, ifc_digest="sha256:00")
    after = replace(_next_visit(report), provenance=made)
    assert changes(report, after) == ("visit: 2026-03-16 -> 2026-03-30", "IFC file: another than before")


def test_stations_of_another_visit_that_have_the_same_names_are_not_the_same_stations():
    report = sample_report()
    stations = tuple(replace(s, left_digest="other", day=date(2026, 3, 30)) for s in report.stations[:1])
    after = replace(_next_visit(report), stations=stations)
    assert changes(report, after) == ("visit: 2026-03-16 -> 2026-03-30",)
    assert any("other photos" in line for line in changes(report, replace(report, stations=stations)))


def test_elements_that_left_the_design_are_named():
    report = sample_report()
    assert "column C-01: no longer in the design" in changes(report, replace(report, elements=report.elements[1:]))


def test_visits_that_come_and_go_between_are_named():
    report = sample_report()
    (earlier,) = report.earlier_visits
    assert changes(report, replace(report, earlier_visits=())) == (
        f"visit {earlier}: no longer among the earlier visits",
    )
    more = replace(report, earlier_visits=(earlier, date(2026, 3, 9)))
    assert changes(report, more) == ("visit 2026-03-09: new among the earlier visits",)
    back = replace(report, visit_date=earlier, earlier_visits=())
    assert changes(report, back)[0] == f"visit: {report.visit_date} -> {earlier}"
    assert not any("among the earlier" in line for line in changes(report, back))


def test_another_schedule_and_the_dates_that_come_with_it_are_said():
    report = sample_report()
    one = ScheduleSource(name="plan.xml", digest="sha256:01", kind="MS Project XML", calendar=EVERY_DAY)
    first, *others = report.tasks
    later = replace(first, schedule_finish=first.schedule_finish.replace(month=4))
    after = replace(report, schedule=one, tasks=(later, *others))
    assert changes(report, after) == (
        "schedule: the IFC's own dates -> plan.xml",
        "task Columns, ground floor: planned finish 2026-03-13 17:00 -> 2026-04-13 17:00",
    )
    assert changes(after, replace(after, schedule=replace(one, digest="sha256:02"))) == (
        "schedule: another than before",
    )
    assert "task First floor: no longer there" in changes(report, replace(report, tasks=report.tasks[:2]))


def test_elements_that_a_mirroreder_scope_leaves_out_are_not_called_gone_from_the_design():
    report = sample_report()
    made = replace(report.provenance, options_digest="sha256:00")
    mirroreder = replace(report, elements=report.elements[1:], provenance=made)
    assert changes(report, mirroreder)[0] == "scope, what is accepted, or options: another than before"
    assert "column C-01: no longer in the scope" in changes(report, mirroreder)
    assert any("column C-01: new in the scope" in line for line in changes(mirroreder, report))


def test_all_changes_stand_in_a_file_a_line_each_whatever_the_names_hold(tmp_path: Path) -> None:
    before = sample_report()
    after = renamed(renamed(before, 0, name="Wall\n\x1b[31m1", state="unknown"), 1, state="unknown")
    write_changes(before, after, tmp_path / "changes.txt")
    lines = (tmp_path / "changes.txt").read_text(encoding="utf-8").splitlines()
    assert (
        lines[0].startswith("Against the earlier run in this folder, of ") and before.visit_date.isoformat() in lines[0]
    )
    assert len(lines) == 1 + len(changes(before, after)) == 3
    assert "\x1b" not in lines[1] and "Wall" in lines[1]
    write_changes(before, before, tmp_path / "changes.txt")
    assert "Nothing has changed." in (tmp_path / "changes.txt").read_text(encoding="utf-8")


def test_storeys_tasks_and_cost_lines_of_one_name_are_known_under_new_ids() -> None:
    report = sample_report()
    other = replace(
        report,
        storeys=tuple(replace(one, key=f"s{number}") for number, one in enumerate(report.storeys)),
        tasks=tuple(
            replace(one, progress=replace(one.progress, key=f"t{number}")) for number, one in enumerate(report.tasks)
        ),
        cost_lines=tuple(replace(one, global_id=f"c{number}") for number, one in enumerate(report.cost_lines)),
    )
    assert not [line for line in changes(report, other) if line.endswith((": new", ": no longer there"))]
    twins = replace(report, cost_lines=(report.cost_lines[0], replace(report.cost_lines[0], global_id="twin")))
    after = replace(report, cost_lines=(replace(report.cost_lines[0], global_id="c0"),))
    assert sum(line.endswith(": no longer there") for line in changes(twins, after)) == 2  # which of two, nobody knows


def test_a_run_of_another_project_in_the_folder_is_said() -> None:
    report = sample_report()
    assert f"project: {report.project_name} -> Other" in changes(report, replace(report, project_name="Other"))
