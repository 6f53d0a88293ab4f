"""BCF files are read back whole by a reader of other makers, and a second run adds no topic."""

from __future__ import annotations

import io
import math
import zipfile
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from asbuilt_bim.codes import Reason, SubjectKind, about, noted
from asbuilt_bim.progress.report import ProgressReport, WantedView
from asbuilt_bim.report.bcf.snapshots import snapshots_of
from asbuilt_bim.report.bcf.topics import all_topics
from asbuilt_bim.report.bcf.write import FILES, write_issues
from asbuilt_bim.report.wording.issue_words import IssueKind
from tests.report.sample_report import sample_picture, sample_report

v2 = pytest.importorskip("bcf.v2.bcfxml", reason="bcf-client isn't installed (it comes with ifctester, extra: dev)")
v3 = pytest.importorskip("bcf.v3.bcfxml")
READERS = {"2.1": v2, "3.0": v3}
KEPT: list[Any] = []
"""The reader reads when it is asked, and closes its file when nobody holds it any more."""
HOSTILE = ['<img src=x onerror="alert(1)">', '=HYPERLINK("http://x","y")', "\u202eolleh", "ä" * 300, "a\x00b]]>&amp;"]


def contradicted(name: str = "C-01", day: date | None = None) -> ProgressReport:
    """The sample report, its first element contradicted by photos, and a view of it wanted."""
    report = sample_report()
    first = report.elements[0]
    subject = about(SubjectKind.ELEMENT, first.global_id)
    note = noted(
        Reason.PHOTOS_DISAGREE, subject, kind="column", element=name, cells=2, stations=(report.stations[0].name,)
    )
    element = replace(
        first, name=name, notes=(note,), stations=(report.stations[0].name,), last_seen=day or report.visit_date
    )
    view = WantedView(
        element=first.global_id, face_id=report.faces[0].face_id, begun=True, open_m2=1.0, unseen_m2=1.0,
        look_x_m=1.0, look_y_m=2.0, look_z_m=1.5, stand_x_m=1.0, stand_y_m=8.0, nearest_station="", nearest_m=None,
    )  # fmt: skip
    return replace(
        report, elements=(element, *report.elements[1:]), wanted_views=(view,), visit_date=day or report.visit_date
    )


def loaded(report: ProgressReport, version: str, folder: Path, earlier: tuple[ProgressReport, ...] = ()) -> Any:
    pictures = {station.name: sample_picture(1280, 960) for station in report.stations}
    write_issues(report, earlier, pictures, folder)
    KEPT.append(READERS[version].BcfXml.load(folder / FILES[version]))  # type: ignore[index]
    return KEPT[-1]


@pytest.mark.parametrize("version", FILES)
def test_another_programs_reader_gets_every_topic_with_element_camera_and_picture(version: str, tmp_path: Path) -> None:
    report = contradicted()
    topics = loaded(report, version, tmp_path).topics
    wanted = {topic.guid: topic for topic in all_topics(report)}
    pictures = {station.name: sample_picture(1280, 960) for station in report.stations}
    shown = snapshots_of(report, all_topics(report), pictures)
    assert {wanted[guid].kind for guid in shown} >= {IssueKind.CONTRADICTION, IssueKind.NOT_IN_MODEL}
    assert topics.keys() == wanted.keys()
    kinds = {one.topic.topic_type for one in topics.values()}
    assert {IssueKind.CONTRADICTION, IssueKind.NEXT_VIEW} <= {IssueKind(kind) for kind in kinds}
    for guid, one in topics.items():
        assert (one.topic.title, one.topic.description) == (wanted[guid].title, wanted[guid].text)
        (view,) = one.viewpoints.values()
        selected = view.visualization_info.components.selection
        assert (
            [c.ifc_guid for c in selected.component] == list(wanted[guid].elements) if wanted[guid].elements else True
        )
        assert (view.snapshot is not None) == (guid in shown)


@pytest.mark.parametrize("version", FILES)
def test_each_ifc_file_of_a_design_stands_in_the_header_by_itself(version: str, tmp_path: Path) -> None:
    report = contradicted()
    assert report.provenance is not None
    for joined, single in (
        ("Haus A, Bau 2.ifc, architecture.IFCZIP, mep.ifc", ["Haus A, Bau 2.ifc", "architecture.IFCZIP", "mep.ifc"]),
        ("", []),
    ):
        named = replace(report, provenance=replace(report.provenance, ifc_name=joined))
        for one in loaded(named, version, tmp_path).topics.values():
            header = one.header
            listed = [] if header is None else header.file if version == "2.1" else header.files.file
            assert [file.filename for file in listed] == single


def test_no_topic_carries_what_its_photo_shows_away_from_the_thing() -> None:
    """Fine stripes stand for people: away from every outline none is sharp in a picture."""
    report = contradicted()
    report = replace(report, stations=tuple(replace(one, faces=one.faces[:2]) for one in report.stations))
    image = np.full((960, 1280, 3), 90, np.uint8)
    stripes = (np.arange(580)[None, :] // 4 + np.arange(960)[:, None] // 4) % 2 == 0
    image[:, 700:][stripes] = (0, 255, 0)  # the faces lie to the left of 520
    picture = cv2.imencode(".png", image)[1].tobytes()
    shown = snapshots_of(report, all_topics(report), {one.name: picture for one in report.stations})
    assert len(shown) >= 2
    for data in shown.values():
        piece = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR).astype(int)
        green = (piece[:, :, 1] > 250) & (piece[:, :, 0] < 5) & (piece[:, :, 2] < 5)
        assert not green.any()


@pytest.mark.parametrize("version", FILES)
def test_cameras_stand_where_the_photos_were_taken(version: str, tmp_path: Path) -> None:
    report = contradicted()
    station = report.stations[0]
    assert station.world_from_left is not None
    (one,) = [
        each for each in loaded(report, version, tmp_path).topics.values()
        if each.topic.topic_type == IssueKind.CONTRADICTION
    ]  # fmt: skip
    (view,) = one.viewpoints.values()
    camera = view.visualization_info.perspective_camera

    def vector(point: Any) -> np.ndarray:
        return np.array([point.x, point.y, point.z])

    axis = station.world_from_left[:3, :3] @ station.rectified_from_left.T @ [0.0, 0.0, 1.0]
    assert np.linalg.norm(vector(camera.camera_view_point) - station.world_from_left[:3, 3]) < 0.01
    assert math.degrees(math.acos(min(1.0, float(vector(camera.camera_direction) @ axis)))) < 0.1
    assert abs(float(vector(camera.camera_direction) @ vector(camera.camera_up_vector))) < 1e-6
    if version == "3.0":
        assert camera.field_of_view == pytest.approx(math.degrees(2 * math.atan(station.height_px / 2 / station.f_px)))


def test_a_second_run_writes_the_same_file_and_a_later_visit_adds_no_twin(tmp_path: Path) -> None:
    report = contradicted()
    first = loaded(report, "2.1", tmp_path).topics
    data = (tmp_path / FILES["2.1"]).read_bytes()
    again = loaded(report, "2.1", tmp_path).topics
    assert (tmp_path / FILES["2.1"]).read_bytes() == data and first.keys() == again.keys()
    third = loaded(contradicted(day=date(2026, 5, 4)), "2.1", tmp_path, (report,)).topics
    assert first.keys() <= third.keys()
    assert len({one.topic.title for one in third.values()}) == len(third)
    created = {third[guid].topic.creation_date.to_datetime().date() for guid in first}
    assert created == {report.visit_date}


def test_what_a_later_visit_shows_to_be_over_is_closed_and_what_it_did_not_look_at_stays_open() -> None:
    report = contradicted()
    day = date(2026, 5, 4)
    (guid,) = [topic.guid for topic in all_topics(report) if topic.kind is IssueKind.CONTRADICTION]
    for last_seen, status in ((day, "Closed"), (report.visit_date, "Open")):
        element = replace(report.elements[0], notes=(), last_seen=last_seen)
        later = replace(report, elements=(element, *report.elements[1:]), visit_date=day)
        (topic,) = [one for one in all_topics(later, (report,)) if one.guid == guid]
        assert topic.status == status


def test_what_photos_disagreed_about_keeps_its_photo_where_no_later_one_shows_it() -> None:
    report = contradicted()
    (was,) = [topic for topic in all_topics(report) if topic.kind is IssueKind.CONTRADICTION]
    element = replace(report.elements[0], stations=())  # its notes stay
    later = replace(report, elements=(element, *report.elements[1:]), visit_date=date(2026, 5, 4))
    (topic,) = [one for one in all_topics(later, (report,)) if one.guid == was.guid]
    assert topic.status == "Open" and topic.camera == was.camera is not None and topic.text.startswith(f"{was.text} ")


def test_an_export_with_new_ids_makes_no_new_topics() -> None:
    report = contradicted()
    new = replace(report.elements[0], global_id="1" * 22, former_ids=(report.elements[0].global_id,))
    views = tuple(replace(view, element=new.global_id) for view in report.wanted_views)
    again = replace(report, elements=(new, *report.elements[1:]), wanted_views=views)
    of_element = (IssueKind.CONTRADICTION, IssueKind.NEXT_VIEW)
    was, now = ({t.guid for t in all_topics(one) if t.kind in of_element} for one in (report, again))
    assert was == now != set()


def test_what_lay_beside_the_model_is_closed_by_a_photo_from_there_and_not_by_its_stations_name() -> None:
    report = contradicted()
    (station,) = [one for one in report.stations if any(u.subject.at_station == one.name for u in report.unmatched)]
    assert station.world_from_left is not None
    away = station.world_from_left.copy()
    away[:3, 3] += [11.0, 0.0, 0.0]
    for pose, status in ((station.world_from_left, "Closed"), (away, "Open")):
        moved = tuple(replace(one, world_from_left=pose) if one is station else one for one in report.stations)
        later = replace(report, stations=moved, visit_date=date(2026, 5, 4))
        topics = [one for one in all_topics(later, (report,)) if one.kind is IssueKind.NOT_IN_MODEL]
        assert [one.status for one in topics] == ["Open", status]
        assert "of 2026-05-04 " in next(one.text for one in topics if one.status == "Open")


@pytest.mark.parametrize("version", FILES)
@pytest.mark.parametrize("name", HOSTILE, ids=range(len(HOSTILE)))
def test_hostile_names_stay_text(name: str, version: str, tmp_path: Path) -> None:
    topics = loaded(contradicted(name), version, tmp_path).topics
    clean = name.replace("\x00", "")
    titles = [one.topic.title for one in topics.values()]
    assert any(clean in title for title in titles)
    with zipfile.ZipFile(io.BytesIO((tmp_path / FILES[version]).read_bytes())) as archive:  # type: ignore[index]
        assert all(".." not in entry and not entry.startswith("/") for entry in archive.namelist())
        assert b"<img" not in b"".join(archive.read(entry) for entry in archive.namelist() if entry.endswith(".bcf"))
