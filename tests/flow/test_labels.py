"""`label` writes the masks of the photos it can use, names the others, and never writes over corrections."""

from __future__ import annotations

from pathlib import Path

import pytest

from asbuilt_bim.camera.rig_formats.rig_file import write_rig
from asbuilt_bim.errors import MeasureError, OutputError
from asbuilt_bim.flow.measure_visit import StationJob
from asbuilt_bim.measure.station import MeasureOptions
from asbuilt_bim.report.coco import LabelledPhoto
from asbuilt_bim.terminal.label_command import label_command, label_job
from asbuilt_bim.terminal.screen import Screen
from tests.camera.virtual import rig as virtual_rig
from tests.measure.box_world import site
from tests.measure.test_faces import rig_of
from tests.measure.test_station import FREE, photos
from tests.project_folder import write_project
from tests.site_fixture import small_project, write


def test_a_stations_left_photo_is_labelled_with_walls_and_columns() -> None:
    found = label_job(StationJob(photos=photos(), rig=rig_of(site()[1]), options=FREE))
    assert isinstance(found, LabelledPhoto)
    assert (found.file_name, found.width_px) == ("S1_left.png", 800)
    assert {one.label for one in found.instances} == {"wall", "column"}


def test_a_station_that_cannot_be_used_says_why() -> None:
    found = label_job(StationJob(photos=photos(), rig=rig_of(site()[1]), options=MeasureOptions()))
    assert isinstance(found, str)
    assert "target" in found


def test_labels_that_are_there_are_not_written_over(tmp_path: Path) -> None:
    target = tmp_path / "labels.json"
    target.write_text("corrected by hand")
    project = write_project(tmp_path)
    with pytest.raises(OutputError, match="--replace"):
        label_command(project, target, workers=1, replace=False, allow_outside=False, screen=Screen(quiet=True))
    assert target.read_text() == "corrected by hand"
    with pytest.raises(OutputError, match="file of the project"):
        label_command(project, project, workers=1, replace=True, allow_outside=False, screen=Screen(quiet=True))


def test_where_not_one_photo_can_be_labelled_nothing_is_written_and_corrections_stay(tmp_path: Path) -> None:
    write_rig(virtual_rig(), tmp_path / "any.yaml")
    project = write(tmp_path, small_project(tmp_path, tmp_path / "any.yaml"))
    for photo in (tmp_path / "photos").iterdir():
        photo.unlink()
    target = tmp_path / "labels.json"
    target.write_text("corrected by hand")
    with pytest.raises(MeasureError, match=r"^not one photo could be labelled, so .*labels\.json wasn't written"):
        label_command(project, target, workers=1, replace=True, allow_outside=False, screen=Screen(quiet=True))
    assert target.read_text() == "corrected by hand"


def test_a_place_that_takes_no_labels_is_refused_before_anything_is_measured(tmp_path: Path) -> None:
    project = write_project(tmp_path)
    for target, says in ((tmp_path, "is a folder"), (tmp_path / "none" / "labels.json", "there is no folder")):
        with pytest.raises(OutputError, match=says):
            label_command(project, target, workers=1, replace=True, allow_outside=False, screen=Screen(quiet=True))
