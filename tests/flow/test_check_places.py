"""Today's stations are placed as a run places them, and only what tags leave open is measured for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.camera.rig_formats.reader import read_rig
from asbuilt_bim.codes import Reason
from asbuilt_bim.flow import check_places
from asbuilt_bim.flow.check_places import CheckedPlaces, PlacedBy, near_of, placed_today
from asbuilt_bim.measure.station import StationMeasurement
from asbuilt_bim.project.file import NearFile
from asbuilt_bim.project.model import Project, Station
from asbuilt_bim.project.read import read_project
from asbuilt_bim.project.tables.places import KnownPlaces
from asbuilt_bim.register.pose import SurveyedMarker
from benchmarks.register.design_seen import design_of, measured, standing
from tests.register.designed_scene import TRUE, hall
from tests.register.test_by_design import prints, sees
from tests.site_fixture import rig_file, small_project, write

DESIGN = design_of(hall())
OTHER = standing(1.1, 1.0, 0.0)
NEAR = NearFile(storey="Storey 0", x_m=0.8, y_m=-0.2, bearing_deg=12.0)


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Project:
    folder = tmp_path_factory.mktemp("project")
    return read_project(write(folder, small_project(folder, rig_file(tmp_path_factory), stations=1)))


def placed(
    project: Project, monkeypatch: pytest.MonkeyPatch, near: dict[str, NearFile], survey: Sequence[SurveyedMarker] = ()
) -> tuple[CheckedPlaces, list[str]]:
    """Place two stations of a hall; returns which were measured whole, too."""
    whole = {"A1": sees(measured(DESIGN, TRUE, name="A1"), TRUE, prints()), "A2": measured(DESIGN, OTHER, name="A2")}
    asked: list[str] = []

    def measure(stations: Sequence[Station], *_: object) -> dict[str, StationMeasurement]:
        asked.extend(one.name for one in stations)
        return {one.name: whole[one.name] for one in stations}

    monkeypatch.setattr(check_places, "measure_stations", measure)
    sighted = [replace(one, faces=(), vertical=None) for one in whole.values()]
    stations = [Station(name=name, left=Path(name), right=Path(name), near=near.get(name)) for name in whole]
    rig = read_rig(project.folder / "rig.yaml")
    by = PlacedBy(known=KnownPlaces(survey=tuple(survey)), design=DESIGN)
    return placed_today(sighted, stations, project, rig, date(2026, 3, 20), by, lambda *_: None), asked


def test_a_station_with_a_rough_place_is_measured_and_placed_by_the_design(
    project: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, asked = placed(project, monkeypatch, {"A1": NEAR})
    assert asked[0] == "A1"
    assert {one.pose.station: one.pose.method for one in found.placement.stations} == {"A1": "design"}
    assert np.abs(found.placement.stations[0].pose.world_from_left - TRUE).max() < 0.02


def test_nothing_is_measured_where_nothing_could_place_it(project: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    found, asked = placed(project, monkeypatch, {})
    assert not asked and not found.placement.stations
    assert Reason.MARKERS_TOO_FEW in {one.code for one in found.placement.rejections}


def test_what_tags_place_is_measured_only_where_another_may_be_linked_to_it(
    project: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    survey = [SurveyedMarker(marker_id=tag, corners_m=corners, sigma_m=0.002) for tag, corners in prints().items()]
    found, asked = placed(project, monkeypatch, {}, survey)
    assert {one.pose.method for one in found.placement.stations} == {"markers"}
    assert sorted(asked) == ["A1", "A2"]  # A2 shows no tag: points may link it to A1


def test_a_rough_place_is_of_the_photos_that_the_project_says_it_of(project: Project) -> None:
    visit = project.visits[0]
    told = replace(project, visits=(replace(visit, stations=(replace(visit.stations[0], near=NEAR),)),))
    here = replace(visit.stations[0], name="today")
    elsewhere = replace(here, left=Path("other.jpg"))
    assert [one.near for one in near_of([here, elsewhere], told)] == [NEAR, None]
