from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import cv2
import ifcopenshell
import ifcopenshell.guid
import pytest

from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.codes import REVISIONS, Reason, SubjectKind, about
from asbuilt_bim.errors import MeasureError, OutputError
from asbuilt_bim.flow.measure_visit import Workplace, measure_stations, options_of, picture_name
from asbuilt_bim.flow.output.folder import open_output
from asbuilt_bim.flow.output.publish import previous_result, publish_run, with_revision
from asbuilt_bim.flow.pipeline import RunResult, run_project
from asbuilt_bim.flow.rig_check import MeasureAgain, Outcome, WatchedVisit, watch_rig
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.match.survey_trust import Shift
from asbuilt_bim.measure.station import StationMeasurement, StationPhotos
from asbuilt_bim.measure.station_faces import thumbnail
from asbuilt_bim.measure.station_photos import read_station
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.project.model import Project, Visit
from asbuilt_bim.project.read import read_project
from asbuilt_bim.report.result.document import result_document, write_result
from asbuilt_bim.report.wording.reasons import words_of
from asbuilt_bim.scale.cache import Cache
from asbuilt_bim.scale.codec import plain_digest
from tests.notes import codes, the
from tests.site_fixture import contents, copy_station, rig_file, shared_cache, small_project, write


def one_of_last(project: Project) -> Visit:
    """Return the last visit with the first of its stations alone."""
    return replace(project.visits[-1], stations=project.visits[-1].stations[:1])


class Heard:
    """A progress that remembers."""

    def __init__(self) -> None:
        self.calls: list[tuple[str, int, int, str]] = []

    def __call__(self, step: str, done: int, total: int, what: str = "") -> None:
        self.calls.append((step, done, total, what))


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Project:
    """Two visits of two stations. Judging a station takes two seconds: most tests go on with one of the last visit."""
    folder = tmp_path_factory.mktemp("project")
    made = small_project(folder, rig_file(tmp_path_factory), stations=2)
    first = contents()["visits"][0]
    stations = [copy_station(folder, station, f"E{i}") for i, station in enumerate(first["stations"][:2])]
    made["visits"].append({"date": first["date"], "stations": stations})  # the file's order is not the dates'
    return read_project(write(folder, made))


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Cache:
    """The session's: no other test measures the stations of the first visit under these names."""
    return Cache(folder=shared_cache(tmp_path_factory))


@pytest.fixture
def own_cache(cache: Cache, result: RunResult, tmp_path: Path) -> Cache:
    """What the session has measured, and a test may add to: where the measuring itself is stood in for."""
    assert cache.folder is not None
    shutil.copytree(cache.folder, tmp_path / "cache")
    return Cache(folder=tmp_path / "cache")


@pytest.fixture(scope="module")
def heard() -> Heard:
    return Heard()


def state_of(project: Project) -> dict[Path, tuple[bytes, int]]:
    return {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in project.sources}


@pytest.fixture(scope="module")
def before(project: Project) -> dict[Path, tuple[bytes, int]]:
    return state_of(project)


@pytest.fixture(scope="module")
def result(project: Project, before: object, cache: Cache, heard: Heard) -> RunResult:
    return run_project(project, Workplace(workers=2, cache=cache), heard)


def timeless(report: ProgressReport) -> dict[str, Any]:
    """Return a result without how long its stations took."""
    document = result_document(report)
    return document | {"stations": [{**row, "seconds": None} for row in document["stations"]]}


def test_each_visit_has_a_report_and_knows_the_ones_before(result: RunResult, project: Project) -> None:
    days = [visit.date for visit in project.visits]
    assert days == sorted(days)
    assert [report.visit_date for report in result.reports] == days
    assert result.reports[0].earlier_visits == ()
    assert result.reports[1].earlier_visits == (days[0],)
    assert {r.project_name for r in result.reports} == {project.name}


def test_stations_keep_the_files_order_and_name_their_photos(result: RunResult, project: Project) -> None:
    for report, visit in zip(result.reports, project.visits, strict=True):
        placed = [record.name for record in report.stations]
        assert placed == [station.name for station in visit.stations if station.name in placed]
        assert placed, "the sample's stations can be placed"
        for record in report.stations:
            assert record.left_photo == f"photos/{record.name}_left.jpg"
            assert record.picture == picture_name(visit.date, record.name)
            assert result.pictures[record.picture].startswith(b"\xff\xd8")


def test_progress_counts_every_station_once(result: RunResult, heard: Heard, project: Project) -> None:
    for visit in project.visits:
        step = f"measure {visit.date.isoformat()}"
        calls = [call for call in heard.calls if call[0] == step]
        assert [call[1] for call in calls] == [0, 1, 2]
        assert {call[3] for call in calls[1:]} == {station.name for station in visit.stations}


def test_reading_the_ifc_is_seen_to_begin_and_to_end(heard: Heard) -> None:
    """A large file takes minutes: nobody is to think that the program hangs."""
    calls = [call for call in heard.calls if call[0] == "read the IFC"]
    assert [call[1:3] for call in calls] == [(0, 1), (1, 1)] and calls[-1][3].endswith(".ifc")


def test_what_was_built_at_one_visit_stays_built_at_the_next(result: RunResult) -> None:
    first, second = ({e.global_id: e for e in report.elements} for report in result.reports)
    assert first.keys() == second.keys()
    for key, element in first.items():
        assert second[key].cells_built + second[key].cells_conflict >= element.cells_built - 1e-9, element.name


def test_the_same_inputs_give_the_same_result_measured_again_or_taken_from_the_cache(
    result: RunResult, project: Project, cache: Cache
) -> None:
    again = run_project(project, Workplace(workers=1, cache=cache), Heard())
    assert again.from_cache == 4
    assert [result_document(r) for r in again.reports] == [result_document(r) for r in result.reports]
    (one, _) = project.visits[0].stations  # measured in one process, or in a pool of two: to the last digit
    kept, anew = (
        measure_stations([one], "measure", project, result.rig, Workplace(workers=1, cache=where), Heard())[one.name]
        for where in (cache, Cache(folder=None))
    )
    assert isinstance(kept, StationMeasurement) and isinstance(anew, StationMeasurement)
    assert kept.seconds != anew.seconds, "the clock tells that it was measured again"
    assert plain_digest(replace(anew, seconds=kept.seconds), StationMeasurement) == plain_digest(
        kept, StationMeasurement
    )


def measured_as(kept: StationMeasurement) -> Callable[..., StationMeasurement]:
    """Stand in for the measuring of photos that show what a station showed: its picture alone is theirs."""

    def measure(photos: StationPhotos, rig: StereoRig, *_: object, **__: object) -> StationMeasurement:
        read = read_station(photos, rig)
        assert isinstance(read, tuple)
        left, right = photos.left.digest, photos.right.digest
        return replace(
            kept, station=photos.name, thumbnail_jpeg=thumbnail(read[0]), left_digest=left, right_digest=right
        )

    return measure


def kept_of(project: Project, cache: Cache, result: RunResult, visit: int) -> StationMeasurement:
    """Return the first station of a visit as it was measured."""
    one = project.visits[visit].stations[0]
    place = Workplace(workers=1, cache=cache)
    kept = measure_stations([one], "measure", project, result.rig, place, Heard())[one.name]
    assert isinstance(kept, StationMeasurement)
    return kept


def test_another_option_is_measured_anew(
    project: Project, cache: Cache, result: RunResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[object] = []

    def asked_for(_photos: object, _rig: object, options: object, **_: object) -> None:
        asked.append(options)
        raise MeasureError("not here")

    monkeypatch.setattr("asbuilt_bim.flow.measure_visit.measure_station", asked_for)
    one = replace(project.visits[0], stations=project.visits[0].stations[:1])
    other = replace(project, visits=(one,), target=replace(project.target, diameter_m=None))
    assert options_of(other) != options_of(project)
    assert run_project(other, Workplace(workers=1, cache=cache), Heard()).from_cache == 0
    assert asked == [options_of(other)]
    same = replace(project, visits=(one,))
    assert run_project(same, Workplace(workers=1, cache=cache), Heard()).from_cache == 1 and len(asked) == 1


def test_an_error_of_the_programs_own_rejects_one_station_by_name(
    project: Project, own_cache: Cache, result: RunResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    place, kept = Workplace(workers=1, cache=own_cache), kept_of(project, own_cache, result, 0)

    def broken(*_: object, **__: object) -> None:
        raise IndexError("out of range")

    monkeypatch.setattr("asbuilt_bim.flow.measure_visit.measure_station", broken)
    bad, good = project.visits[0].stations
    visit = replace(project.visits[0], stations=(replace(bad, name="new to the cache"), good))
    report = run_project(replace(project, visits=(visit,)), place, Heard()).reports[0]
    (reason,) = [r for r in report.rejections if r.subject.at_station == "new to the cache"]
    assert (reason.code, reason.values) == (Reason.STATION_CRASHED, {"detail": "IndexError: out of range"})
    assert [record.name for record in report.stations] == [good.name]
    monkeypatch.setattr("asbuilt_bim.flow.measure_visit.measure_station", measured_as(kept))
    visit = replace(visit, stations=visit.stations[:1])
    report = run_project(replace(project, visits=(visit,)), place, Heard()).reports[0]  # the failure was not kept
    assert [record.name for record in report.stations] == ["new to the cache"]


def test_sources_are_only_read(
    project: Project, before: dict[Path, tuple[bytes, int]], result: RunResult, tmp_path: Path
) -> None:
    assert state_of(project) == before
    assert sorted(path.name for path in project.folder.iterdir()) == sorted(
        ["design.ifc", "markers.csv", "photos", "project.yaml", "rig.yaml"]
    )


def test_a_station_left_out_of_an_earlier_visit_is_named_in_the_later_report(project: Project, cache: Cache) -> None:
    first, second = project.visits[0], one_of_last(project)
    gone = replace(first.stations[0], left=first.stations[0].left.with_name("nowhere.jpg"))
    visits = (replace(first, stations=(gone, *first.stations[1:])), second)
    reports = run_project(replace(project, visits=visits), Workplace(workers=1, cache=cache), Heard()).reports
    note = the(reports[1].notes, Reason.STATIONS_NOT_USED)
    assert note.subject == about(SubjectKind.VISIT, first.date.isoformat())
    assert note.values == {"stations": (gone.name,)}
    assert Reason.STATIONS_NOT_USED not in codes(reports[0].notes)


def test_photos_that_tell_another_day_than_the_visits_decide_nothing(
    project: Project, cache: Cache, result: RunResult
) -> None:
    last = project.visits[1].date
    visits = (project.visits[0], replace(project.visits[1], date=last.replace(year=2027)))
    first, second = run_project(replace(project, visits=visits), Workplace(workers=1, cache=cache), Heard()).reports
    assert timeless(first) == timeless(result.reports[0])
    told = second.rejections[0]
    assert told.code is Reason.PHOTOS_OF_OTHER_DAY and told.subject.name == "2027-03-16", "the fault is told first"
    assert told.values["count"] == len(visits[1].stations) and "2026" in str(told.values["days"])
    assert second.nothing_seen and second.faults == (told,)
    assert [e.cells_built for e in second.elements] == [e.cells_built for e in first.elements]
    for element in second.elements:
        assert element.notes[0].code is Reason.DECIDED_NOTHING
        assert element.notes[0].values == {"cause": "photos of another day"}
        assert (element.cells_open == 0.0 and element.completion.upper == 1.0) or element.state == "complete"


def test_two_visits_that_have_each_others_photos_are_called_exchanged(project: Project, cache: Cache) -> None:
    first, second = project.visits
    other = replace(project, visits=(replace(second, date=first.date), replace(first, date=second.date)))
    reports = run_project(other, Workplace(workers=1, cache=cache), Heard()).reports
    for report, others in zip(reports, (second.date, first.date), strict=True):
        (fault,) = report.faults
        assert fault.values["exchanged_with"] == others.isoformat()
        assert "are exchanged: each visit has the other's; exchange the two folders" in str(words_of(fault))


def test_where_the_cameras_clock_is_said_to_be_wrong_its_photos_count(
    project: Project, cache: Cache, result: RunResult, tmp_path: Path
) -> None:
    write_result(result.reports[0], tmp_path / "first.json")
    later = replace(project.visits[1], date=project.visits[1].date.replace(year=2027), camera_clock_wrong=True)
    alone = replace(project, visits=(later,), history=(tmp_path / "first.json",))
    (report,) = run_project(alone, Workplace(workers=1, cache=cache), Heard()).reports
    assert report.placed == result.reports[1].placed
    assert [e.state for e in report.elements] == [e.state for e in result.reports[1].elements]


def test_a_station_of_another_day_is_not_measured_again_with_a_refined_rig(
    project: Project, cache: Cache, result: RunResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refining(outcomes: Sequence[Outcome], rig: StereoRig, again: MeasureAgain | None, _: object) -> WatchedVisit:
        assert again is not None
        assert again([outcome.station for outcome in outcomes], rig) == {}
        return watch_rig(outcomes, rig)

    monkeypatch.setattr("asbuilt_bim.flow.measure_visit.watch_rig", refining)
    visit = replace(project.visits[1], date=project.visits[1].date.replace(year=2027))
    other = replace(project, visits=(visit,), rig=replace(project.rig, refine=True))
    assert run_project(other, Workplace(workers=1, cache=cache), Heard()).reports[0].nothing_seen


def test_a_survey_that_lies_beside_the_design_decides_no_state(
    project: Project, cache: Cache, result: RunResult, tmp_path: Path
) -> None:
    rows = project.survey.read_text(encoding="utf-8").splitlines()
    moved = [[*row.split(",")[:3], f"{float(row.split(',')[3]) + 0.2:.4f}", row.split(",")[4]] for row in rows[1:]]
    survey = tmp_path / "moved.csv"
    survey.write_text("\n".join([rows[0], *(",".join(row) for row in moved)]), encoding="utf-8")
    other = replace(project, survey=survey, visits=(one_of_last(project),))
    (report,) = run_project(other, Workplace(workers=1, cache=cache), Heard()).reports
    assert report.rejections[0].code is Reason.SURVEY_SHIFTED, "the fault is told first"
    assert report.knows_nothing and {e.state for e in report.elements} == {"unknown"}
    assert {(e.completion.best, e.completion.lower, e.completion.upper) for e in report.elements} == {(None, 0.0, 1.0)}
    assert all(e.notes[0].values == {"cause": "survey shifted"} for e in report.elements)
    assert all(station.faces for station in report.stations), "what was measured doesn't rest on the survey"
    accepted = replace(other, accepted_shift=Shift(move_m=frozen([0.0, 0.2, 0.0]), about_m=frozen([0.0, 0.0])))
    (stands,) = run_project(accepted, Workplace(workers=1, cache=cache), Heard()).reports
    assert Reason.SHIFT_ACCEPTED in codes(stands.notes) and not stands.faults
    (alone,) = run_project(replace(project, visits=other.visits), Workplace(workers=1, cache=cache), Heard()).reports
    assert [e.state for e in stands.elements] == [e.state for e in alone.elements]


def test_last_visits_photos_saved_again_are_refused_at_the_later_visit_alone(
    project: Project, own_cache: Cache, result: RunResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = kept_of(project, own_cache, result, 0)
    monkeypatch.setattr("asbuilt_bim.flow.measure_visit.measure_station", measured_as(kept))
    first, second = project.visits
    twin, own = first.stations[0], second.stations[0]
    paths = {}
    for side in ("left", "right"):
        picture = cv2.imread(str(getattr(twin, side)))
        assert picture is not None
        paths[side] = tmp_path / f"{side}.jpg"
        cv2.imwrite(str(paths[side]), picture, [cv2.IMWRITE_JPEG_QUALITY, 88])  # as this leaves EXIF out
    again = replace(own, left=paths["left"], right=paths["right"])
    visits = (first, replace(second, stations=(again,)))
    reports = run_project(replace(project, visits=visits), Workplace(workers=1, cache=own_cache), Heard()).reports
    assert reports[0].placed == result.reports[0].placed, "the rightful one counts"
    assert own.name not in reports[1].placed
    (told,) = [r for r in reports[1].rejections if r.code is Reason.PHOTOS_SAVED_AGAIN]
    assert (told.subject.name, told.values["other"]) == (own.name, twin.name)


def test_a_copy_without_a_date_in_an_earlier_visit_costs_nothing_of_the_visit_whose_day_the_photos_say(
    project: Project, own_cache: Cache, result: RunResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = kept_of(project, own_cache, result, 1)
    monkeypatch.setattr("asbuilt_bim.flow.measure_visit.measure_station", measured_as(kept))
    first, second = project.visits
    own = second.stations[0]
    copies = []
    for side in ("left", "right"):
        picture = cv2.imread(str(getattr(own, side)))
        assert picture is not None
        copies.append(tmp_path / f"{side}.jpg")
        cv2.imwrite(str(copies[-1]), picture, [cv2.IMWRITE_JPEG_QUALITY, 88])  # as a messenger does: without EXIF
    copied = replace(own, name="copied", left=copies[0], right=copies[1])
    visits = (replace(first, stations=(*first.stations, copied)), second)
    reports = run_project(replace(project, visits=visits), Workplace(workers=1, cache=own_cache), Heard()).reports
    assert [report.placed for report in reports] == [report.placed for report in result.reports]
    (told,) = [r for r in reports[0].rejections if r.subject.name == "copied"]
    assert told.values == {"other": own.name, "other_visit": second.date.isoformat()}
    assert [e.state for e in reports[1].elements] == [e.state for e in result.reports[1].elements]


def test_a_visit_under_history_is_handed_on_with_the_run(
    result: RunResult, project: Project, cache: Cache, tmp_path: Path
) -> None:
    write_result(result.reports[0], tmp_path / "first.json")
    last = replace(project, visits=(one_of_last(project),), history=(tmp_path / "first.json",))
    again = run_project(last, Workplace(workers=1, cache=cache), Heard())
    assert [report.visit_date for report in again.past] == [project.visits[0].date]
    assert again.reports[0].earlier_visits == (project.visits[0].date,)


def _exported_again(project: Project, path: Path) -> None:
    """Write the project's IFC file with other GlobalIds."""
    file = ifcopenshell.open(str(project.ifc[0]))
    for rooted in file.by_type("IfcRoot"):
        rooted.GlobalId = ifcopenshell.guid.new()
    file.write(str(path))


def test_changes_against_an_earlier_run_call_no_element_new_that_an_export_gave_a_new_id(
    result: RunResult, project: Project, cache: Cache, tmp_path: Path
) -> None:
    _exported_again(project, tmp_path / "again.ifc")
    other = replace(project, ifc=(tmp_path / "again.ifc",), visits=(one_of_last(project),))
    when = datetime(2026, 3, 17, 12, 0, tzinfo=UTC)
    with open_output(tmp_path / "out", other.sources) as out:
        publish_run(out, result, project, when)
        before = previous_result(out)
        again = with_revision(run_project(other, Workplace(workers=1, cache=cache), Heard()), before)
        published = publish_run(out, again, other, when)
    assert [code for code in codes(again.reports[-1].notes) if code in REVISIONS] == [Reason.DESIGN_NEW_IDS]
    told = (published.folder / "changes.txt").read_text(encoding="utf-8").lower()
    assert "new in the design" not in told and "no longer in the design" not in told


def test_tables_that_name_elements_by_the_ids_of_an_earlier_export_count_at_the_next_run_and_the_one_after(
    result: RunResult, project: Project, cache: Cache, tmp_path: Path
) -> None:
    old, other = (element.global_id for element in result.reports[-1].elements[:2])
    tables = {
        "costs": f"item;text;unit;quantity;rate;globalids\n1;walls;m2;10;20;{old} {other}\n",
        "observations": f"element;date;state;by\n{old};2026-03-15;complete;A. Person\n",
        "schedule": f"id;name;start;finish;globalids\n7;Pour;2026-03-01;2026-03-05;{other}\n",
    }
    for name, text in tables.items():
        (tmp_path / f"{name}.csv").write_text(text, encoding="utf-8")
    its = {name: tmp_path / f"{name}.csv" for name in tables}
    before = result.reports[-1]
    for number in (1, 2):
        _exported_again(project, tmp_path / f"{number}.ifc")
        again = replace(
            project, ifc=(tmp_path / f"{number}.ifc",), visits=(one_of_last(project),), accept_moved=(old, "no"), **its
        )
        before = run_project(again, Workplace(workers=1, cache=cache), Heard(), before).reports[-1]
        today = {key: element.global_id for element in before.elements for key in element.former_ids}
        (line,), (seen,) = before.cost_lines, before.observations
        assert set(line.elements) == {today[old], today[other]} and seen.element == today[old] != old
        assert (today[other],) in [task.progress.elements for task in before.tasks]
        assert Reason.OBSERVATION_UNKNOWN not in codes(before.notes)
        assert the(before.notes, Reason.ACCEPT_MOVED_UNKNOWN).values["elements"] == ("no",)


def test_another_projects_result_is_not_gone_on_from(
    result: RunResult, project: Project, cache: Cache, tmp_path: Path
) -> None:
    place = Workplace(workers=1, cache=cache)
    foreign = tuple(replace(element, global_id=f"{k:022d}") for k, element in enumerate(result.reports[-1].elements))
    faces = tuple(replace(face, element="0" * 22) for face in result.reports[-1].faces)
    before = replace(result.reports[-1], project_name="Block U", elements=foreign, faces=faces)
    with pytest.raises(OutputError, match=r"another project, 'Block U'.*choose another --out"):
        run_project(project, place, Heard(), before)
    write_result(replace(before, visit_date=project.visits[0].date), tmp_path / "foreign.json")
    with pytest.raises(OutputError, match=r"history: has a result of another project, 'Block U'.*take it out"):
        run_project(replace(project, visits=project.visits[1:], history=(tmp_path / "foreign.json",)), place, Heard())


def test_a_visit_under_history_counts_for_a_design_that_was_exported_with_new_ids(
    result: RunResult, project: Project, cache: Cache, tmp_path: Path
) -> None:
    write_result(result.reports[0], tmp_path / "first.json")
    _exported_again(project, tmp_path / "again.ifc")
    last = replace(project, visits=(one_of_last(project),), history=(tmp_path / "first.json",))
    same, again = (
        run_project(replace(last, ifc=(path,)), Workplace(workers=1, cache=cache), Heard()).reports[0]
        for path in (project.ifc[0], tmp_path / "again.ifc")
    )
    assert again.whole.completion == same.whole.completion
    assert {e.global_id for e in again.elements}.isdisjoint(e.global_id for e in same.elements)
    (note,) = [note for note in again.notes if note.code in REVISIONS]
    assert note.code == Reason.DESIGN_NEW_IDS and note.values["count"] == len(same.elements)


def test_a_station_left_out_of_a_visit_under_history_is_named_in_every_later_report(
    project: Project, cache: Cache, tmp_path: Path
) -> None:
    first, second = project.visits[0], one_of_last(project)
    gone = replace(first.stations[0], left=first.stations[0].left.with_name("nowhere.jpg"))
    alone = replace(project, visits=(replace(first, stations=(gone, *first.stations[1:])),))
    place = Workplace(workers=1, cache=cache)
    write_result(run_project(alone, place, Heard()).reports[0], tmp_path / "first.json")
    then = replace(project, visits=(second,), history=(tmp_path / "first.json",))
    (later,) = run_project(then, place, Heard()).reports
    assert the(later.notes, Reason.STATIONS_NOT_USED).values == {"stations": (gone.name,)}
    write_result(later, tmp_path / "second.json")
    third = replace(second, date=second.date.replace(month=12))
    (last,) = run_project(replace(then, visits=(third,), history=(tmp_path / "second.json",)), place, Heard()).reports
    assert the(last.notes, Reason.STATIONS_NOT_USED) == the(later.notes, Reason.STATIONS_NOT_USED)
